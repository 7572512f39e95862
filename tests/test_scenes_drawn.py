"""Scenes as pictures: what is seen and how large, roads that go by, models that go far, modes, moments, saved runs."""

import base64
import json
import math
import pickle
import re

import numpy as np
import pytest
from commands import command

import qddot
from qddot.runner.scene.animation import Clip, _pace, _packed
from qddot.runner.scene.filmed import filmed, on_lines
from qddot.runner.scene.frames import SceneError, frames
from qddot.runner.scene.road import road_of

CAR = {"method": "dop853", "rtol": 1e-8, "atol": 1e-10}


def film_of(run, times):
    simulation = run.between.simulation
    span, states = (float(run.t[0]), float(run.t[-1])), lambda t: run.at(t).values[:, : run.n_states]
    return filmed(simulation.model, simulation.problem.constants, simulation.problem.inputs, span, states)._frames(
        times
    )


@pytest.fixture(scope="module")
def drive():
    """The half car at 10 m/s over a random road, and what its wheels read of it."""
    model = qddot.load("half_car")
    road = qddot.road.iso8608("D", seed=3, length=60.0, fade=5.0)
    inputs = qddot.drive(model, road, 10.0, start=-2.0)
    return qddot.simulate(model, (0, 3), inputs=inputs, **CAR), road


def test_the_road_is_that_which_the_wheels_read_and_goes_by(drive):
    run, road = drive
    t = np.linspace(0.0, 3.0, 31)
    film = film_of(run, t)
    assert film.road.speed == 10.0
    assert film.way == pytest.approx(10.0 * t)
    at = run.at(t)
    for name, ahead in (("w_f", 1.3), ("w_r", -1.5)):
        assert film.road.along(ahead + film.way) == pytest.approx(at[name], abs=1e-12)
    assert film.road.along(np.array([7.7])) == pytest.approx(
        road(np.array([7.7 - 2.0])), abs=1e-12
    )  # between the wheels, too


def test_a_pulse_in_time_is_no_road_and_neither_is_a_wheel_that_reads_another():
    model = qddot.load("half_car")
    c = model.constants(model.parameter_values())
    bump = qddot.signal.pulse_train(times=[0.5], duration=0.2, impulse=0.004)
    road = qddot.road.sine(0.1, 3.0)
    driven = qddot.drive(model, road, 5.0)
    for inputs in ({"w_f": bump}, {"w_f": bump, "w_r": bump}, {}, {**driven, "w_r": road.shifted(5.0, 0.3)}):
        run = qddot.simulate(model, (0, 1), inputs=inputs, step=1e-2)
        assert road_of(model, c, run.between.simulation.problem.inputs, ["w_r", "w_f"]) is None
    run = qddot.simulate(model, (0, 1), inputs=driven, step=1e-2)
    assert road_of(model, c, run.between.simulation.problem.inputs, ["w_r", "w_f"]).speed == 5.0
    single = qddot.load("quarter_car")
    pulse = qddot.simulate(single, (0, 1), inputs={"z_r": bump}, step=1e-2)
    table = pulse.between.simulation.problem.inputs
    assert road_of(single, single.constants(single.parameter_values()), table, ["z_r"]) is None


def test_all_of_a_run_is_seen_with_the_longest_arrow_a_fifth_of_it():
    model = qddot.load("cart_pole")
    push = qddot.signal.pulse_train(times=[0.2], duration=0.2, peak=30.0)
    run = qddot.simulate(model, (0, 1), inputs={"F": push}, initial={"theta": 3.0}, **CAR)
    film = film_of(run, np.linspace(0, 1, 101))
    box = film.box
    arrow = next(values for shape, values in film.parts() if shape.kind == "arrow")
    longest = np.abs(arrow[:, 2]).max()
    force = run.at(film.t)["F"]
    assert arrow[:, 2] == pytest.approx(force / force.max() * longest)
    assert longest == pytest.approx(0.2 * 1.27, rel=0.02)  # the pole of 1 m hangs below the cart: so high is a frame
    for shape, values in film.parts():
        if shape.kind != "ground":
            x = values[:, [0, 2]] if shape.kind == "bar" else values[:, [-4 if shape.kind == "polygon" else 0]]
            assert (x > box.left).all() and (x < box.right).all()
    assert 1.0 <= (box.right - box.left) / (box.top - box.bottom) <= 3.0


def test_a_model_that_goes_far_is_followed():
    model = qddot.load("cart_pole")
    run = qddot.simulate(model, (0, 10), initial={"theta": 3.0, "xdot": 4.0}, **CAR)
    t = np.linspace(0, 10, 51)
    film = film_of(run, t)
    x = run.at(t)["x"]
    assert np.ptp(x) > 10.0
    assert film.way == pytest.approx(x)  # most of its shapes stand on the cart
    assert film.box.right - film.box.left < 5.0
    bar = next(values for shape, values in film.parts() if shape.kind == "bar")
    assert bar[:, 0] == pytest.approx(0.0, abs=1e-12)


