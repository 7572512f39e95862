"""Contact that rests: where bounces end, what holds a gap closed, and when that lets go; against formulas."""

import numpy as np
import pytest
from scipy.optimize import brentq
from sympy import Rational, cos, sin, symbols

import qddot
from qddot.codegen.lagrange import derive
from qddot.model import (
    Constraint,
    Coordinate,
    Impact,
    Input,
    ModelError,
    Output,
    Parameter,
    Part,
    Prescribed,
    System,
    t,
)
from qddot.runner.frame.contact import impulse
from qddot.runner.problem import Status

HALF = Rational(1, 2)
x, y, z, phi, xdot, ydot, zdot, phidot = symbols("x y z phi xdot ydot zdot phidot")
m, g, e, c, w, L, lam, F, s = symbols("m g e c w L lam F s")
G = 9.81
TIGHT = {"method": "tsit5", "rtol": 1e-10, "atol": 1e-12}
PARAMETERS = [
    Parameter(m, 0.3, "kg", "mass"), Parameter(g, G, "m/s^2", "gravity"), Parameter(e, 0.8, "1", "restitution"),
]  # fmt: skip


def ball(name="ball", gap=y, **changed):
    given = {
        "coordinates": [Coordinate(y, "m", "height")], "parameters": PARAMETERS, "kinetic_energy": HALF * m * ydot**2,
        "potential_energy": m * g * y, "events": [Impact(gap, "floor", "on the floor", restitution=e)],
    }  # fmt: skip
    return System(name, "A ball", **given | changed)


def pulled():
    """A ball that an input pulls upwards."""
    acceleration = Output(symbols("up"), symbols("yddot"), "m/s^2", "acceleration")
    pull = Input(F, "N", "pull")
    return ball("pulled", inputs=[pull], generalized_forces={y: F}, outputs=[acceleration])


def on_table():
    own = [*PARAMETERS, Parameter(c, 0.02, "m", "amplitude"), Parameter(w, 30.0, "rad/s", "frequency")]
    return ball("on_table", y - c * sin(w * t), parameters=own)


def on_lift():
    """The same on what is prescribed."""
    return ball("on_lift", y - s, inputs=[Prescribed(s, "m", "place of the lift")])


def stacked():
    return ball(
        "stacked", coordinates=[Coordinate(y, "m", "lower"), Coordinate(z, "m", "upper")],
        kinetic_energy=HALF * m * ydot**2 + m * zdot**2, potential_energy=m * g * y + 2 * m * g * z,
        events=[Impact(y, "floor", "on the floor", restitution=e),
                Impact(z - y - 1, "between", "one on the other", restitution=e)],
    )  # fmt: skip


def driven():
    return System(
        "driven", "A carriage", [Coordinate(x, "m", "place")], PARAMETERS[:1], HALF * m * xdot**2,
        inputs=[Prescribed(s, "m", "place of the drive")], constraints=[Constraint(lam, x - s, "N", "drive")],
        events=[Impact(-x, "wall", "at the wall", restitution=HALF)],
    )  # fmt: skip


ARM = Parameter(L, 0.7, "m", "arm")


def leaning(cartesian):
    """A pendulum that comes to a wall left of where it would hang: by its angle, or held by a constraint."""
    if cartesian:
        return ball(
            "cartesian", coordinates=[Coordinate(x, "m", "across"), Coordinate(y, "m", "upwards")],
            kinetic_energy=HALF * m * (xdot**2 + ydot**2), parameters=[*PARAMETERS, ARM],
            constraints=[Constraint(lam, x**2 + y**2 - L**2, "N/m", "arm")],
            events=[Impact(x - L / 2, "wall", "the bob at the wall", restitution=e)],
        )  # fmt: skip
    return ball(
        "angular", coordinates=[Coordinate(phi, "rad", "angle")], kinetic_energy=HALF * m * L**2 * phidot**2,
        potential_energy=-m * g * L * cos(phi), parameters=[*PARAMETERS, ARM],
        events=[Impact(L * sin(phi) - L / 2, "wall", "the bob at the wall", restitution=e)],
    )  # fmt: skip


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("resting"), {}

    def model(build, *arguments):
        key = build, *arguments
        if key not in made:
            made[key] = qddot.load(qddot.generate(build(*arguments), folder))
        return made[key]

    return model


