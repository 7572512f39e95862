"""Series of motion under constraints: multipliers order by order, whatever the constraints are."""

import numpy as np
import pytest
from mechanisms import coordinates, energy, off, parallel_cranks, parameters, spherical_pendulum
from series_runs import run
from sympy import Rational, Symbol, cos, sin, symbols

import qddot
from qddot.model import Constraint, Parameter
from qddot.model.system import Prescribed, System
from qddot.runner.machine import series_code, series_solve
from qddot.runner.machine.recurrences import RecurrenceError, read_recurrences

TIGHT = {"rtol": 1e-11, "atol": 1e-12}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


@pytest.fixture(scope="module")
def four_bar():
    return qddot.load("four_bar")


def turning(model):
    return qddot.assemble(model, {"theta_1": 0.4, "thetadot_1": 9.0}, guess={"theta_2": 0.6, "theta_3": 1.5})


def chain_of_bars(count, driven=False):
    """Bars in a plane, each by the place of its centre and its angle, pinned end to end to the ceiling.

    driven: the ceiling moves, as the input says.
    """
    x, y, a = ([Symbol(f"{name}_{i}") for i in range(1, count + 1)] for name in "xya")
    rates = [[Symbol(f"{name}dot_{i}") for i in range(1, count + 1)] for name in "xya"]
    m, length, g, s = symbols("m length g s")
    half = Rational(1, 2)
    ends = [(s if driven else 0, 0)]
    closed = []
    for i in range(count):
        way = sin(a[i]), -cos(a[i])
        closed += [each - end - half * length * w for each, end, w in zip((x[i], y[i]), ends[-1], way, strict=True)]
        ends.append(tuple(each + half * length * w for each, w in zip((x[i], y[i]), way, strict=True)))
    kinetic = sum(half * m * (u**2 + v**2) + half * m * length**2 / 12 * w**2 for u, v, w in zip(*rates, strict=True))
    return System(
        name=f"bars_{count}{'_driven' * driven}",
        title="Bars pinned end to end",
        coordinates=[
            *coordinates("m", " ".join(map(str, (*x, *y)))),
            *coordinates("rad", " ".join(map(str, a))),
        ],
        parameters=[
            Parameter(m, 1.5, "kg", "mass of a bar"),
            Parameter(length, 0.4, "m", "length of a bar"),
            Parameter(g, 9.81, "m/s^2", "gravity"),
        ],
        inputs=[Prescribed(s, "m", "place of the ceiling")] if driven else [],
        kinetic_energy=kinetic,
        potential_energy=sum(m * g * each for each in y),
        constraints=[Constraint(Symbol(f"lam_{j}"), f, "N", "a pin") for j, f in enumerate(closed, 1)],
    )


def hanging(model, count, angle=0.5):
    given = {f"a_{i}": angle * (-1) ** i for i in range(1, count + 1)}
    return qddot.assemble(model, given | {f"adot_{i}": 0.3 * i for i in range(1, count + 1)})


def test_the_error_follows_the_tolerance(four_bar):
    start, errors = turning(four_bar), []
    exact = qddot.simulate(four_bar, (0, 5), method="taylor", initial=start, rtol=1e-14, atol=1e-14)
    beside = qddot.simulate(four_bar, (0, 5), method="dop853", initial=start, rtol=1e-13, atol=1e-13)
    assert np.allclose(exact.states[-1], beside.states[-1], rtol=0, atol=1e-9)
    tolerances = 10.0 ** -np.arange(4, 12)
    for tolerance in tolerances:
        found = qddot.simulate(four_bar, (0, 5), method="taylor", initial=start, rtol=tolerance, atol=tolerance)
        errors.append(np.abs(found.states[-1] - exact.states[-1]).max())
        assert off(four_bar, found).max() < 1e-12 and found.statistics.failed_attempts == 0
    assert (np.array(errors) < 3e3 * tolerances).all(), errors
    assert 0.8 < np.polyfit(np.log(tolerances), np.log(errors), 1)[0] < 1.2, errors


def test_what_is_written_out_gives_what_is_done_with_care(four_bar, monkeypatch):
    """Where all pivots are sound M and G are inverted in straight lines, else by `constrained_inverse`."""
    x, c = turning(four_bar), four_bar.constants(four_bar.parameter_values())
    monkeypatch.setattr(series_code, "_file", lambda what: None)
    found = []
    for sound, most in ((1e-6, 32), (2.0, 32), (1e-6, 4)):
        monkeypatch.setattr(series_solve, "SOUND", sound)
        monkeypatch.setattr(series_solve, "MOST_AT_ONCE", most)
        tables = four_bar.tables
        code = series_code.series_code.__wrapped__(
            tables.recurrence, four_bar.state_names, ("M_1",), tables.constant_names
        )
        found.append(run(code, c, x, [[0.2]], 12))
    size = np.abs(found[0]).max(axis=1, keepdims=True)
    for other in found[1:]:
        assert (np.abs(other - found[0]) < 1e-12 * 4.0 ** np.arange(13)[:, None] * size).all()