def test_what_acts_for_a_moment_is_in_a_frame():
    """A shot of 2 ms in a run of 40 s, whose frames are 26 ms apart."""
    model = qddot.load("m113")
    shot = qddot.signal.pulse_train(times=[20.013], duration=0.02, impulse=605.0)
    run = qddot.simulate(model, (0, 40), method="exact", step=5e-3, parameters="as_run_unloaded", inputs={"F": shot})
    (clip,) = run.animate().clips
    flash = [values[:, -1] for shape, values in clip.frames.parts() if shape.conditional][-1]
    lit = clip.frames.t[flash > 0]
    assert len(lit) >= 1 and np.abs(lit - 20.02).max() < 0.06
    arrow = next(values for shape, values in clip.frames.parts() if shape.kind == "arrow")
    assert np.abs(arrow[:, 2]).max() > 0.5 and (np.abs(arrow[clip.frames.t < 19.9, 2]) == 0).all()


def test_numbers_are_packed_to_what_nobody_sees():
    values = np.random.default_rng(1).uniform(-3, 5, 500)
    packed = _packed(values, 8.0)
    whole = np.frombuffer(base64.b64decode(packed["data"]), "<u2")
    assert packed["low"] + packed["step"] * whole == pytest.approx(values, abs=8.0 / 65535)
    assert _packed(np.full(9, 0.123456789), 1.0) == 0.1234568
    assert _packed(np.array([1.0, 1.00001]), 1.0) == 1.0


def test_a_clip_takes_some_seconds_to_show():
    for duration in (1e-3, 0.1, 3.0, 10.0, 500.0, 1e5):
        paces, pace = _pace(duration, 4.0, 20.0)
        assert pace in paces and 2.5 < duration / pace < 33.0
    assert _pace(10.0, 4.0, 20.0)[1] == 1.0


def test_a_mode_moves_along_its_eigenvector_by_a_part_of_what_is_seen():
    model = qddot.load("half_car")
    found = qddot.modes(model)
    J = model.matrix("jacobian")(0.0, np.zeros(8), np.zeros(4), model.constants(model.parameter_values()))
    for k, mode in enumerate(found):
        shape = found._filmed._normed(k)
        assert J @ shape == pytest.approx(mode.eigenvalue * shape, rel=1e-7, abs=1e-7)
        assert np.abs(shape[:4]).max() == pytest.approx(1.0)
    animation = found.animate()
    assert [clip.name.partition(":")[0] for clip in animation.clips] == ["1", "2", "3", "4"]
    for clip, mode in zip(animation.clips, found, strict=True):
        t = clip.frames.t
        assert clip.loop and t[-1] == pytest.approx(mode.damped_period)
        assert clip.frames.numbers[-1] == pytest.approx(clip.frames.numbers[0], abs=1e-9)  # the end joins the start
        moved = max(np.ptp(values, axis=0).max() for shape, values in clip.frames.parts() if shape.kind == "wheel")
        assert 0.01 < moved < 1.0
    assert len(found.animate(2).clips) == 1


def test_a_mode_that_does_not_swing_falls_back():
    model = qddot.load("recoil_damper")
    found = qddot.modes(model)
    k = next(k for k, mode in enumerate(found) if not mode.oscillating and mode.participation["x"] > 0.1)
    (clip,) = found.animate(k).clips
    body = next(values for shape, values in clip.frames.parts() if shape.kind == "spring")[:, 2]
    assert (np.diff(np.abs(body - body[-1])) <= 0).all() and abs(body[0] - body[-1]) > 1e-3
    assert "no swing" in clip.name


def test_modes_are_refused_by_number_and_survive_pickling():
    found = qddot.modes(qddot.load("quarter_car"))
    for k in (2, -1, True, 0.5):
        with pytest.raises(ValueError, match="expected the number of a mode from 0 to 1"):
            found.animate(k)
    again = pickle.loads(pickle.dumps(found))
    assert again == found and len(again.animate().clips) == 2


def test_a_moment_is_a_figure_and_times_outside_are_refused(drive):
    run, _ = drive
    figure = run.scene(1.5, "At 1.5 s")
    (axis,) = figure.axes
    assert len(axis.patches) > 6 and "At 1.5 s" in {text.get_text() for text in figure.texts}
    width, height = figure.get_size_inches()
    assert width > height
    assert figure._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match=r"t is 5 s, but the run goes from 0 to 3 s"):
        run.scene(5.0)
    again = pickle.loads(pickle.dumps(run))
    assert again.animate().figure == run.animate().figure


