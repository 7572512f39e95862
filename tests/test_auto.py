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
    assert choose_for_many(model, qddot.Options(rtol=1e-6), series_in_lanes=True)[0].name == "exact"


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


def test_many_nonlinear_runs_go_in_lanes(model):
    method, options, reason = choose_for_many(model, qddot.Options(rtol=1e-6), series_in_lanes=True)
    assert (method.name, options.rtol, reason) == ("vern7", 1e-6, "many runs go in lanes")


def test_many_runs_without_inputs_go_by_series_where_these_go_in_lanes():
    model = qddot.load("double_pendulum")
    for series, name in ((True, "taylor"), (False, "vern7")):
        assert choose_for_many(model, qddot.Options(rtol=1e-6), series_in_lanes=series)[0].name == name
    found = qddot.simulate_batch(model, (0.0, 0.1), method="auto", initial=np.full((2, 4), 0.1))
    assert found.in_lanes
    assert found.method == "taylor, since the model is smooth, without inputs, and many runs go in lanes"


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
