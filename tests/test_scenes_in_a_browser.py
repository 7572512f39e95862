"""Scenes as they move in a browser: the same picture as Python draws, played, held, dragged, by keys, at any width."""

import re
from itertools import pairwise

import pytest

import qddot
from qddot.runner.scene.animation import Animation

LIVE = "document.querySelector('figure.scene[data-live]')"
#: Shipped models with a run of each that has something to see.
RUNS = {
    "cart_pole": {"initial": {"theta": 3.0, "x": 0.1}},
    "chain": {"initial": {"q_1": 0.01}},
    "double_pendulum": {"initial": {"theta_1": 1.0}},
    "four_bar": {"initial": {"theta_1": 0.35, "thetadot_1": 3.0}, "guess": {"theta_2": 0.7, "theta_3": 1.6}},
    "half_car": {},
    "m113": {"parameters": "as_run_unloaded"},
    "one_axle": {"initial": {"q_2": -1e-4}},
    "pendulum": {"initial": {"theta_2": 0.4}},
    "quarter_car": {"initial": {"z_s": 0.02}},
    "recoil_damper": {"initial": {"x": 0.0}},
}
CONSTANT = {"cart_pole": {"F": 4.0}, "m113": {"F": 900.0}, "recoil_damper": {"F": 30.0}}


def run_of(name, end=2.0):
    model = qddot.load(name)
    inputs = CONSTANT.get(name, {})
    if name in ("half_car", "m113", "quarter_car"):
        road = qddot.road.sine(0.05, 3.0)
        inputs = inputs | qddot.drive(model, road, 2.5, parameters=RUNS[name].get("parameters"))
    method = {"method": "dop853", "rtol": 1e-7, "atol": 1e-9}
    return qddot.simulate(model, (0, end), inputs=inputs, **method, **RUNS[name])


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    return {name: run_of(name).animate().save(folder / f"{name}.html") for name in RUNS}


def strokes(groups):
    """Of each group the numbers of all its paths, in order."""
    return [[float(each) for each in re.findall(r"-?\d+\.?\d*", " ".join(paths))] for paths in groups]


def told(html):
    """The picture that Python writes for where no script runs."""
    picture = re.search(r"<svg.*?</svg>", html, re.DOTALL)[0]
    return [re.findall(r' d="([^"]*)"', group) for group in re.findall(r"<g .*?</g>", picture)]


def on_page(chromium):
    script = """[...document.querySelectorAll('figure.scene svg g')].map((g) => g.style.display === 'none' ? [] :
        [...g.children].map((path) => path.getAttribute('d')))"""
    return chromium.value(script)


@pytest.mark.parametrize("name", RUNS)
def test_the_script_draws_what_python_draws(pages, chromium, name):
    """Two renderers, one picture: each coordinate within a third of a pixel."""
    chromium.open(f"file://{pages[name]}", ready=LIVE)
    assert not chromium.complaints() and not chromium.asked_for()
    ours, theirs = strokes(told(pages[name].read_text())), strokes(on_page(chromium))
    assert len(ours) == len(theirs) == len(qddot.load(name).tables.scene)
    for one, other in zip(ours, theirs, strict=True):
        assert other == pytest.approx(one, abs=0.35)


def slide(chromium, t):
    chromium.value(f"""(() => {{ const slider = document.querySelector('figure.scene input');
        slider.value = {t}; slider.dispatchEvent(new Event('input')); }})()""")


def shown(chromium):
    return float(chromium.value("document.querySelector('figure.scene output').textContent").removesuffix(" s"))


def test_it_plays_holds_and_goes_where_the_slider_is(pages, chromium):
    chromium.open(f"file://{pages['double_pendulum']}", ready=LIVE)
    button = "document.querySelector('figure.scene button')"
    first = on_page(chromium)
    assert chromium.value(f"{button}.textContent") == "Play" and shown(chromium) == 0
    chromium.value(f"{button}.click()")
    chromium.value("new Promise((done) => setTimeout(done, 400))")
    assert chromium.value(f"{button}.textContent") == "Pause"
    assert 0 < shown(chromium) < 2 and on_page(chromium) != first
    chromium.value(f"{button}.click()")
    held = shown(chromium)
    chromium.value("new Promise((done) => setTimeout(done, 200))")
    assert shown(chromium) == held and chromium.value(f"{button}.textContent") == "Play"
    slide(chromium, 0)
    assert on_page(chromium) == first
    slide(chromium, 1.98)
    chromium.value(f"document.querySelector('[data-pace]').value = '1'; {button}.click()")
    chromium.value("new Promise((done) => setTimeout(done, 400))")
    assert shown(chromium) == 2.0 and chromium.value(f"{button}.textContent") == "Play"  # the end holds it
    chromium.value(f"{button}.click()")
    chromium.value("new Promise((done) => setTimeout(done, 100))")
    assert shown(chromium) < 1.0  # and play begins anew
    assert not chromium.complaints()


