"""Events of a model that act: bounces, collisions, relays; their times against formulas, momentum, energy and pi."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from sympy import Rational, Symbol, symbols

import qddot
from qddot.codegen.generate import generate
from qddot.model import Constraint, Coordinate, Event, Input, ModelError, Output, Parameter, Part, State, System
from qddot.runner.problem import Status

HALF = Rational(1, 2)
m, M, g, e, a, L = symbols("m M g e a L")
x, y, z, xdot, ydot, zdot = symbols("x y z xdot ydot zdot")
G = 9.81
#: Options and how near the times of events are to the truth.
WAYS = {
    "rk4": ({"step": 1e-3}, 1e-11),
    "tsit5": ({"rtol": 1e-9, "atol": 1e-12}, 1e-11),
    "ode15s": ({"rtol": 1e-8, "atol": 1e-12}, 1e-6),
    "rodas5p": ({"rtol": 1e-9, "atol": 1e-12}, 1e-8),
    "exact": ({}, 1e-11),
    "taylor": ({"rtol": 1e-10, "atol": 1e-12}, 1e-11),
}


def ball(**changed):
    given = {"name": "ball", "title": "Two balls over a floor", "coordinates": [_height(y), _height(z)]}
    parameters = [Parameter(m, 2.0, "kg", "mass"), Parameter(g, G, "m/s^2", "gravity")]
    given |= {"parameters": [*parameters, Parameter(e, 0.8, "1", "restitution")]}
    given |= {"kinetic_energy": HALF * m * (ydot**2 + zdot**2), "potential_energy": m * g * (y + z)}
    events = [Event(q, f"floor_{q}", "a ball on the floor", -1, {v: -e * v}) for q, v in ((y, ydot), (z, zdot))]
    return System(**(given | {"events": events} | changed))


def _height(symbol):
    return Coordinate(symbol, "m", f"height {symbol} of a ball")


def blocks():
    """A block between a wall and another: all collisions elastic."""
    towards = (M * zdot + m * ydot + m * (ydot - zdot)) / (m + M)
    onwards = (m * ydot + M * zdot + M * (zdot - ydot)) / (m + M)
    return System(
        name="blocks",
        title="Two blocks and a wall",
        coordinates=[Coordinate(y, "m", "place of the small block"), Coordinate(z, "m", "place of the large block")],
        parameters=[Parameter(m, 1.0, "kg", "small mass"), Parameter(M, 100.0, "kg", "large mass")],
        kinetic_energy=HALF * (m * ydot**2 + M * zdot**2),
        events=[
            Event(z - y, "meeting", "the blocks meet", -1, {ydot: onwards, zdot: towards}),
            Event(y, "wall", "the small block at the wall", -1, {ydot: -ydot}),
        ],
    )


def relay():
    """A mass pushed to and fro: a relay turns the force where the mass passes a switch."""
    on, d, F = symbols("on d F")
    return System(
        name="relay",
        title="A mass between two switches",
        coordinates=[Coordinate(x, "m", "place")],
        parameters=[Parameter(m, 1.5, "kg", "mass"), Parameter(d, 0.3, "m", "switch"), Parameter(F, 2.0, "N", "force")],
        kinetic_energy=HALF * m * xdot**2,
        generalized_forces={x: on * F},
        states=[State(on, 0, "1", "the way of the force")],
        events=[
            Event(x - d, "right", "the right switch", 1, {on: -1}),
            Event(x + d, "left", "the left one", -1, {on: 1}),
        ],
    )


def struck_pendulum():
    """A pendulum held by a constraint, thrown back where it hangs."""
    lam = Symbol("lam")
    return System(
        name="struck",
        title="Pendulum beside a wall",
        coordinates=[Coordinate(x, "m", "across"), Coordinate(y, "m", "upwards")],
        parameters=[
            Parameter(m, 1.2, "kg", "mass"),
            Parameter(g, G, "m/s^2", "gravity"),
            Parameter(L, 0.7, "m", "arm"),
        ],
        kinetic_energy=HALF * m * (xdot**2 + ydot**2),
        potential_energy=m * g * y,
        constraints=[Constraint(lam, x**2 + y**2 - L**2, "N/m", "arm")],
        events=[Event(x, "wall", "the bob at the wall", -1, {xdot: -xdot})],
    )


def shaken():
    """A mass that an input pushes, and an output of the input's rate."""
    w, wdot = symbols("w wdot")
    return System(
        name="shaken",
        title="A pushed mass",
        coordinates=[Coordinate(x, "m", "place")],
        parameters=[Parameter(m, 1.5, "kg", "mass"), Parameter(a, 2.0, "N/m", "force of a metre")],
        inputs=[Input(w, "m", "way of the hand")],
        kinetic_energy=HALF * m * xdot**2,
        generalized_forces={x: a * w},
        outputs=[Output(Symbol("pace"), wdot, "m/s", "pace of the hand")],
        events=[Event(wdot, "turn", "the hand turns")],
    )


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder = tmp_path_factory.mktemp("acting")
    made = {}

    def model(build):
        if build not in made:
            made[build] = qddot.load(generate(build(), folder))
        return made[build]

    return model


