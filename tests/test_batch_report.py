"""`qddot report` of a batch: a page whose plots and tables show the same runs, whichever way they were chosen."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from browsing import Reader
from commands import command

from qddot.runner.batch.results import Results
from qddot.runner.report import batch_axes, batch_figures
from qddot.runner.report.batch_page import write

SWEEP = """# Which stiffness
# rides best?
title = "Stiffness & damping"
model = "quarter_car"
span = [0, 2]

[integration]
method = "exact"

[inputs.z_r]
kind = "pulse_train"
times = [0.1]
duration = 0.2
impulse = 0.004

[[sweep.axes]]
name = "stiffness"
key = "parameters.k_s"
linspace = [8000.0, 24000.0, 9]

[[sweep.axes]]
name = "damping"
key = "parameters.c_s"
logspace = [300.0, 3000.0, 5]

[metrics.travel]
kind = "max_abs"
of = "delta_s"

[metrics.force]
kind = "max_abs"
of = "tyre_force"

[outputs]
interval = "5 ms"
keep = ["z_s"]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("batch")
    (folder / "car.toml").write_text(SWEEP)
    assert command("batch", "car.toml", "--no-figure", cwd=folder).returncode == 0
    done = command("report", "car.toml", "--batch", "--no-pdf", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "wrote results/car.html\n"
    return folder


@pytest.fixture(scope="module")
def results(folder):
    return Results(folder / "results" / "car.zarr")


def data_of(page):
    return json.loads(re.search(r'<script id="data"[^>]*>(.*?)</script>', page.read_text(), re.DOTALL)[1])


def test_the_page_is_whole_small_and_says_what_the_store_holds(folder, results):
    page = folder / "results" / "car.html"
    reader = Reader()
    reader.feed(page.read_text())
    assert not reader.crossed and not reader.open and not reader.fetched
    assert len(reader.ids) == len(set(reader.ids))
    assert page.stat().st_size < 500_000
    text = page.read_text()
    assert "Which stiffness rides best?" in text and "45 of 45 runs, 0 failed" in text
    best = results.best_first("travel")[0]
    assert f">{results.column('travel')[best]:.4g}<" in text
    runs = data_of(page)["own"]["runs"]
    travel = next(each for each in runs["columns"] if each["name"] == "travel")
    assert travel["unit"] == "mm"
    assert np.allclose(travel["values"], 1e3 * results.column("travel"), rtol=1e-5)
    assert runs["over"] == ["stiffness", "damping"]


def test_the_store_itself_is_reported_and_nothing_that_is_given_is_ignored(folder):
    again = command("report", "results/car.zarr", "--into", "other.html", "--no-pdf", cwd=folder)
    assert again.returncode == 0 and (folder / "other.html").is_file()
    for words, message in (
        (["results/car.zarr", "--row", "1"], "--row: the report is of a batch"),
        (["results/car.zarr", "--set", "span=[0,1]"], "--set: the report is of a batch"),
        (["--batch"], "--batch is of a study, and none is given"),
        (["none.zarr"], "none.zarr"),
    ):
        done = command("report", *words, "--no-pdf", cwd=folder)
        assert done.returncode == 2 and message in done.stderr and "Traceback" not in done.stderr, done.stderr


@pytest.fixture
def opened(folder, chromium):
    def show(**how):
        page = folder / "results" / "car.html"
        chromium.open(f"file://{page}", ready="document.documentElement.dataset.ready", **how)
        return chromium

    return show


CHOSEN = "document.getElementById('chosen').textContent"
BOX = "(({x, y, width, height}) => [x, y, width, height])"


def set_bound(chromium, label, value):
    where = f"document.querySelector('[aria-label=\"{label}\"]')"
    chromium.value(f"{where}.value = '{value}', {where}.dispatchEvent(new Event('change')), 0")


def test_runs_chosen_by_bounds_are_those_that_numpy_chooses(opened, results):
    chromium = opened()
    assert chromium.value(CHOSEN) == "45 of 45 runs chosen"
    middle = float(np.median(results.column("travel"))) * 1.0001e3
    set_bound(chromium, "travel at most", middle)
    set_bound(chromium, "stiffness at least", 12000)
    inside = (results.column("travel") * 1e3 <= middle) & (results.column("stiffness") >= 12000)
    assert chromium.value(CHOSEN) == f"{inside.sum()} of 45 runs chosen"
    rows = chromium.value(
        "[...document.querySelectorAll('#rows tbody tr')].map((row) => Number(row.cells[0].textContent))"
    )
    assert rows == np.flatnonzero(inside).tolist()
    chromium.value("document.getElementById('all').click()")
    assert chromium.value(CHOSEN) == "45 of 45 runs chosen" and not chromium.complaints()


def test_dragging_across_the_shares_of_a_metric_chooses_runs_and_shows_their_shares(opened, results):
    chromium = opened()
    place = "document.querySelector('[data-linked=shares]')"
    chromium.value(f"{place}.scrollIntoView({{block: 'center', behavior: 'instant'}})")
    x, y, width, height = chromium.value(f"{BOX}({place}.querySelector('.u-over').getBoundingClientRect())")
    chromium.drag(*((x + part * width, y + height / 2) for part in (0.02, 0.2, 0.5)))
    chosen = int(chromium.value(CHOSEN).split()[0])
    assert 0 < chosen < 45
    low, high = (
        float(chromium.value(f"document.querySelector('[aria-label=\"travel at {side}\"]').value"))
        for side in ("least", "most")
    )
    values = results.column("travel") * 1e3
    assert chosen == np.count_nonzero((values >= low * (1 - 1e-5)) & (values <= high * (1 + 1e-5)))
    both = chromium.value(f"{place}.plot.data.slice(1).map((v) => [...v])")
    assert both[0] == pytest.approx(np.arange(1, 46) / 45)
    inside = np.sort(values)
    share = np.cumsum((inside >= low) & (inside <= high)) / chosen
    assert both[1] == pytest.approx(share)
    chromium.drag((x + 0.5 * width, y + height / 2))  # twice, as a person would, lets go
    assert not chromium.complaints()


def test_the_best_tenth_is_chosen_with_the_keyboard_alone(opened, results):
    chromium = opened()
    chromium.value("document.querySelector('[aria-label=\"Best tenth by force\"]').focus()")
    chromium.press("Enter")
    assert chromium.value(CHOSEN) == "5 of 45 runs chosen"
    rows = chromium.value(
        "[...document.querySelectorAll('#rows tbody tr')].map((row) => Number(row.cells[0].textContent))"
    )
    assert sorted(rows) == sorted(results.best_first("force")[:5].tolist())


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [390, 1400])
def test_at_any_width_and_in_any_light_the_page_is_quiet_asks_nobody_and_is_no_wider(opened, width, dark):
    chromium = opened(width=width, dark=dark)
    assert not chromium.complaints() and not chromium.asked_for()
    assert not chromium.wider_than_its_screen()
    assert chromium.first_paint() < 1.0
    drawn = chromium.value(
        "[...document.querySelectorAll('[data-linked]')].map((e) => e.querySelector('canvas').width)"
    )
    assert len(drawn) == 5 and all(drawn)
    assert chromium.value("getComputedStyle(document.getElementById('rows').parentElement).overflowX") == "auto"