@pytest.mark.parametrize("count", [2, 12])
def test_bars_in_coordinates_of_their_centres(made, count):
    """24 constraints on 36 coordinates are more than is written out."""
    model = made(chain_of_bars(count))
    start = hanging(model, count)
    found, beside = (
        qddot.simulate(model, (0, 0.5), method=method, initial=start, **TIGHT) for method in ("taylor", "dop853")
    )
    assert np.allclose(found.states[-1], beside.states[-1], rtol=0, atol=1e-8) and off(model, found).max() < 1e-11
    for j in range(1, 2 * count + 1):
        assert found[f"lam_{j}"][-1] == pytest.approx(beside[f"lam_{j}"][-1], abs=1e-6)


def test_constraints_that_an_input_moves(made):
    model = made(chain_of_bars(2, driven=True))
    inputs = {"s": qddot.signal.sine(0.05, 1.3, 0.2)}
    start = qddot.assemble(model, {"a_1": 0.4, "a_2": -0.2}, inputs=inputs)
    found, beside = (
        qddot.simulate(model, (0, 2), method=method, initial=start, inputs=inputs, **TIGHT)
        for method in ("taylor", "dop853")
    )
    assert np.allclose(found.states[-1], beside.states[-1], rtol=0, atol=1e-8)
    assert np.ptp(found["x_1"] + found["x_2"]) > 0.05


def linkage(seed):
    """Bars pinned to each other or to the ground at random, the last end on a line or on a rod; place and speeds.

    Their angles count from the vertical or from that of the bar before.
    """
    chance = np.random.default_rng(seed)
    count = int(chance.integers(2, 5))
    names = " ".join(f"q_{i}" for i in range(count))
    place = {Symbol(f"q_{i}"): chance.uniform(-1, 1) for i in range(count)}
    numbers: dict[str, tuple[float, str]] = {"g": (9.81, "m/s^2")}
    ends, angles, kinetic, potential = [(0, 0)], [0], 0, 0
    rates = {q: Symbol(f"qdot_{i}") for i, q in enumerate(place)}
    for i, q in enumerate(place):
        numbers |= {f"m_{i}": (chance.uniform(0.5, 2), "kg"), f"l_{i}": (chance.uniform(0.3, 1), "m")}
        m, length = Symbol(f"m_{i}"), Symbol(f"l_{i}")
        before = int(chance.integers(0, len(ends)))
        angle = q + (angles[before] if chance.random() < 0.5 else 0)
        way = sin(angle), -cos(angle)
        middle = [each + length / 2 * w for each, w in zip(ends[before], way, strict=True)]
        speeds = [sum(part.diff(each) * rate for each, rate in rates.items()) for part in middle]
        turn = sum(angle.diff(each) * rate for each, rate in rates.items())
        kinetic += m * (speeds[0] ** 2 + speeds[1] ** 2) / 2 + m * length**2 / 24 * turn**2
        potential += m * Symbol("g") * middle[1] + Symbol("k") * q**2 / 2
        ends.append(tuple(each + length * w for each, w in zip(ends[before], way, strict=True)))
        angles.append(angle)
    numbers["k"] = (chance.uniform(0, 5), "N m/rad")
    known = place | {Symbol(name): value for name, (value, _) in numbers.items()}
    (x, y), (a, b, rod) = ends[-1], symbols("a b rod")
    away = [float(each.subs(known)) + chance.uniform(0.2, 0.6) for each in (x, y)]
    far = np.hypot(*(float(each.subs(known)) - at for each, at in zip((x, y), away, strict=True)))
    if seed % 2:
        held, unit = (x - a) ** 2 + (y - b) ** 2 - rod**2, "N/m"
        numbers |= {"a": (away[0], "m"), "b": (away[1], "m"), "rod": (far, "m")}
    else:
        held, unit = y - b, "N"
        numbers["b"] = float(y.subs(known)), "m"
    system = System(
        name=f"linkage_{seed}",
        title="Bars of which the last is held at its end",
        coordinates=coordinates("rad", names),
        parameters=parameters(**numbers),
        kinetic_energy=kinetic,
        potential_energy=potential,
        constraints=[Constraint(Symbol("lam"), held, unit, "a line or a rod")],
    )
    return system, {str(q): value for q, value in place.items()}, chance.uniform(-1, 1, count)