def bounces(height, count, restitution=0.8):
    speed = np.sqrt(2 * G * height)
    times = [speed / G]
    for _ in range(count - 1):
        speed *= restitution
        times.append(times[-1] + 2 * speed / G)
    return np.array(times)


@pytest.mark.parametrize("method", WAYS)
def test_a_ball_bounces_when_the_formula_says(method, models):
    options, near = WAYS[method]
    s = qddot.simulate(models(ball), (0, 3.0), method=method, initial={"y": 1.0, "z": 0.6}, **options)
    assert s.success
    assert (np.diff(s.t) > 0).all()
    for name, height in (("y", 1.0), ("z", 0.6)):
        expected = bounces(height, 20)
        np.testing.assert_allclose(s.events.times(f"floor_{name}"), expected[expected < 3.0], atol=near)
        assert s.extremes(name).least > -10 * near
        assert s.extremes(name).least < 1e-6
    first, speed = bounces(1.0, 1)[0], np.sqrt(2 * G)
    np.testing.assert_allclose(s.at(first + 0.2)["y"], 0.8 * speed * 0.2 - G * 0.02, atol=10 * near)
    np.testing.assert_allclose(s["ydot"][np.searchsorted(s.t, first - near)], 0.8 * speed, rtol=1e-6)
    np.testing.assert_allclose(s.extremes("y", after=first + 1e-3, before=first + 0.7).greatest, 0.64, atol=1e-6)


@pytest.mark.parametrize("method", ["tsit5", "ode15s", "taylor"])
def test_a_run_is_known_between_all_of_its_bounces(method, models):
    """Also behind those that shorten the next step: every flight is the parabola that it is."""
    options, near = WAYS[method]
    s = qddot.simulate(models(ball), (0, 3.5), method=method, initial={"y": 1.0, "z": 1.0}, **options)
    meets = bounces(1.0, 12)
    times = np.linspace(0.0, 3.5, 1000)
    flight = np.searchsorted(meets, times)
    since, speed = times - np.concatenate([[0.0], meets])[flight], np.sqrt(2 * G) * 0.8 ** np.arange(13)[flight]
    height = np.where(flight == 0, 1.0 - G * times**2 / 2, speed * since - G * since**2 / 2)
    np.testing.assert_allclose(s.at(times)["y"], height, atol=100 * near)


