"""Taylor's method: known solutions, other methods, conditions, events, and all that a run may ask for."""

import pickle
from dataclasses import replace
from functools import cache
from itertools import pairwise

import adaptive_runs
import numpy as np
import pytest
import series_runs
from scipy.integrate import solve_ivp
from scipy.special import ellipk, ellipkinc
from sympy import Eq, Piecewise, Rational, cos, sin, symbols

import qddot
from qddot.codegen.generate import generate
from qddot.model import chain
from qddot.model.system import Coordinate, Input, Output, Parameter, System
from qddot.runner.abi import LANES
from qddot.runner.frame.spans import integrate
from qddot.runner.inputs.bind import bind
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.load import LoadError, available
from qddot.runner.machine import series_code
from qddot.runner.methods import METHODS
from qddot.runner.problem import Problem, Status
from qddot.runner.takers import fitted
from qddot.runner.taylor import step

x, y, xdot, ydot, m, k, g, F = symbols("x y xdot ydot m k g F")
half = Rational(1, 2)


def system(name, forces=None, potential=0, kinetic=half * m * xdot**2, inputs=(), dissipation=0):
    """A mass m on a line, or in a plane, with constants k and g where they are used."""
    parts = (kinetic, potential, dissipation, *(forces or {}).values())
    used = set().union(*(each.free_symbols for each in parts if each))
    plane = y in used or ydot in used
    coordinates = [Coordinate(x, "m", "along"), *([Coordinate(y, "m", "across")] if plane else [])]
    parameters = [Parameter(each, value, unit, text) for each, value, unit, text in PARAMETERS if each in used]
    return System(
        name=name,
        title=name,
        coordinates=coordinates,
        parameters=parameters,
        kinetic_energy=kinetic,
        potential_energy=potential,
        dissipation=dissipation,
        generalized_forces=forces or {},
        inputs=inputs,
        outputs=[Output(symbols("height"), x, "m", "height")] if name == "swing" else [],
    )


PARAMETERS = (
    (m, 1.0, "kg", "mass"),
    (k, 1.0, "N/m", "stiffness"),
    (g, 9.81, "m/s^2", "gravity"),
)
PLANE = half * m * (xdot**2 + ydot**2)
SYSTEMS = {
    "orbit": system("orbit", potential=-k / (x**2 + y**2) ** half, kinetic=PLANE),
    "ball": system("ball", {x: -m * g + Piecewise((-k * x, x < 0), (0, True))}),
    "quartic": system("quartic", potential=-k * x**4 / 4),
    "block": system("block", {x: Piecewise((k, xdot < 0), (-k, True))}),
    "driven": system("driven", {x: F * cos(x)}, potential=half * k * x**2, inputs=[Input(F, "N", "force")]),
    "equal": system("equal", {x: Piecewise((k, Eq(x, 1)), (0, True))}),
    "turning": system("turning", potential=-g * m * cos(x), kinetic=half * m * ((xdot + ydot * sin(x)) ** 2 + ydot**2)),
    "pendulum": system("swing", potential=-g * m * cos(x)),
}


