"""`qddot report STUDY`: one page of any study, with what applies to it, that needs nothing else."""

import re
from pathlib import Path

import numpy as np
import pytest
from browsing import Reader
from commands import command

import qddot
from qddot.runner.commands import report as report_command
from qddot.runner.commands.report import report
from qddot.runner.pictures.picture import Curve, Panel, Picture
from qddot.runner.report import energy
from qddot.runner.report.interactive import plots

ROOT = Path(__file__).parent.parent

CAR = """# Over a bump, to see
# what the tyre does.
title = "A car & a <bump>"
model = "quarter_car"
span = [0, 2]

[parameters]
k_s = 12000.0

[integration]
method = "dop853"
rtol = 1e-9
atol = 1e-12

[inputs.z_r]
kind = "pulse_train"
times = [0.25]
duration = 0.2
impulse = 0.004
"""
SWINGING = """title = "Swinging freely"
model = "double_pendulum"
span = [0, 2]
initial = {theta_1 = 1.0}

[integration]
method = "dop853"
rtol = 1e-10
atol = 1e-12
"""


def equations(name):
    from qddot.codegen.equations.command import equations_page

    return equations_page(name)


def written(folder, text, **given):
    (folder / "study.toml").write_text(text)
    said = {"settings": [], "row": None, "pdf": False, "equations_page": equations} | given
    status = report(folder / "study.toml", into=folder / "page.html", **said)
    return status, folder / "page.html"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    status, page = written(tmp_path_factory.mktemp("car"), CAR)
    assert status == 0
    return page


def headings(page):
    return re.findall(r"<h2 id=[^>]*>([^<]*)</h2>", page.read_text())


def test_the_page_is_whole_and_fetches_nothing(page):
    reader = Reader()
    reader.feed(page.read_text())
    assert not reader.crossed and not reader.open and not reader.fetched
    assert len(reader.ids) == len(set(reader.ids))
    assert {link[1:] for link in reader.links} <= set(reader.ids)
    assert "default-src 'none'" in page.read_text()
    assert [each.name for each in sorted(page.parent.iterdir())] == ["page.html", "study.toml"]


def test_the_page_says_what_was_given_and_what_came_of_it(page):
    text = page.read_text()
    assert headings(page) == ["The run", "In motion", "Parameters", "Inputs", "Results", "Modes", "Energy", "Equations"]
    assert "A car &amp; a &lt;bump&gt;" in text and "Over a bump, to see what the tyre does." in text
    row = re.search(r"<tr><td[^>]*>k_s<.*?</tr>", text, re.DOTALL)[0]
    assert re.findall(r">([^<>]+)</td>", row) == ["k_s", "suspension stiffness", "12000", "N/m", "16000"]
    run = qddot.read_study(page.parent / "study.toml").run()
    assert f">{run.extremes('tyre_force').greatest:.4g}<" in text
    model = qddot.load("quarter_car")
    for mode in qddot.modes(model, {"k_s": 12000.0}):
        assert f">{mode.natural_frequency / (2 * np.pi):.4g}<" in text
    assert text.count("<math") > 10


def test_what_does_not_apply_is_left_out(tmp_path):
    status, page = written(tmp_path, SWINGING, equations_page=lambda name: "<main><h2>Motion</h2></main>")
    assert status == 0
    assert headings(page) == ["The run", "In motion", "Parameters", "Results", "Modes", "Energy", "Equations"]
    assert '<th scope="col" class="number">default</th>' not in page.read_text()  # every value is the default


def test_the_balance_of_energy_holds_and_is_that_of_the_metric():
    model = qddot.load("quarter_car")
    bump = qddot.signal.pulse_train(times=[0.25], duration=0.2, impulse=0.004)
    run = qddot.simulate(model, (0, 2), method="dop853", rtol=1e-10, atol=1e-13, inputs={"z_r": bump})
    found = energy.balance(run, model, None, {"z_r": bump})
    assert found.error < 1e-5 * found.size
    c_s, rate = 1000.0, run.at(found.t)["zdot_s"] - run.at(found.t)["zdot_u"]
    assert found.dissipated[-1] == pytest.approx(np.trapezoid(c_s * rate**2, found.t), rel=1e-3)
    loose = qddot.simulate(model, (0, 2), method="euler", step=1e-3, inputs={"z_r": bump})
    assert energy.balance(loose, model, None, {"z_r": bump}).error > 1e-3 * found.size  # it tells a bad run


def test_energy_jumps_of_an_input_are_integrated_to_both_sides():
    """A force that jumps: m x' x'' of a mass on a spring, work by hand."""
    model = qddot.load("cart_pole")
    push = qddot.signal.table([0.0, 0.5, 0.5 + 1e-9, 1.0], [10.0, 10.0, 0.0, 0.0])
    run = qddot.simulate(model, (0, 1), method="dop853", rtol=1e-10, atol=1e-13, inputs={"F": push}, initial={})
    found = energy.balance(run, model, None, {"F": push})
    assert found.put_in[-1] == pytest.approx(10.0 * run.at(0.5)["x"], rel=1e-6)
    assert found.error < 1e-6 * found.size