def test_events_at_one_instant_all_act(models):
    s = qddot.simulate(models(ball), (0, 2.5), method="tsit5", initial={"y": 1.0, "z": 1.0}, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(s.events.times("floor_z"), s.events.times("floor_y"), rtol=0, atol=1e-13)
    assert len(s.events.times("floor_y")) == np.count_nonzero(bounces(1.0, 20) < 2.5)
    np.testing.assert_allclose(s["z"], s["y"], atol=1e-12)


@pytest.mark.parametrize("method", ["tsit5", "rk4", "exact"])
def test_bounces_that_pile_up_end_the_run_and_say_when(method, models):
    options = WAYS[method][0]
    with pytest.raises(
        qddot.IntegrationError, match="event floor_y comes sooner and sooner after the one before"
    ) as told:
        qddot.simulate(
            models(ball), (0, 30.0), method=method, parameters={"e": 0.5}, initial={"y": 1.0, "z": 1e6}, **options
        )
    limit = np.sqrt(2 / G) * (1 + 2 * 0.5 / (1 - 0.5))
    run = told.value.solution
    assert run.status is Status.PILED_UP
    assert f"t = {run.t[-1]:.9g}" in str(told.value)
    np.testing.assert_allclose(run.t[-1], limit, rtol=1e-5)
    assert len(run.events.times("floor_y")) > 15


@pytest.mark.parametrize(("ratio", "digits"), [(1, 3), (100, 31), (10_000, 314)])
@pytest.mark.parametrize("method", ["exact", "tsit5"])
def test_blocks_collide_as_often_as_pi_has_digits(method, ratio, digits, models):
    """G. Galperin, Regular and Chaotic Dynamics 8 (2003) 375-394."""
    options = WAYS[method][0]
    start = {"y": 1.0, "z": 2.0, "zdot": -1.0}
    s = qddot.simulate(models(blocks), (0, 50.0), method=method, parameters={"M": ratio}, initial=start, **options)
    assert len(s.events.t) == digits
    np.testing.assert_allclose(s["ydot"] ** 2 + ratio * s["zdot"] ** 2, ratio, rtol=1e-9)


def test_a_relay_turns_the_force_where_the_parabolas_say(models):
    s = qddot.simulate(models(relay), (0, 12.0), method="dop853", initial={"on": 1.0}, rtol=1e-10, atol=1e-12)
    pull, place, speed, way, t, expected = 2.0 / 1.5, 0.0, 0.0, 1.0, 0.0, []
    while True:  # to the switch ahead, by x = place + speed t + way pull t^2 / 2
        ahead = way * 0.3
        wait = (-way * speed + np.sqrt(speed**2 + 2 * pull * way * (ahead - place))) / pull
        t, speed, place = t + wait, speed + way * pull * wait, ahead
        if t > 12.0:
            break
        expected.append(t)
        way = -way
    np.testing.assert_allclose(s.events.t, expected, atol=1e-8)
    assert set(np.unique(s["on"])) == {-1.0, 1.0}


def test_a_pendulum_on_a_constraint_is_thrown_back_and_stays_on_it(models):
    tilt = 0.4
    start = {"x": 0.7 * np.sin(tilt), "y": -0.7 * np.cos(tilt), "xdot": 0.0, "ydot": 0.0}
    s = qddot.simulate(models(struck_pendulum), (0, 6.0), method="dop853", initial=start, rtol=1e-10, atol=1e-12)
    angle = np.arctan2(s["x"], -s["y"])
    assert angle.min() > -1e-9
    np.testing.assert_allclose(np.hypot(s["x"], s["y"]), 0.7, rtol=1e-12)
    energy = 0.6 * (s["xdot"] ** 2 + s["ydot"] ** 2) + 1.2 * G * s["y"]
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)
    k = np.sin(tilt / 2)
    mean, geometric = 1.0, np.sqrt(1 - k**2)  # by the arithmetic-geometric mean
    for _ in range(6):
        mean, geometric = (mean + geometric) / 2, np.sqrt(mean * geometric)
    half = np.pi / mean * np.sqrt(0.7 / G)
    np.testing.assert_allclose(np.diff(s.events.times("wall")), half, rtol=1e-8)


def test_a_batch_and_a_pickled_run_are_what_runs_are(models):
    model, options = models(ball), {"method": "tsit5", "rtol": 1e-9, "atol": 1e-12}
    times, start = np.linspace(0, 2.0, 21), {"y": 1.0, "z": 0.7}
    batch = qddot.simulate_batch(
        model, (0, 2.0), parameters={"e": [0.75, 0.8, 1.0]}, initial=start, output_times=times, **options
    )
    assert "events that act" in batch.reason
    for k, restitution in enumerate((0.75, 0.8, 1.0)):
        alone = qddot.simulate(
            model, (0, 2.0), parameters={"e": restitution}, initial=start, output_times=times, **options
        )
        np.testing.assert_array_equal(alone.t, times)
        np.testing.assert_array_equal(batch["y"][k], alone["y"])
    again = pickle.loads(pickle.dumps(alone))
    np.testing.assert_array_equal(again.at([0.11, 0.77])["y"], alone.at([0.11, 0.77])["y"])
    np.testing.assert_array_equal(again.events.t, alone.events.t)