@pytest.mark.parametrize("seed", range(6))
def test_linkages_drawn_at_random_agree_with_dop853_and_keep_their_energy(made, seed):
    system, place, speeds = linkage(seed)
    model = made(system)
    guess = place | {f"qdot_{i}": speed for i, speed in enumerate(speeds)}
    start = qddot.assemble(model, guess=guess)
    found, beside = (
        qddot.simulate(model, (0, 1), method=method, initial=start, **TIGHT) for method in ("taylor", "dop853")
    )
    size = 1 + np.abs(beside.states).max()
    assert np.allclose(found.states[-1], beside.states[-1], rtol=0, atol=1e-7 * size), seed
    assert off(model, found).max() < 1e-11 * size
    total = energy(model, found)
    assert np.ptp(total) < 1e-8 * (1 + np.abs(total).max()), seed


def test_a_mass_matrix_that_is_singular_alone(made):
    """A point of a rod without mass, a coordinate more than there is inertia for."""
    x, y, u, xdot, ydot = symbols("x y u xdot ydot")
    m, g = symbols("m g")
    massless = System(
        name="massless",
        title="A mass at the end of two rods in line, their joint without mass",
        coordinates=coordinates("m", "x y u"),
        parameters=[Parameter(m, 2.0, "kg", "mass"), Parameter(g, 9.81, "m/s^2", "gravity")],
        kinetic_energy=m * (xdot**2 + ydot**2) / 2,
        potential_energy=m * g * y,
        constraints=[
            Constraint(Symbol("lam_1"), x**2 + y**2 - 1, "N/m", "the rods"),
            Constraint(Symbol("lam_2"), u - x / 2, "N", "their joint"),
        ],
    )
    model = made(massless)
    start = qddot.assemble(model, {"x": 0.6}, guess={"y": -0.8})
    found, beside = (
        qddot.simulate(model, (0, 3), method=method, initial=start, **TIGHT) for method in ("taylor", "dop853")
    )
    assert np.allclose(found.states[-1], beside.states[-1], rtol=0, atol=1e-8)
    assert np.allclose(found["u"], found["x"] / 2, rtol=0, atol=1e-14)


def test_a_run_goes_back_to_where_it_came_from(four_bar):
    start = turning(four_bar)
    there = qddot.simulate(four_bar, (0, 1), method="taylor", initial=start, **TIGHT)
    back = qddot.simulate(four_bar, (1, 0), method="taylor", initial=there.states[-1], **TIGHT)
    assert np.allclose(back.states[-1], start, rtol=0, atol=1e-9)


def test_events_and_what_lies_between_are_on_the_constraints(four_bar):
    event = qddot.crossing(four_bar, "y_pin", 0.0, direction=-1)
    found, beside = (
        qddot.simulate(four_bar, (0, 5), method=method, initial=turning(four_bar), events=[event], **TIGHT)
        for method in ("taylor", "dop853")
    )
    assert len(found.events.t) == 6 and np.allclose(found.events.t, beside.events.t, rtol=0, atol=1e-9)
    between = found.at(np.linspace(0.0, 5.0, 357))
    for a, b, c in (found.events.states[:, :3].T, [between[f"theta_{k}"] for k in (1, 2, 3)]):
        closed = 0.3 * np.cos(a) + 0.8 * np.cos(b) - 0.6 * np.cos(c)
        assert np.allclose(closed, 0.9, rtol=0, atol=1e-13)


def test_baumgartes_terms_are_part_of_the_series(made):
    more = [Parameter(Symbol(name), value, "1/s", name) for name, value in (("alpha", 5.0), ("beta", 5.0))]
    held = spherical_pendulum(
        name="held",
        parameters=[*spherical_pendulum().parameters, *more],
        baumgarte=(Symbol("alpha"), Symbol("beta")),
    )
    model = made(held)
    start = qddot.assemble(model, {"x": 0.5, "y": 0.0, "ydot": 1.2}, guess={"z": -0.5})
    found, beside = (
        qddot.simulate(model, (0, 5), method=method, initial=start, **TIGHT) for method in ("taylor", "dop853")
    )
    assert np.allclose(found.states[-1], beside.states[-1], rtol=0, atol=1e-8)
    batch = qddot.simulate_batch(model, (0, 1), method="taylor", initial=np.array([start, start]), **TIGHT)
    assert not batch.in_lanes and "has constraints" in batch.reason


def test_auto_takes_it(four_bar, made):
    chosen = qddot.prepare(four_bar, (0, 1), method="auto", initial=turning(four_bar))
    assert chosen.method.name == "taylor"
    model = made(parallel_cranks())
    start = qddot.assemble(model, {"theta_1": 0.3}, guess={"theta_2": 0.2, "theta_3": 0.2})
    assert qddot.prepare(model, (0, 1), method="auto", initial=start).method.name == "taylor"


def test_a_row_of_a_multiplier_that_is_wrong_is_named():
    rows = "x integral 1 v\nv integral 1 a\na solved x 1 x a 1 x l\nl held x 1 x a"
    with pytest.raises(RecurrenceError, match="l held x 1 x a"):
        read_recurrences(rows, ("x", "v"), (), ())