def test_long_equations_get_a_page_of_their_own(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(report_command, "_LARGE", 10)
    _, page = written(tmp_path, SWINGING, equations_page=lambda name: f"<main>{name} is long</main>")
    assert 'href="page_equations.html"' in page.read_text()
    assert (tmp_path / "page_equations.html").read_text() == "<main>double_pendulum is long</main>"
    assert "page_equations.html" in capsys.readouterr().out


def test_a_run_that_fails_is_reported_as_far_as_it_went(tmp_path, capsys):
    few = SWINGING.replace("atol = 1e-12", "atol = 1e-12\nmax_steps = 10")
    status, page = written(tmp_path, few)
    assert status == 1
    assert "(partial: up to t = " in page.read_text() and 'class="differs"' in page.read_text()
    assert "error: " in capsys.readouterr().err


def test_nothing_that_report_is_given_is_ignored(tmp_path):
    (tmp_path / "study.toml").write_text(CAR)
    for words, message in (
        (["--set", "span=[0,1]"], "--set is of a study, and none is given"),
        (["--row", "0"], "--row is of a study, and none is given"),
        (["study.toml", "--claims", "c.json"], "--claims is of the paper, and a study is given"),
        (["study.toml", "--row", "5"], "--row 5"),
        (["none.toml"], "none.toml: there is no such file"),
        (["study.toml", "--into", "study.toml/x.html"], "expected a folder"),
    ):
        done = command("report", "--no-pdf", *words, cwd=tmp_path)
        assert done.returncode == 2 and message in done.stderr, (words, done.stderr)
        assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_curves_are_told_apart_in_time_however_far_from_zero_and_run_from_left_to_right():
    x = 1e9 + np.linspace(0, 1, 2001)
    picture = Picture("", (Panel((Curve(x[::-1], np.sin(x[::-1]), "sine"),), "sine"),))
    ((trace,),) = ([plot["traces"] for plot in plots(picture)[1]],)
    assert (np.diff(trace[0]["x"]) > 0).all() and trace[0]["x"][0] == 1e9 and trace[0]["x"][-1] == 1e9 + 1
    assert trace[0]["y"][0] == pytest.approx(np.sin(1e9), rel=1e-5)


READY = "document.documentElement.dataset.ready"
SHOWN = "[...document.querySelectorAll('.plot')].map((e) => e.querySelector('.u-series .u-value').textContent)"
RANGES = "plots.map((e) => [e.plot.scales.x.min, e.plot.scales.x.max])"
FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def opened(chromium, page, place="", **how):
    chromium.open(f"file://{page}{place}", ready=READY, **how)
    chromium.value("globalThis.plots = [...document.querySelectorAll('[data-plot]')], 0")
    chromium.value(FRAMES)


def test_in_a_browser_all_plots_show_the_moment_that_is_chosen(page, chromium):
    opened(chromium, page, "#t=1.25")
    shown = chromium.value(SHOWN)
    assert len(shown) >= 5
    assert {round(float(text.removesuffix("\xa0s")), 2) for text in shown} == {1.25}
    assert chromium.value("document.querySelector('.cursor output').textContent") == "1.25\xa0s"
    run = qddot.read_study(page.parent / "study.toml").run()
    told = chromium.value("plots[1].querySelectorAll('.u-value')[1].textContent")
    value, unit = told.replace("−", "-").split("\xa0")
    near = np.array([run.at(t)["z_s"] for t in (1.245, 1.255)]) * 1e3
    assert unit == "mm" and near.min() <= float(value) <= near.max()
    assert not chromium.complaints()


def test_in_a_browser_keys_move_the_cursor_and_zoom_all_plots(page, chromium):
    opened(chromium, page, "#t=1")
    chromium.value("plots[0].focus()")
    chromium.press("ArrowRight", "ArrowRight")
    assert chromium.value("Number(document.getElementById('cursor').value)") == pytest.approx(1.04, abs=0.003)
    chromium.press("+")
    chromium.value(FRAMES)
    ranges = chromium.value(RANGES)
    assert np.ptp(ranges[0]) == pytest.approx(1.0) and all(each == ranges[0] for each in ranges)
    chromium.press("Escape")
    chromium.value(FRAMES)
    assert all(each == [0, 2] for each in chromium.value(RANGES))
    chromium.press("Tab")
    assert chromium.value("document.activeElement.closest('.plot') === plots[0]")  # its legend switches curves
    chromium.press("Enter")
    assert not chromium.complaints()


def test_in_a_browser_dragging_across_a_plot_zooms_all(page, chromium):
    opened(chromium, page)
    chromium.value("plots[1].scrollIntoView({block: 'center', behavior: 'instant'})")
    place = (
        "(({x, y, width, height}) => [x, y, width, height])(plots[1].querySelector('.u-over').getBoundingClientRect())"
    )
    x, y, width, height = chromium.value(place)
    chromium.drag(*((x + part * width, y + height / 2) for part in (0.25, 0.4, 0.5)))
    chromium.value(FRAMES)
    for low, high in chromium.value(RANGES):
        assert low == pytest.approx(0.5, abs=0.01) and high == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [390, 1400])
def test_at_any_width_and_in_any_light_a_page_is_quiet_asks_nobody_and_is_no_wider(page, chromium, width, dark):
    opened(chromium, page, width=width, dark=dark)
    assert not chromium.complaints() and not chromium.asked_for()
    assert not chromium.wider_than_its_screen()
    assert chromium.value("plots.every((e) => e.querySelector('canvas').width > 0)")


def test_a_page_is_small_and_painted_at_once(page, chromium):
    assert page.stat().st_size < 1_000_000
    opened(chromium, page)
    assert chromium.first_paint() < 1.0