@pytest.mark.parametrize(
    ("options", "near"), [(TIGHT, 1e-8), ({"method": "rodas5p", "rtol": 1e-8, "atol": 1e-10}, 1e-6)]
)
def test_a_ball_bounces_at_its_times_and_comes_to_rest_at_their_limit(models, options, near):
    run = qddot.simulate(models(ball), (0, 8), initial=[1.0, 0.0], **options)
    first = np.sqrt(2 / G)
    times = first * (1 + 2 * np.cumsum([0, *0.8 ** np.arange(1, 40)]))
    limit = first * (1 + 2 * 0.8 / (1 - 0.8))
    np.testing.assert_allclose(run.events.times("floor")[:40], times, atol=near)
    np.testing.assert_allclose(run.events.times("floor rests"), [limit], atol=near)
    assert not len(run.events.times("floor parts"))
    rests = run.t >= run.events.times("floor rests")[0]
    assert rests.sum() > 2
    np.testing.assert_allclose(run["force_floor"], np.where(rests, 0.3 * G, 0.0), rtol=1e-13)
    np.testing.assert_array_equal(run["rests_floor"], rests)
    assert np.abs(run["y"][rests]).max() < 1e-15
    assert run["y"].min() > -1e-12
    assert float(run.at(7.321)["force_floor"]) == pytest.approx(0.3 * G, rel=1e-13)
    assert float(run.at(limit - 1e-3)["force_floor"]) == 0.0
    np.testing.assert_array_equal(run.at(np.array([0.1, 1.0, 7.0]))["rests_floor"], [0.0, 0.0, 1.0])


def test_methods_of_constant_step_rest_where_a_flight_is_shorter_than_a_step(models):
    run = qddot.simulate(models(ball), (0, 6), method="rk4", step=1e-3, initial=[1.0, 0.0])
    flights = 2 * np.sqrt(2 / G) * 0.8 ** np.arange(1, 60)
    told = flights[flights > 1e-3]
    np.testing.assert_allclose(run.events.times("floor rests"), [np.sqrt(2 / G) + told.sum()], atol=1e-10)
    assert run["y"][-1] == 0.0
    assert run["force_floor"][-1] == pytest.approx(0.3 * G)


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_methods_that_hold_no_contact_end_there_and_say_so(models, method):
    told = f"contact floor comes to rest, which {method} does not hold"
    with pytest.raises(qddot.IntegrationError, match=told) as error:
        qddot.simulate(models(ball), (0, 8), method=method, initial=[1.0, 0.0])
    assert error.value.solution.status is Status.PILED_UP
    assert error.value.solution.t[-1] == pytest.approx(np.sqrt(2 / G) * 9, abs=1e-2)


def test_a_ball_takes_off_from_a_table_where_that_falls_faster_than_it(models):
    """And lands where its parabola meets the table again."""
    run = qddot.simulate(models(on_table), (0, 0.5), initial=[0.0, 0.6], parameters={"e": 0.5}, **TIGHT)
    leaves = np.arcsin(G / (0.02 * 30**2)) / 30
    np.testing.assert_allclose(run.events.times("floor parts")[0], leaves, rtol=1e-10)
    np.testing.assert_array_equal(run.events.times("floor rests"), [0.0])
    start, speed = 0.02 * np.sin(30 * leaves), 0.6 * np.cos(30 * leaves)

    def apart(at):
        return start + speed * (at - leaves) - G * (at - leaves) ** 2 / 2 - 0.02 * np.sin(30 * at)

    lands = brentq(apart, leaves + 0.05, leaves + 0.2, xtol=1e-14)
    np.testing.assert_allclose(run.events.times("floor")[0], lands, rtol=1e-9)
    for at in (0.0, 0.007, 0.019):
        force = 0.3 * (G - 0.02 * 900 * np.sin(30 * at))
        assert float(run.at(at)["force_floor"]) == pytest.approx(force, rel=1e-9)
    assert float(run.at(0.1)["force_floor"]) == 0.0


def test_what_is_prescribed_carries_a_ball(models):
    lift = qddot.signal.smoothed(qddot.signal.table([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.5, 1.5]), 0.4)
    run = qddot.simulate(models(on_lift), (0, 3), initial=[0.0, 0.0], inputs={"s": lift}, **TIGHT)
    rests = run["rests_floor"] > 0
    np.testing.assert_allclose(run["y"][rests], lift(run.t[rests]), atol=1e-9)
    np.testing.assert_allclose(run["force_floor"][rests], 0.3 * (G + lift.derivative(run.t[rests], 2)), atol=1e-7)


def test_a_pull_lifts_a_ball_where_it_outweighs_it(models):
    """A ramp: from where the pull is the weight on, the height grows with the third power of time."""
    rise = qddot.signal.table([0.0, 10.0], [0.0, 10.0])
    run = qddot.simulate(models(pulled), (0, 4), initial=[0.0, 0.0], inputs={"F": rise}, **TIGHT)
    np.testing.assert_allclose(run.events.times("floor parts"), [0.3 * G], rtol=1e-12)
    np.testing.assert_allclose(run["y"][-1], (4 - 0.3 * G) ** 3 / 6 / 0.3, rtol=1e-8)
    rests = run.t < 0.3 * G
    np.testing.assert_allclose(run["force_floor"][rests], 0.3 * G - run.t[rests], rtol=1e-10)
    assert np.abs(run["up"][rests]).max() < 1e-12


