"""`method="auto"` chooses by rule, says what and why, and takes what the method takes."""

import adaptive_runs
import numpy as np
import pytest
from scipy.sparse import block_array, csc_array, diags_array, eye_array
from sympy import Eq, Piecewise, Rational, cos, symbols

import qddot
from qddot.codegen.generate import generate
from qddot.model.system import Coordinate, Input, Parameter, System
from qddot.runner.auto import STIFF, _fast_and_slow, choose_for_many
from qddot.runner.sparse import fastest

x, xdot, c, F = symbols("x xdot c F")


def swing(name, force=F):
    """A pendulum in syrup: its Jacobian at rest has eigenvalues near -c and -1/c."""
    return System(
        name=name,
        title=name,
        coordinates=[Coordinate(x, "rad", "angle")],
        parameters=[Parameter(c, 0.1, "1/s", "damping")],
        inputs=[Input(F, "1/s^2", "push")],
        kinetic_energy=Rational(1, 2) * xdot**2,
        potential_energy=-cos(x),
        dissipation=Rational(1, 2) * c * xdot**2,
        generalized_forces={x: force},
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("models")


@pytest.fixture(scope="module")
def model(folder):
    return qddot.load(generate(swing("syrup"), folder))


def chosen(model, span=(0.0, 20.0), **options):
    run = qddot.prepare(model, span, method="auto", initial=options.pop("initial", [0.1, 0.0]), **options)
    return run.method.name, run.subject.reason


def test_a_smooth_model_takes_its_series(model):
    assert chosen(model) == ("taylor", "the model is smooth, and not stiff at the start")
    assert chosen(model, rtol=1e-9, max_step=0.1)[0] == "taylor"


def test_a_stiff_start_takes_a_stiff_method(model):
    name, reason = chosen(model, parameters={"c": 1e4})
    assert name == "rodas5p"
    assert reason == "the start is stiff: 1e+04/s beside 0.05/s"
    assert chosen(model, parameters={"c": 1e4}, span=(0.0, 0.01))[0] == "taylor"  # which is over before it decays


def test_a_linear_model_is_propagated_exactly_if_nothing_else_is_asked_for():
    model, start = qddot.load("quarter_car"), np.full(4, 0.01)
    assert chosen(model, initial=start) == ("exact", "the model is linear")
    assert chosen(model, initial=start, rtol=1e-9)[0] == "exact"
    assert chosen(model, initial=start, max_step=0.01)[0] == "taylor"
    assert choose_for_many(model, qddot.Options(rtol=1e-6), None)[0].name == "exact"


def test_a_spline_of_many_knots_takes_a_runge_kutta_method(model):
    times = np.linspace(0.0, 20.0, 2001)
    for kind, name in (("cubic", "vern7"), ("linear", "taylor")):  # lines have breakpoints, where all methods land
        push = qddot.signal.table(times, np.sin(times), kind=kind)
        assert chosen(model, inputs={"F": push})[0] == name
    push = qddot.signal.table(times, np.sin(times), kind="cubic")
    assert chosen(model, inputs={"F": push}, rtol=1e-12) == ("dop853", "the inputs have 1999 knots")


def test_what_has_no_series_takes_a_runge_kutta_method(folder):
    model = qddot.load(generate(swing("equal", Piecewise((F, Eq(x, 1)), (0, True))), folder))
    assert chosen(model) == ("vern7", "== has no recurrence")


def in_a_batch(model, runs=3, **given):
    """What `simulate_batch` chooses, and why, and what comes of it."""
    found = qddot.simulate_batch(model, (0.0, 20.0), method="auto", initial=np.full((runs, 2), 0.1), **given)
    assert found.success.all()
    assert found.in_lanes
    return (*found.method.split(", since ", 1), found)


def test_many_smooth_runs_go_by_series_whatever_their_inputs_are(model):
    times = np.linspace(0.0, 20.0, 31)
    pulses = qddot.signal.pulse_train(times=[1.0, 2.0, 3.0], peak=1.0, duration=0.1)
    for push in (0.0, pulses, *(qddot.signal.table(times, np.sin(times), kind=kind) for kind in ("cubic", "linear"))):
        name, reason, found = in_a_batch(model, inputs={"F": push}, rtol=1e-9, atol=1e-9)
        assert (name, reason) == ("taylor", "the model is smooth, and many runs go in lanes")
        tight = {"rtol": 1e-12, "atol": 1e-12}
        alone = qddot.simulate(model, (0.0, 20.0), method="dop853", initial=[0.1] * 2, inputs={"F": push}, **tight)
        assert found.final[0] == pytest.approx(alone.states[-1], abs=1e-7)


def test_many_runs_without_inputs_go_by_series_where_these_go_in_lanes():
    found = qddot.simulate_batch(qddot.load("double_pendulum"), (0.0, 0.1), method="auto", initial=np.full((2, 4), 0.1))
    assert found.in_lanes
    assert found.method == "taylor, since the model is smooth, and many runs go in lanes"


def test_many_runs_over_splines_of_many_knots_take_a_runge_kutta_method(model):
    """One is enough: the run that reads most of its table tells."""
    road = qddot.signal.table(np.linspace(0.0, 40.0, 4001), np.sin(np.linspace(0.0, 40.0, 4001)), kind="cubic")
    for rate, name in ((0.01, "taylor"), (2.0, "vern7")):
        pushes = qddot.per_run(road, rate=[0.0, rate, 0.01])
        assert in_a_batch(model, inputs={"F": pushes})[0] == name
    name, reason, _ = in_a_batch(model, inputs={"F": pushes}, rtol=1e-12, atol=1e-12)
    assert (name, reason) == ("dop853", "the inputs have 3999 knots")


def test_many_runs_that_have_no_series_in_lanes_take_a_runge_kutta_method(model):
    method, options, reason = choose_for_many(model, qddot.Options(rtol=1e-6), None)
    assert (method.name, options.rtol, reason) == ("vern7", 1e-6, "many runs go in lanes")


def test_a_batch_of_no_runs_chooses_too(model):
    found = qddot.simulate_batch(model, (0.0, 1.0), method="auto", initial=np.zeros((0, 2)))
    assert found.final.shape == (0, 2)
    assert found.method == "vern7, since many runs go in lanes"


def test_the_solution_tells_what_was_chosen(model):
    found = qddot.simulate(model, (0.0, 1.0), method="auto", initial=[0.1, 0.0], rtol=1e-8)
    assert found.metadata["method"] == "taylor"
    assert found.metadata["method chosen, since"] == "the model is smooth, and not stiff at the start"


def test_a_function_names_its_method():
    with pytest.raises(ValueError, match="method auto chooses by what a generated model says of itself"):
        qddot.solve(adaptive_runs.circle, (0.0, 1.0), [1.0, 0.0], method="auto")


N, SPAN = 200, 10.0
SPRINGS = 1e4 * diags_array([-np.ones(N - 1), 2 * np.ones(N), -np.ones(N - 1)], offsets=[-1, 0, 1])
DAMPING = {
    "none": 0.0 * SPRINGS,
    "light": 1e-6 * SPRINGS,
    "heavy": 0.1 * SPRINGS,
    "of one mass": csc_array(([1e6], ([3], [3])), shape=(N, N)),
    "in air": 0.5 * eye_array(N),
    "in syrup": 1e5 * eye_array(N),
}


#: Those that decay a hundred times as fast as all that swings.
STIFF_ONES = {"heavy", "of one mass", "in syrup"}


@pytest.mark.parametrize("damping", DAMPING)
def test_a_few_eigenvalues_tell_of_many_states_what_all_of_them_do(damping):
    J = csc_array(block_array([[None, eye_array(N)], [-SPRINGS, -DAMPING[damping]]]))
    (fast, slow), (few, beside) = (
        _fast_and_slow(rates, SPAN) for rates in (np.linalg.eigvals(J.toarray()), fastest(J))
    )
    assert (fast > STIFF * slow) == (few > STIFF * beside) == (damping in STIFF_ONES)
    assert few == pytest.approx(fast, rel=0.02)