def test_an_event_may_end_the_run_after_it_acted_and_others_be_watched_for(models, tmp_path):
    landing = Event(y, "landing", "down", -1, {ydot: 0}, terminal=True)
    system = ball(events=[landing, Event(z - 5 * e, "never", "high")])
    model = qddot.load(generate(system, tmp_path))
    high = qddot.crossing(model, "y", 0.5)
    s = qddot.simulate(
        model, (0, 9.0), method="tsit5", initial={"y": 1.0, "z": 3.0}, rtol=1e-9, atol=1e-12, events=[high]
    )
    assert s.status is Status.TERMINATED
    np.testing.assert_allclose(s.t[-1], np.sqrt(2 / G), rtol=1e-10)
    assert s["ydot"][-1] == 0.0
    np.testing.assert_allclose(s.events.times("y"), [np.sqrt(1 / G)], rtol=1e-8)
    assert len(s.events.times("never")) == 0
    twice = qddot.crossing(models(ball), "y", 0.2, direction=-1, terminal=2)
    s = qddot.simulate(models(ball), (0, 9.0), step=1e-3, initial={"y": 1.0, "z": 3.0}, events=[twice])
    assert len(s.events.times("floor_y")) == 1
    np.testing.assert_allclose(
        s.t[-1], bounces(1.0, 1)[0] + (0.8 * np.sqrt(2 * G) + np.sqrt(0.64 * 2 * G - 0.4 * G)) / G
    )


def test_a_run_that_goes_backward_is_refused(models):
    with pytest.raises(ValueError, match="goes backward, and what event floor_y does cannot be undone"):
        qddot.simulate(models(ball), (1, 0), step=1e-3, initial={"y": 1.0, "z": 1.0})


@pytest.mark.parametrize("method", ["rk4", "tsit5", "rodas5p", "exact", "taylor"])
def test_events_read_inputs_that_the_equations_do_not(method, models):
    """Where the input's rate passes zero is where its sine turns; the third passing is told by the model itself."""
    options = WAYS[method][0]
    model = models(shaken)
    pace = qddot.crossing(model, "pace", 0.0)
    wave = {"w": qddot.signal.sine(0.1, 0.75, 0.2)}
    s = qddot.simulate(model, (0, 3.0), method=method, inputs=wave, initial={}, events=[pace], **options)
    turns = (np.pi * (np.arange(1, 6) - 0.5) - 0.2) / (2 * np.pi * 0.75)
    np.testing.assert_allclose(s.events.times("pace"), turns, atol=1e-8)
    np.testing.assert_allclose(s.events.times("turn"), turns, atol=1e-8)


@pytest.mark.parametrize(
    ("event", "message"),
    [
        (Event(y, "a b", "down"), "event 'a b' .* choose another name"),
        (Event(y, "floor", " "), "event floor has no meaning"),
        (Event(y, "floor", "down", 2), r"event floor has the direction 2, expected 1 \(rising\), -1"),
        (Event(y, "floor", "down", terminal=3), "event floor has terminal = 3, expected True or False"),
        (Event(y, "floor", "down", then={m: 1}), "event floor sets m, which is no coordinate, velocity or state"),
        (Event(y, "floor", "down", then=[ydot]), "event floor has then = .*, expected a mapping"),
        (Event(y - Symbol("h"), "floor", "down"), "event floor uses h, which is not declared"),
        (Event(y, "floor", "down", then={ydot: Symbol("yddot")}), "event floor: ydot uses yddot"),
        ("floor", "events holds 'floor', expected Event"),
    ],
)
def test_wrong_events_are_named(event, message):
    with pytest.raises(ModelError, match=message):
        ball(events=[event])