def test_the_picture_at_the_slider_is_that_of_the_moment(pages, chromium):
    chromium.open(f"file://{pages['double_pendulum']}", ready=LIVE)
    slide(chromium, 1.5)
    (clip,) = run_of("double_pendulum").animate().clips
    box = clip.frames.box
    end = next(values for shape, values in clip.frames.parts() if shape.kind == "bar")
    k = round(1.5 / 2.0 * (len(clip.frames.t) - 1))
    scale = 800 / (box.right - box.left)
    wanted = [(end[k, 2] - box.left) * scale, (box.top - end[k, 3]) * scale]
    assert strokes(on_page(chromium))[0][2:4] == pytest.approx(wanted, abs=2.0)  # half a frame of motion


def test_with_the_keyboard_alone(pages, chromium):
    chromium.open(f"file://{pages['half_car']}", ready=LIVE)
    chromium.press("Tab")
    assert chromium.value("document.activeElement.textContent") == "Play"
    chromium.press("Enter")
    assert chromium.value("document.activeElement.textContent") == "Pause"
    chromium.press("Enter", "Tab")
    before = shown(chromium)
    chromium.press("ArrowRight")
    assert shown(chromium) > before
    assert chromium.value("document.activeElement.getAttribute('aria-valuetext')").endswith(" s")
    chromium.press("Tab")
    assert chromium.value("document.activeElement.getAttribute('aria-label')") == "Speed"


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [390, 1400])
def test_at_any_width_and_in_any_light(pages, chromium, width, dark):
    chromium.open(f"file://{pages['m113']}", width, dark=dark, ready=LIVE)
    assert not chromium.wider_than_its_screen() and not chromium.complaints()
    paper = chromium.value("getComputedStyle(document.querySelector('figure.scene svg')).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", paper)[:3])) < 200) == dark


def test_modes_are_chosen_and_go_round(tmp_path, chromium):
    page = qddot.modes(qddot.load("half_car")).animate().save(tmp_path / "modes.html")
    chromium.open(f"file://{page}", ready=LIVE)
    first = on_page(chromium)
    chromium.value("""(() => { const chosen = document.querySelector('[data-clip]');
        chosen.value = '2'; chosen.dispatchEvent(new Event('change')); })()""")
    assert on_page(chromium) != first
    end = float(chromium.value("document.querySelector('figure.scene input').max"))
    chromium.value("document.querySelector('[data-pace]').value = '0.1'")
    chromium.value("document.querySelector('figure.scene button').click()")
    seen = [(chromium.value("new Promise((done) => setTimeout(done, 250))"), shown(chromium))[1] for _ in range(10)]
    assert any(late < early for early, late in pairwise(seen)) and max(seen) <= end
    assert not chromium.complaints()


def test_a_report_shows_one_moment_in_plots_and_scene(tmp_path, chromium):
    from qddot.runner.commands.report import report

    study = tmp_path / "study.toml"
    study.write_text(
        'model = "quarter_car"\nspan = [0, 2]\ninitial = { z_s = 0.02 }\n[integration]\nmethod = "exact"\nstep = 0.01\n'
    )
    given = {"settings": [], "row": None, "pdf": False, "equations_page": lambda name: "<main></main>"}
    assert report(study, into=tmp_path / "page.html", **given) == 0
    chromium.open(f"file://{tmp_path / 'page.html'}", ready="document.documentElement.dataset.ready")
    assert chromium.value("document.querySelectorAll('figure.scene[data-live]').length") == 2  # the run, and its modes
    first = on_page(chromium)
    chromium.value("""(() => { const slider = document.getElementById('cursor');
        slider.value = 1.2; slider.dispatchEvent(new Event('input')); })()""")
    assert shown(chromium) == pytest.approx(1.2, abs=2e-3) and on_page(chromium) != first
    slide(chromium, 0.5)
    assert float(chromium.value("document.getElementById('cursor').value")) == pytest.approx(0.5, abs=2e-3)
    chromium.value("document.querySelector('figure.scene button').click()")
    chromium.value("new Promise((done) => setTimeout(done, 500))")
    assert chromium.value("document.querySelector('figure.scene button').textContent") == "Pause"  # plots follow it
    assert float(chromium.value("document.getElementById('cursor').value")) > 0.55
    assert not chromium.complaints()
    chromium.open(f"file://{tmp_path / 'page.html'}#t=1.2", ready="document.documentElement.dataset.ready")
    assert shown(chromium) == pytest.approx(1.2, abs=2e-3)


def test_a_page_may_hold_several_animations(tmp_path, chromium):
    one, other = (run_of(name).animate()._repr_html_() for name in ("pendulum", "chain"))
    page = tmp_path / "notebook.html"
    page.write_text(f"<!DOCTYPE html><title>x</title>{one}{other}")
    chromium.open(f"file://{page}", ready="document.querySelectorAll('figure.scene[data-live]').length === 2")
    assert not chromium.complaints()
    assert isinstance(run_of("pendulum").animate(), Animation)