def test_a_pull_that_jumps_lets_go_at_once(models):
    pull = qddot.road.step(2 * 0.3 * G, at=1.0)
    run = qddot.simulate(models(pulled), (0, 2), initial=[0.0, 0.0], inputs={"F": pull}, **TIGHT)
    np.testing.assert_allclose(run.events.times("floor parts"), [1.0], rtol=1e-14)
    np.testing.assert_allclose(run["y"], np.where(run.t > 1, G * (run.t - 1) ** 2 / 2, 0.0), atol=1e-12)


def test_bodies_on_each_other_rest_with_the_weights_that_they_carry(models):
    run = qddot.simulate(models(stacked), (0, 8), initial=[0.5, 1.7, 0, 0], parameters={"e": 0.5}, **TIGHT)
    np.testing.assert_allclose(run.states[-1], [0, 1, 0, 0], atol=1e-12)
    assert run["force_floor"][-1] == pytest.approx(3 * 0.3 * G, rel=1e-12)
    assert run["force_between"][-1] == pytest.approx(2 * 0.3 * G, rel=1e-12)
    assert (run["y"] > -1e-10).all()
    assert (run["z"] - run["y"] - 1 > -1e-10).all()
    energy = 0.15 * run["ydot"] ** 2 + 0.3 * run["zdot"] ** 2 + 0.3 * G * run["y"] + 0.6 * G * run["z"]
    assert (np.diff(energy) < 1e-8).all()


def test_a_ball_that_falls_on_one_at_rest_drives_it_into_the_floor_and_both_rest(models):
    run = qddot.simulate(models(stacked), (0, 8), initial=[0, 2.0, 0, 0], parameters={"e": 0.0}, **TIGHT)
    falls = np.sqrt(2 / G)
    np.testing.assert_allclose(run.events.times("between rests"), [falls], rtol=1e-9)
    np.testing.assert_allclose(run.states[-1], [0, 1, 0, 0], atol=1e-12)
    assert run["force_floor"][-1] == pytest.approx(3 * 0.3 * G, rel=1e-12)


def test_an_impact_on_a_constraint_is_that_of_the_free_coordinate(models):
    """Bounces, then rest against the wall, where the rod takes the rest of the weight."""
    start = 1.2
    angular = qddot.simulate(models(leaning, False), (0, 4), initial=[start, 0], parameters={"e": 0.6}, **TIGHT)
    place = {"x": 0.7 * np.sin(start), "y": -0.7 * np.cos(start), "xdot": 0.0, "ydot": 0.0}
    held = qddot.simulate(models(leaning, True), (0, 4), initial=place, parameters={"e": 0.6}, **TIGHT)
    count = 12
    np.testing.assert_allclose(held.events.times("wall")[:count], angular.events.times("wall")[:count], rtol=1e-8)
    np.testing.assert_allclose(held.events.times("wall rests"), angular.events.times("wall rests"), rtol=1e-6)
    times = np.linspace(0, 4, 41)
    angle = angular.at(times)["phi"]
    np.testing.assert_allclose(held.at(times)["x"], 0.7 * np.sin(angle), atol=1e-7)
    np.testing.assert_allclose(np.hypot(held["x"], held["y"]), 0.7, rtol=1e-12)
    np.testing.assert_allclose(held["x"] * held["xdot"] + held["y"] * held["ydot"], 0, atol=1e-12)
    # moments about the pivot: N L cos(30 deg) = m g L sin(30 deg)
    for run in (angular, held):
        assert run["force_wall"][-1] == pytest.approx(0.3 * G * np.tan(np.pi / 6), rel=1e-9)
    assert -2 * held["lam"][-1] * held["y"][-1] == pytest.approx(-0.3 * G * -1, rel=1e-9)


def test_impulses_satisfy_constraints_that_are_redundant_and_masses_that_are_singular():
    """Beside the whole system of equations, solved by least squares."""
    chance = np.random.default_rng(3)
    for _ in range(20):
        root = chance.normal(size=(5, 4))
        M, G = root @ root.T * 10.0 ** chance.uniform(-2, 2), chance.normal(size=(2, 5))
        G = np.vstack([G, G[0] - 2 * G[1]])
        slopes = chance.normal(size=5)
        whole = np.block([[M, G.T], [G, np.zeros((3, 3))]])
        expected = np.linalg.lstsq(whole, np.concatenate([slopes, np.zeros(3)]), rcond=1e-12)[0][:5]
        found = impulse(M, G, slopes)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(G @ found, 0, atol=1e-9 * np.abs(found).max())