@pytest.fixture(scope="module")
def model_of(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")

    @cache
    def load(name):
        return qddot.load(generate(SYSTEMS[name], folder))

    return load


def run(model, span, tolerance=1e-10, **options):
    return qddot.simulate(model, span, method="taylor", rtol=tolerance, atol=tolerance, **options)


def orbit(t, eccentricity):
    """x, y, xdot, ydot of Kepler's orbit of half axis 1 from its pericentre, at a time."""
    anomaly = t
    for _ in range(60):
        anomaly -= (anomaly - eccentricity * np.sin(anomaly) - t) / (1 - eccentricity * np.cos(anomaly))
    root, far = np.sqrt(1 - eccentricity**2), 1 - eccentricity * np.cos(anomaly)
    place = np.cos(anomaly) - eccentricity, root * np.sin(anomaly)
    return np.array([*place, -np.sin(anomaly) / far, root * np.cos(anomaly) / far])


@pytest.mark.parametrize("eccentricity", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_orbits_are_as_accurate_as_asked_for(model_of, eccentricity):
    """Problems D1 to D5 of Hull, Enright, Fellen and Sedgwick, SIAM J. Numer. Anal. 9 (1972) 603-637."""
    end, errors = 20.0, []
    tolerances = 10.0 ** -np.arange(4, 13)
    for tolerance in tolerances:
        found = run(model_of("orbit"), (0.0, end), tolerance, initial=orbit(0.0, eccentricity))
        errors.append(np.abs(found.states[-1] - orbit(end, eccentricity)).max())
    power = np.polyfit(np.log(tolerances[:7]), np.log(errors[:7]), 1)[0]
    assert 0.8 < power < 1.2, errors
    growth = 100 / (1 - eccentricity) ** 2  # of an error along the orbit, by then
    assert (np.array(errors) < growth * tolerances + 1e-12 * growth).all(), errors


def test_the_order_follows_the_tolerance_and_the_steps_do_not(model_of):
    steps = [
        run(model_of("orbit"), (0.0, 20.0), tol, initial=orbit(0.0, 0.5)).statistics.steps for tol in (1e-6, 1e-12)
    ]
    assert steps[1] < 1.3 * steps[0]


@pytest.mark.parametrize("runs", [1, LANES])
@pytest.mark.parametrize("name", ["one_axle", "pendulum", "double_pendulum", "m113", "chain of 20"])
def test_a_step_is_the_formulas_to_three_digits(name, runs, tmp_path):
    """Its logarithms and its power are shorter than those of `math`: nothing but a length hangs on them."""
    model = qddot.load(generate(chain.system(20), tmp_path) if name == "chain of 20" else name)
    rng = np.random.default_rng(8)
    code, n = (model.series if runs == 1 else model.lane_series), len(model.state_names)
    relative, absolute = 10.0 ** rng.uniform(-9, -3, (2, n))
    for order in (5, 12, 40):
        decay = step.decay_for(1e-9, order)
        assert decay == pytest.approx(np.log2(1e-9 ** (1 / order) * np.exp(-0.7 / (order - 1))), rel=1e-12)
        for low, high in ((-300, -250), (-3, 3), (-100, 100), (200, 250)):
            now, before, last = 10.0 ** rng.uniform((-4, low, low), (4, high, high), (runs, n, 3)).transpose(2, 0, 1)
            before[:, 0] *= -1.0
            scale = 1e-9 / np.maximum(relative * now, absolute)
            sizes = np.abs(before * scale).max(axis=1), np.abs(last * scale).max(axis=1)
            expected = 2.0**decay * np.minimum(sizes[0] ** (-1 / (order - 1)), sizes[1] ** (-1 / order))
            found = series_runs.steps(code, now, before, last, relative, absolute, 1e-9, decay, order)
            np.testing.assert_allclose(found, expected, rtol=5e-4)


@pytest.mark.parametrize("runs", [1, LANES])
def test_a_step_is_nothing_where_a_coefficient_is_no_number_and_endless_where_all_vanish(runs):
    model = qddot.load("double_pendulum")
    code, order = (model.series if runs == 1 else model.lane_series), 9
    tolerances = 2 * (np.full(4, 1e-6),)

    def steps(before, last):
        return series_runs.steps(code, np.ones((runs, 4)), before, last, *tolerances, 1e-6, -2.0, order)

    nothing = np.zeros((runs, 4))
    assert (steps(nothing, nothing) == np.inf).all()
    for wrong in (np.inf, -np.inf, np.nan):
        for state in range(4):
            one = np.zeros((runs, 4))
            one[-1, state] = wrong
            assert steps(one, nothing)[-1] == steps(nothing, one)[-1] == 0.0
            assert (steps(one, nothing)[:-1] == np.inf).all()


FREE = [n for n in available() if qddot.load(n).tables.recurrence and not qddot.load(n).tables.constraints]

INPUTS = {
    "sine": qddot.signal.sine(0.3, 1.7, 0.4),
    "pulse": qddot.signal.pulse_train(times=[0.3, 0.8], peak=0.2, duration=0.1),
    "cubic": qddot.signal.table(np.linspace(0.0, 3.0, 7), [0.0, 0.1, -0.1, 0.2, 0.0, 0.1, 0.0], kind="cubic"),
    "lines": qddot.signal.table([0.0, 0.5, 1.1, 3.0], [0.0, 0.2, -0.1, 0.3]),
}


def trajectory(model, span, x, signals, tolerance, **options):
    """A run without what the front door compiles beside it."""
    p, c = model.parameter_values(), np.zeros(len(model.tables.constant_names))
    model.module.constants.py_func(p, c)
    given = Problem(
        None, *span, np.array(x), c, bind(model.tables, signals), model.tables.rhs_inputs, model.state_names
    )
    problem = replace(given, recurrences=model.series)
    chosen = fitted(qddot.Options(rtol=tolerance, atol=tolerance, **options), METHODS["taylor"])
    return problem, integrate(problem, METHODS["taylor"], chosen)


def by_scipy(model, problem, times):
    """States at times by SciPy's DOP853, the generated right-hand side run as Python."""
    channels = np.zeros(max(1, len(problem.inputs.first)))
    reader = reader_for(problem.inputs)

    def f(t, state):
        slopes = np.zeros(len(state))
        evaluate(problem.inputs, reader, t, t, len(problem.inputs.first), channels)
        model.module.rhs.py_func(t, state, channels, problem.constants, slopes)
        return slopes

    span = problem.t0, problem.t1
    found = solve_ivp(f, span, problem.initial_state, method="DOP853", t_eval=times, rtol=1e-12, atol=1e-12)
    return found.y.T


@pytest.mark.parametrize("name", [name for name in FREE if name != "one_axle"])  # whose road is none for SciPy
@pytest.mark.parametrize("start", [0.0, 1e4])
def test_all_models_agree_with_scipy(name, start):
    model = qddot.load(name)
    signals = {each: qddot.signal.sine(0.01, 1.7, 0.1 * i) for i, each in enumerate(model.tables.free_inputs)}
    x = np.random.default_rng(5).uniform(-0.3, 0.3, len(model.state_names))
    times = np.linspace(start, start + 0.5, 9)
    problem, found = trajectory(model, (start, start + 0.5), x, signals, 1e-12, output_times=times)
    expected = by_scipy(model, problem, times)
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_array_less(np.abs(found.states - expected).max(axis=0), 1e-9 * (1 + scale))


@pytest.mark.parametrize("name", INPUTS)
def test_inputs_of_every_kind_are_followed(model_of, name):
    model, signal = model_of("driven"), INPUTS[name]
    _, whole = trajectory(model, (0.0, 2.0), [0.1, 0.0], {"F": signal}, 1e-12)
    problem, found = trajectory(model, (0.0, 2.0), [0.1, 0.0], {"F": signal}, 1e-12, max_step=0.05, refine=1)
    assert whole.statistics.steps < 60
    np.testing.assert_allclose(whole.states[-1], found.states[-1], rtol=0, atol=1e-10)
    edges = [0.0, *(edge for edge in signal.breakpoint_times() if 0 < edge < 2), 2.0]
    x = np.array([0.1, 0.0])
    for one, other in pairwise(edges):
        part = replace(problem, t0=one, t1=other, initial_state=x)
        x = by_scipy(model, part, [other])[-1]
    np.testing.assert_allclose(found.states[-1], x, atol=1e-9)


def test_speeds_that_are_no_rates_of_positions_agree_with_scipy(model_of):
    """A sum of squares of which one is that of a quasi-velocity: d'Alembert's short equations do not hold."""
    model = model_of("turning")
    assert "rate" not in model.tables.recurrence and "rate" in qddot.load("pendulum").tables.recurrence
    problem, found = trajectory(model, (0.0, 3.0), [0.3, 0.1, 0.5, 0.8], {}, 1e-12)
    np.testing.assert_allclose(found.states[-1], by_scipy(model, problem, [3.0])[-1], atol=1e-9)


def test_a_linear_model_agrees_with_exact_propagation():
    """Two unrelated ways, on a road, under recoil."""
    model = qddot.load("m113")
    road = qddot.signal.sine(0.05, 6.0)
    signals = {f"z_{i}": road.shifted(1.0, 0.1 * i) for i in range(1, 6)}
    signals["F"] = qddot.signal.table([0.0, 0.1, 0.15, 0.2, 0.3], [0.0, 0.0, 4e5, 0.0, 0.0])
    times = np.linspace(0.0, 1.0, 41)
    exact = qddot.simulate(model, (0.0, 1.0), method="exact", inputs=signals, step=0.025)
    found = run(model, (0.0, 1.0), 1e-11, inputs=signals, output_times=times)
    np.testing.assert_allclose(found.states, exact.states, atol=1e-8)


def test_a_condition_ends_a_step(model_of):
    """A ball on a spring that only pushes: free fall from 1, half an oscillation about -g m/k, and up again."""
    stiffness, gravity = 400.0, 9.81
    frequency, sag = np.sqrt(stiffness), gravity / stiffness
    speed, fall = np.sqrt(2 * gravity), np.sqrt(2 / gravity)
    amplitude = np.hypot(sag, speed / frequency)
    contact = 2 * (np.pi - np.arctan2(speed / frequency, sag)) / frequency
    period = 2 * fall + contact
    found = run(model_of("ball"), (0.0, 3 * period), 1e-11, initial=[1.0, 0.0], parameters={"k": stiffness})
    np.testing.assert_allclose(found.states[-1], [1.0, 0.0], atol=1e-8)
    lowest = run(model_of("ball"), (0.0, period / 2), 1e-11, initial=[1.0, 0.0], parameters={"k": stiffness})
    np.testing.assert_allclose(lowest.states[-1], [-sag - amplitude, 0.0], atol=1e-9)
    assert found.statistics.steps < 60


def test_a_condition_that_pushes_back_from_both_sides_stops_the_run(model_of):
    with pytest.raises(qddot.IntegrationError, match="t = 2"):
        run(model_of("block"), (0.0, 3.0), initial=[0.0, 2.0])


def test_a_run_that_diverges_says_where(model_of):
    """From x = 1 with xdot = 1/sqrt(2), x'' = x^3 has the solution 1/(1 - t/sqrt(2))."""
    with pytest.raises(qddot.IntegrationError, match=r"t = 1\.41421"):
        run(model_of("quartic"), (0.0, 2.0), initial=[1.0, np.sqrt(0.5)])


def test_output_times_are_read_off_the_series(model_of):
    model, start = model_of("orbit"), orbit(0.0, 0.6)
    times = np.linspace(0.0, 7.0, 200)
    whole = run(model, (0.0, 7.0), 1e-9, initial=start)
    found = run(model, (0.0, 7.0), 1e-9, initial=start, output_times=times)
    assert found.statistics.steps == whole.statistics.steps
    np.testing.assert_array_equal(found.t, times)
    expected = np.array([orbit(t, 0.6) for t in times])
    np.testing.assert_allclose(found.states, expected, atol=2e-7)
    refined = run(model, (0.0, 7.0), 1e-9, initial=start, refine=7)
    assert len(refined.t) == 1 + 7 * refined.statistics.steps
    np.testing.assert_allclose(refined.states, [orbit(t, 0.6) for t in refined.t], atol=2e-7)


def test_a_run_goes_back_to_where_it_came_from(model_of):
    signals = {"F": INPUTS["sine"]}
    there = run(model_of("driven"), (0.0, 5.0), 1e-12, initial=[0.4, -0.2], inputs=signals)
    back = run(model_of("driven"), (5.0, 0.0), 1e-12, initial=there.states[-1], inputs=signals)
    np.testing.assert_allclose(back.states[-1], [0.4, -0.2], atol=1e-10)
    assert back.t[0] == 5.0 and back.t[-1] == 0.0


def test_options_of_steps_are_followed(model_of):
    model, start = model_of("orbit"), orbit(0.0, 0.5)
    short = run(model, (0.0, 1.0), initial=start, max_step=0.01, refine=1)
    assert np.diff(short.t).max() <= 0.01 * (1 + 1e-12)
    first = run(model, (0.0, 1.0), initial=start, first_step=1e-3, refine=1)
    assert first.t[1] == 1e-3 < first.t[2] - first.t[1]
    few = run(model, (0.0, 20.0), initial=start, max_steps=5, on_failure="return")
    assert few.status is Status.TOO_MANY_STEPS and few.statistics.steps == 5


def test_other_parameters_take_no_other_code(model_of):
    """A circle's period is 2 pi / sqrt(k)."""
    model = model_of("orbit")
    code = model.series
    for stiffness in (1.0, 4.0):
        start = [1.0, 0.0, 0.0, np.sqrt(stiffness)]
        found = run(model, (0.0, np.pi / np.sqrt(stiffness)), 1e-12, initial=start, parameters={"k": stiffness})
        np.testing.assert_allclose(found.states[-1], [-1.0, 0.0, 0.0, -np.sqrt(stiffness)], atol=1e-10)
    assert model.series is code


def test_a_prepared_run_is_pickled_and_starts_elsewhere(model_of):
    prepared = qddot.prepare(model_of("orbit"), (0.0, 3.0), method="taylor", rtol=1e-9, initial=orbit(0.0, 0.2))
    again = pickle.loads(pickle.dumps(prepared))
    np.testing.assert_array_equal(again().states, prepared().states)
    np.testing.assert_allclose(again(orbit(1.0, 0.2)).states[-1], orbit(4.0, 0.2), atol=1e-6)


def test_a_study_takes_the_method():
    found = qddot.read_study("studies/one_shot.toml").run(method="taylor")
    assert found.metadata["method"] == "taylor" and found.success


def test_events_are_found(model_of):
    """A swing of amplitude 0.1 has the period of its elliptic integral."""
    model = model_of("pendulum")
    period = 4 * ellipk(np.sin(0.05) ** 2) / np.sqrt(9.81)
    event = qddot.crossing(model, "x", 0.0, direction=1)
    found = run(model, (0.0, 10.0), 1e-12, initial=[0.1, 0.0], events=[event])
    np.testing.assert_allclose(found.events.t, period * (0.75 + np.arange(len(found.events.t))), atol=1e-10)
    assert len(found.events.t) == 5
    stop = qddot.crossing(model, "height", 0.0, terminal=True)
    ended = run(model, (0.0, np.inf), 1e-12, initial=[0.1, 0.0], events=[stop])
    assert ended.status is Status.TERMINATED
    np.testing.assert_allclose(ended.t[-1], period / 4, atol=1e-11)


def test_all_of_two_crossings_within_a_step_are_found(model_of):
    """A level that a swing just passes: twice around every turn, from the elliptic integral of the first kind."""
    modulus, omega, level = np.sin(0.05), np.sqrt(9.81), 0.0999
    period = 4 * ellipk(modulus**2) / omega
    before = period / 4 - ellipkinc(np.arcsin(np.sin(level / 2) / modulus), modulus**2) / omega
    event = qddot.crossing(model_of("pendulum"), "x", level)
    found = run(model_of("pendulum"), (0.0, 12.0), 1e-12, initial=[0.1, 0.0], events=[event])
    turns = period * np.arange(1, 6)
    expected = np.sort(np.concatenate([[before], turns - before, turns + before]))
    assert len(found.events.t) == 11
    np.testing.assert_allclose(found.events.t, expected, atol=1e-9)


def test_what_has_no_series_says_so(model_of):
    with pytest.raises(LoadError, match="== has no recurrence; choose another method, such as dop853"):
        run(model_of("equal"), (0.0, 1.0), initial=[0.0, 0.0])
    with pytest.raises(ValueError, match="method taylor takes the recurrences of a generated model"):
        qddot.solve(adaptive_runs.circle, (0.0, 1.0), [1.0, 0.0], method="taylor", rtol=1e-6)


def test_kept_code_that_is_not_whole_is_made_again(model_of, tmp_path, monkeypatch):
    model = model_of("orbit")
    tables = model.tables
    monkeypatch.setattr(series_code, "cache_directory", lambda: tmp_path)
    arguments = (tables.recurrence, model.state_names, (), tables.constant_names)
    first = series_code.series_code.__wrapped__(*arguments)
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    second = series_code.series_code.__wrapped__(*arguments)
    assert second.memory.factors == first.memory.factors and second.memory.size == first.memory.size
    file.write_bytes(whole[:-100])
    series_code.series_code.__wrapped__(*arguments)
    assert file.read_bytes() == whole
    assert [each.name for each in tmp_path.iterdir()] == [file.name]