def test_of_many_runs_the_page_holds_some_evenly_and_says_so(results, tmp_path, monkeypatch):
    monkeypatch.setattr("qddot.runner.report.batch_page.MOST", 9)
    page = write(results, tmp_path / "few.html")
    assert data_of(page)["own"]["runs"]["numbers"] == np.linspace(0, 44, 9).round().tolist()
    assert "Every 5th of 45 runs is shown here." in page.read_text()


def test_a_grid_is_the_mean_over_what_is_not_shown_and_no_grid_is_told():
    x, y, z = np.array([0.0, 1, 0, 1, 0]), np.array([0.0, 0, 1, 1, 0]), np.array([1.0, 2, 3, np.nan, 5])
    columns, rows, mean = batch_axes.grid(x, y, z)
    assert columns.tolist() == rows.tolist() == [0, 1]
    assert mean[0].tolist() == [3, 2] and mean[1, 0] == 3 and np.isnan(mean[1, 1])
    assert batch_axes.gridded(x, y) and not batch_axes.gridded(np.arange(5.0), np.arange(5.0))


def test_many_sampled_runs_are_a_band_of_quantiles_and_few_are_points():
    rng = np.random.default_rng(1)
    x = rng.uniform(0, 1, 4000)
    y = x + rng.normal(0, 0.1, 4000)
    drawn = []
    panel = SimpleNamespace(
        plot=lambda *what, **how: drawn.append((what, how)),
        fill_between=lambda at, low, high, **how: drawn.append(((at, low, high), how)),
    )
    batch_figures._cloud(panel, x, y, "ride", "C0")
    (at, low, high), _ = drawn[-1]
    assert np.abs(low - (at - 0.1645)).max() < 0.12 and np.abs(high - (at + 0.1645)).max() < 0.12
    assert drawn[0][1]["alpha"] < 0.2
    drawn.clear()
    batch_figures._cloud(panel, x[:100], y[:100], "ride", "C0")
    assert len(drawn) == 1 and drawn[0][0][2] == "."