def test_a_batch_rests_as_its_runs_do(models):
    times = np.linspace(0, 5, 26)
    options = {"initial": [1.0, 0.0], "output_times": times, **TIGHT}
    names, given = ["y", "force_floor"], {"e": [0.5, 0.8]}
    batch = qddot.simulate_batch(models(ball), (0, 5), parameters=given, names=names, **options)
    for k, restitution in enumerate((0.5, 0.8)):
        alone = qddot.simulate(models(ball), (0, 5), parameters={"e": restitution}, **options)
        np.testing.assert_array_equal(batch["y"][k], alone["y"])
        np.testing.assert_array_equal(batch["force_floor"][k], alone["force_floor"])
    assert batch["force_floor"][0, -1] == pytest.approx(0.3 * G)


def test_an_impact_between_what_constraints_hold_is_told(models):
    """A carriage that a constraint takes along meets a wall: neither can give way."""
    drive = {"s": qddot.signal.sine(0.5, 0.25, -np.pi / 2)}
    with pytest.raises(
        ValueError, match=r"impact wall \(at the wall\) happens at t = (1|0.9+\d*) s between what constr"
    ):
        qddot.simulate(models(driven), (0, 2), initial=[-0.5, 0.0], inputs=drive, **TIGHT)


def test_a_run_that_starts_with_bodies_in_each_other_is_refused(models):
    with pytest.raises(ValueError, match=r"the gap of impact floor \(on the floor\) is -0.1 at the start, expected"):
        qddot.simulate(models(ball), (0, 1), initial=[-0.1, 0], **TIGHT)


def test_a_ball_that_starts_on_the_floor_bounces_or_rests(models):
    down = qddot.simulate(models(ball), (0, 0.5), initial=[0.0, -2.0], **TIGHT)
    np.testing.assert_array_equal(down.events.times("floor")[:1], [0.0])
    np.testing.assert_allclose(down.events.times("floor")[1], 2 * 1.6 / G, rtol=1e-10)
    still = qddot.simulate(models(ball), (0, 5), initial=[0.0, 0.0], **TIGHT)
    np.testing.assert_array_equal(still["y"], 0.0)
    np.testing.assert_allclose(still["force_floor"], 0.3 * G, rtol=1e-14)


def test_what_cannot_rest_is_an_impact_all_the_same():
    """The second derivative of an input is not known; what asks for the force is told."""
    made = ball("moved", y - s, inputs=[Input(s, "m", "place of the floor")])
    assert not derive(made).contacts
    why = r"cannot rest: its gap depends on the input s, whose second derivative .* Prescribed\(s, \"m\", ...\)"
    with pytest.raises(ModelError, match=f"impact floor has the force N, but it {why}"):
        ball(
            "moved", inputs=[Input(s, "m", "place of the floor")],
            events=[Impact(y - s, "floor", "on the floor", restitution=e, force=symbols("N"))],
        )  # fmt: skip
    with pytest.raises(ModelError, match=f"an output uses force_floor, but impact floor {why}"):
        ball(
            "moved", y - s, inputs=[Input(s, "m", "place of the floor")],
            outputs=[Output(symbols("half"), symbols("force_floor") / 2, "N", "half of it")],
        )  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"generalized_forces": {y: symbols("force_floor")}}, "uses force_floor, a contact force, which is not known"),
        ({"generalized_forces": {y: symbols("rests_floor")}}, "uses rests_floor, which is 1 while a contact rests"),
        (
            {"events": [Impact(y, "floor", "down", force="N")]},
            "impact floor has the force 'N', expected a SymPy Symbol",
        ),
        ({"events": [Impact(y, "floor", "down", unit="kgs")]}, "impact floor: the unit of its force is 'kgs'"),
        ({"events": [Impact(y, "floor", "down", force=m)]}, "m is used twice, as parameter and as contact force"),
    ],
)
def test_misuse_of_contact_forces_is_told(changes, message):
    with pytest.raises(ModelError, match=message):
        ball(**changes)


def test_copies_of_a_part_have_contact_forces_of_their_own():
    hopper = Part(
        "hopper", [Coordinate(y, "m", "height")], PARAMETERS, HALF * m * ydot**2, m * g * y,
        events=[Impact(y, "floor", "on the floor", restitution=e)],
        outputs=[Output(symbols("share"), symbols("force_floor") / (m * g), "1", "share of the weight")],
    )  # fmt: skip
    both = (hopper("1") + hopper("2")).system("hoppers", "Two hoppers")
    assert [str(each.symbol) for each in both.output_expressions][-2:] == ["force_floor_1", "force_floor_2"]
    assert len(derive(both).contacts) == 2


def test_pages_say_that_a_contact_rests():
    from qddot.codegen.equations.notation import describe
    from qddot.codegen.equations.terminal import text

    page = text(describe(derive(ball()), "ball.py"), width=300)
    assert "where bounces end, it stays zero, by the force force_floor while that pushes" in page