def test_what_cannot_be_drawn_is_said():
    oscillator = qddot.load("tests/sample_models/oscillator.py")
    run = qddot.simulate(oscillator, (0, 1), step=0.01)
    with pytest.raises(SceneError, match="model oscillator has no scene: give its System shapes"):
        run.animate()
    with pytest.raises(ValueError, match="saved points alone"):
        type(run)(**{name: getattr(run, name) for name in run.__dataclass_fields__} | {"between": None}).animate()
    model = qddot.load("quarter_car")
    states = np.array([[0.0, np.nan, 0.0, 0.0]])
    with pytest.raises(SceneError, match=r"scene\[1\], spring, has a place that is nan at t = 2 s"):
        frames(model, model.constants(model.parameter_values()), np.array([2.0]), states, np.zeros((1, 2)))


def test_an_animation_is_a_figure_of_html_that_ends_no_script(tmp_path, drive):
    run, _ = drive
    shown = run.animate()
    html = shown._repr_html_()
    data = json.loads(re.search(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)[1])
    assert [shape["kind"] for shape in data["shapes"]] == [s.kind for s in qddot.load("half_car").tables.scene]
    assert len(data["clips"][0]["columns"]) == sum(shape["size"] for shape in data["shapes"])
    assert "http://" not in html.replace("http://www.w3.org/2000/svg", "") and "src=" not in html
    page = shown.save(tmp_path / "car.html")
    assert page.read_text().startswith("<!DOCTYPE html>")
    with pytest.raises(ValueError, match=r"expected a file that ends in \.html"):
        shown.save(tmp_path / "car.gif")
    hostile = type(shown)("</script><b>&", shown.clips).figure
    assert "<b>" not in hostile and hostile.count("</script>") == 1


def test_a_run_backward_and_one_of_a_single_point_are_drawn():
    model = qddot.load("double_pendulum")
    back = qddot.simulate(model, (1, 0), initial={"theta_1": 1.0}, **CAR)
    (clip,) = back.animate().clips
    assert (clip.frames.t[0], clip.frames.t[-1]) == (0.0, 1.0)
    bar = next(values for shape, values in clip.frames.parts() if shape.kind == "bar")
    assert bar[-1, 2] == pytest.approx(math.sin(1.0))  # where it began, at t = 1
    still = on_lines(np.zeros(1), np.array([[0.3, 0.0, 0.0, 0.0]]))
    single = type(clip)("", clip.frames)
    assert isinstance(single, Clip) and still(np.zeros(3))[:, 0] == pytest.approx(0.3)


def test_a_saved_run_is_drawn_and_played(tmp_path, drive):
    run, _ = drive
    run.save(tmp_path / "ride.nc")
    done = command("plot", "ride.nc", "--scene", "1.5", cwd=tmp_path, afresh=True)
    assert done.returncode == 0 and done.stdout == "wrote ride_scene.png\n", done.stderr
    assert (tmp_path / "ride_scene.png").read_bytes().startswith(b"\x89PNG")
    done = command("plot", "ride.nc", "--scene", "1.5", "--html", "--into", "played.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert '"begin":1.5' in (tmp_path / "played.html").read_text()


def test_what_scene_of_plot_cannot_draw_is_said(tmp_path):
    oscillator = qddot.simulate(qddot.load("tests/sample_models/oscillator.py"), (0, 1), step=0.01)
    oscillator.save(tmp_path / "mine.nc")
    car = qddot.simulate(qddot.load("quarter_car"), (0, 1), step=0.01)
    car.save(tmp_path / "car.nc")
    for words, message in (
        (["car.nc", "--scene", "9"], "--scene 9: car.nc goes from 0 to 1 s"),
        (["car.nc", "--scene", "nan"], "--scene nan: car.nc goes from 0 to 1 s"),
        (["car.nc", "mine.nc", "--scene", "0"], "--scene: it shows one run as its model looks, and 2 runs are given"),
        (["car.nc", "--scene", "0", "--quantity", "z_s"], "--quantity chooses curves"),
        (["car.nc", "--scene", "0", "--html", "--into", "x.png"], "with --html expected a name that ends in .html"),
        (["mine.nc", "--scene", "0"], "mine.nc is a run of the model oscillator, which does not come with qddot"),
        (["none.nc", "--scene", "0"], "none.nc: there is no such file"),
    ):
        done = command("plot", *words, cwd=tmp_path)
        assert done.returncode == 2 and message in done.stderr, (words, done.stderr)
        assert "Traceback" not in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["car.nc", "mine.nc"]