def test_one_name_for_two_events_is_refused():
    with pytest.raises(ModelError, match="event floor is there twice"):
        ball(events=[Event(y, "floor", "down"), Event(z, "floor", "down")])


def test_the_pages_tell_of_events(tmp_path):
    from qddot.codegen.equations.notation import describe
    from qddot.codegen.equations.page import html
    from qddot.codegen.equations.terminal import text
    from qddot.codegen.equations.tex import tex
    from qddot.codegen.lagrange import derive

    document = describe(derive(ball()), "ball.py")
    assert "a ball on the floor (floor_y): where this falls through zero" in text(document)
    assert "ẏ = −e·ẏ" in text(document)
    assert "Events</h2>" in html(document)
    assert r"\section*{Events}" in tex(document)


STUDY = """
model = "{model}"
span = [0, "2 s"]

[initial]
y = "100 cm"
z = "2.5 m"

[integration]
method = "tsit5"
rtol = 1e-9
atol = 1e-12

[events.halfway]
of = "y"
level = "50 cm"
direction = "{direction}"
terminal = {terminal}
"""


def test_a_study_watches_and_tells(models, tmp_path, capsys):
    import xarray

    from qddot.runner.commands.run import run

    path = tmp_path / "study.toml"
    path.with_name("ball.py").write_text(Path(models(ball).module.__file__).read_text())
    path.write_text(STUDY.format(model="ball.py", direction="falling", terminal="false"))
    assert run(path, tmp_path, None, [], None) == 0
    said = capsys.readouterr().out
    halves = [np.sqrt(1 / G)]
    up, top = 0.8 * np.sqrt(2 * G), 0.64
    halves.append(bounces(1.0, 1)[0] + up / G + np.sqrt(2 * (top - 0.5) / G))
    assert f"event halfway: 2 times, first at {halves[0]:.6g} s, last at {halves[1]:.6g} s" in said
    assert "event floor_y: 3 times" in said
    with xarray.open_dataset(tmp_path / "study.nc") as data:
        np.testing.assert_allclose(data.attrs["event halfway"], halves, rtol=1e-7)
    path.write_text(STUDY.format(model="ball.py", direction="both", terminal="2"))
    assert qddot.run_study(path).t[-1] == pytest.approx(bounces(1.0, 1)[0] + (up - np.sqrt(up**2 - G)) / G)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"of": "yy"}, "events.halfway.of: unknown state or output 'yy'; did you mean 'y'"),
        ({"level": "50 kg"}, "events.halfway.level: '50 kg' is in kg, expected m"),
        ({"direction": "up"}, "events.halfway.direction: unknown direction 'up'; there are: rising, falling, both"),
        ({"terminal": -1}, "terminal is -1"),
        ({"floor": 1}, "events.halfway.floor"),
    ],
)
def test_wrong_words_of_a_studys_events_are_named(changes, message, models, tmp_path):
    path = tmp_path / "study.toml"
    path.with_name("ball.py").write_text(Path(models(ball).module.__file__).read_text())
    path.write_text(STUDY.format(model="ball.py", direction="falling", terminal="false"))
    with pytest.raises(qddot.StudyError, match=message):
        qddot.read_study(path, {f"events.halfway.{key}": value for key, value in changes.items()})


def test_copies_of_a_part_have_events_of_their_own():
    hopper = Part(
        name="hopper",
        coordinates=[_height(y)],
        parameters=[Parameter(m, 2.0, "kg", "mass"), Parameter(g, G, "m/s^2", "gravity")],
        kinetic_energy=HALF * m * ydot**2,
        potential_energy=m * g * y,
        events=[Event(y, "floor", "on the floor", -1, {ydot: -ydot})],
    )
    both = (hopper("1") + hopper("2")).system("hoppers", "Two hoppers")
    assert [event.name for event in both.events] == ["floor_1", "floor_2"]
    assert both.events[1].meaning == "on the floor, hopper 2"
    assert both.events[1].then == {Symbol("ydot_2"): -Symbol("ydot_2")}
