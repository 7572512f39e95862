"""Exact propagation against analytic solutions, SciPy's matrix exponential and integrators at tight tolerances."""

from fractions import Fraction
from itertools import pairwise
from math import factorial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_runs import full, inputs_of, slopes_of, states_of
from matrices import linear_matrices
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import qddot
from qddot.runner.exact import ladder, run, taylor
from qddot.runner.inputs.signal import stack
from qddot.runner.inputs.tables import table
from qddot.runner.load import available, load
from qddot.runner.methods import find_method
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Status
from qddot.runner.takers import fitted

LINEAR = [name for name in available() if load(name).tables.linear]


def propagate(A, B, x0, span, signals=(), orders=None, **options):
    """The trajectory of x' = A x + B [u, 1]."""
    A, B = np.atleast_2d(np.asarray(A, float)), np.asarray(B, float)
    inputs = stack(list(signals), list(orders or [0] * len(signals)))
    constants = np.concatenate([A.ravel(), B.ravel()])
    n, m = len(A), len(signals)
    problem = Problem(
        rhs=slopes_of,
        t0=float(span[0]),
        t1=float(span[1]),
        initial_state=np.array(x0, float),
        constants=constants,
        inputs=inputs,
        n_inputs=m,
        state_names=tuple(f"x_{i}" for i in range(n)),
        jacobian=full(states_of, n, n),
        input_jacobian=full(inputs_of, n, m),
    )
    method = find_method("exact")
    return method.integrate(problem, method, fitted(Options(**options), method))


def reference(A, B, x0, times, signals, rates=()):
    """The states at times by SciPy's DOP853 at 1e-13 from one piece boundary to the next."""
    knots = [(s.pieces[:, 0] - s.offset) / s.rate for s in signals if s.rate]
    stops = np.unique(np.concatenate([*knots, times]))
    stops = stops[(stops >= times[0]) & (stops <= times[-1])]
    x, found = np.array(x0, float), [np.array(x0, float)]
    for start, end in pairwise(stops):

        def derivative(t, x, start=start, end=end):
            inside = min(max(t, start + 1e-13), end - 1e-13)
            u = [s.derivative(inside) if i in rates else s(inside) for i, s in enumerate(signals)]
            return A @ x + B @ [*u, 1.0]

        x = solve_ivp(derivative, (start, end), x, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        if end in times:
            found.append(x)
    return np.array(found)


OSCILLATOR = np.array([[0.0, 1.0], [-4.0, -0.3]])
PUSHED = np.array([[0.0, 0.0], [1.0, 0.0]])


def roads(model):
    """Something different for each input: a sine road, a table, a spline, pulses."""
    kinds = [
        qddot.signal.sine(0.02, 1.7, 0.4, 0.01),
        table(np.array([-1.0, 0.3, 0.45, 2.0]), np.array([0.0, 0.02, -0.01, 0.03])).shifted(1.3, -0.4),
        table(np.linspace(-2.0, 1.0, 9), 0.02 * np.cos(np.arange(9.0)), "cubic").shifted(-1.1, 0.7),
        qddot.signal.sine(0.01, 2.9).shifted(0.8, 0.2),
        0.015,
        qddot.signal.pulse_train(times=[0.2, 0.5], duration=0.1, impulse=605.0),
    ]
    names = [channel.name for channel in model.tables.inputs if not channel.order]
    return dict(zip(names, kinds, strict=False))


@pytest.mark.parametrize("name", LINEAR)
def test_linear_models_agree_with_a_tight_integration(name):
    model = load(name)
    initial = 0.01 * np.cos(np.arange(float(len(model.state_names))))
    case = {"inputs": roads(model), "initial": initial, "output_times": np.linspace(0, 2, 41)}
    exact = qddot.simulate(model, (0, 2), method="exact", **case)
    tight = qddot.simulate(model, (0, 2), method="dop853", rtol=1e-12, atol=1e-14, **case)
    np.testing.assert_allclose(exact.values, tight.values, rtol=0, atol=1e-9 * np.abs(tight.values).max(axis=0).max())
    np.testing.assert_allclose(exact.states, tight.states, rtol=0, atol=2e-10 * np.abs(tight.states).max())


def test_one_axle_follows_its_formula():
    model = load("one_axle")
    omega = np.sqrt(-linear_matrices(model)[0][1, 0])
    s = qddot.simulate(model, (0, 1), method="exact", initial=[0.0, 0.0])
    static = -9.81 / omega**2
    np.testing.assert_allclose(s.states[:, 0], static * (1 - np.cos(omega * s.t)), rtol=0, atol=1e-11 * abs(static))


def test_undamped_resonance_grows_linearly():
    w = 3.0
    signal = qddot.signal.sine(1.0, w / (2 * np.pi))
    s = propagate([[0, 1], [-w * w, 0]], PUSHED, [0, 0], (0, 100), [signal])
    w = signal.pieces[0, 6]
    exact = (np.sin(w * s.t) - w * s.t * np.cos(w * s.t)) / (2 * w * w)
    np.testing.assert_allclose(s.states[:, 0], exact, rtol=0, atol=1e-11 * 100)


def test_a_free_body_is_pushed_by_every_power_of_time():
    signal = table(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 8.0, 27.0]), "cubic")
    s = propagate([[0, 1], [0, 0]], PUSHED, [1.0, -2.0], (0, 3), [signal], output_times=[0.1, 1.5, 1.7, 3.0])
    np.testing.assert_allclose(s.states[:, 0], 1 - 2 * s.t + s.t**5 / 20, rtol=1e-13)


def test_critical_damping_has_one_eigenvector_only():
    w = 50.0
    s = propagate([[0, 1], [-w * w, -2 * w]], np.zeros((2, 1)), [1.0, 0.0], (0, 1))
    np.testing.assert_allclose(s.states[:, 0], (1 + w * s.t) * np.exp(-w * s.t), rtol=0, atol=1e-14)


def test_an_input_much_faster_than_the_system_does_not_spoil_it():
    signal = qddot.signal.sine(1.0, 1e5 / (2 * np.pi))
    w = signal.pieces[0, 6]
    s = propagate([[0, 1], [-1, 0]], PUSHED, [1.0, 0.0], (0, 10), [signal], output_times=[10.0])
    exact = np.cos(10.0) + (np.sin(w * 10) - w * np.sin(10.0)) / (1 - w * w)
    assert abs(s.states[-1, 0] - exact) < 1e-13


def test_a_sine_too_fast_for_any_rung_of_the_grid_is_survived():
    signal = qddot.signal.sine(1.0, 1e14)
    s = propagate([[0, 1], [-1, 0]], PUSHED, [1.0, 0.0], (0, 4e-11), [signal], step=1e-11)
    np.testing.assert_allclose(s.states[:, 0], 1.0, rtol=0, atol=1e-12)


def test_very_different_rates_live_side_by_side():
    A = np.diag([-1e6, -1.0, 0.0])
    s = propagate(A, [[1e6], [1.0], [1.0]], [0.0, 0.0, 0.0], (0, 5), output_times=[1e-6, 1.0, 5.0])
    exact = [1 - np.exp(-1e6 * s.t), 1 - np.exp(-s.t), s.t]
    np.testing.assert_allclose(s.states.T, exact, rtol=1e-10, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 6), st.integers(0, 2**32 - 1), st.sampled_from([1e-3, 0.1, 1.0, 5.0]), st.booleans())
def test_random_systems_agree_with_the_exponential(n, seed, h, singular):
    random = np.random.default_rng(seed)
    A, b, x0 = random.standard_normal((n, n)), random.standard_normal((n, 1)), random.standard_normal(n)
    if singular:
        A[:, 0] = 0.0
    M = np.block([[A, b], [np.zeros((1, n + 1))]])
    s = propagate(A, b, x0, (0, h), output_times=[h / 3, h])
    exact = [expm(t * M) @ [*x0, 1.0] for t in s.t]
    bound = 1e-12 * (1 + np.linalg.norm(expm(h * np.abs(M)), 1)) * max(1.0, np.abs(x0).max())
    np.testing.assert_allclose(s.states, np.array(exact)[:, :n], rtol=0, atol=bound)


def test_many_states_fill_several_panels():
    random = np.random.default_rng(4)
    n = 37
    A = random.standard_normal((n, n)) - 6 * np.eye(n)
    B = random.standard_normal((n, 3))
    signals = [qddot.signal.sine(1.0, 0.8, 0.3), table(np.array([0.0, 0.7, 2.0]), np.array([0.0, 1.0, -1.0]))]
    times = np.linspace(0, 2, 9)
    s = propagate(A, B, np.ones(n), (0, 2), signals, output_times=times)
    np.testing.assert_allclose(s.states, reference(A, B, np.ones(n), times, signals), rtol=0, atol=1e-11)


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.floats(0.01, 0.6), min_size=2, max_size=8),
    st.sampled_from(["linear", "cubic"]),
    st.floats(-2.0, 2.0).filter(lambda rate: abs(rate) > 0.2),
    st.floats(-1.0, 1.0),
    st.integers(0, 1),
)
def test_uneven_tables_read_either_way_and_their_rates(gaps, kind, rate, offset, order):
    at = np.cumsum(gaps)
    signal = table(at, np.cos(3 * at), kind).shifted(rate, offset)
    times = np.linspace(-1.0, 1.5, 6)
    s = propagate(OSCILLATOR, PUSHED, [0.3, 0.0], (-1.0, 1.5), [signal], [order], output_times=times)
    expected = reference(OSCILLATOR, PUSHED, [0.3, 0.0], times, [signal], rates=(0,) if order else ())
    np.testing.assert_allclose(s.states, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize("shape", ["half_sine", "triangle", "trapezoid"])
def test_pulses_are_met_at_their_edges_in_one_jump(shape):
    signal = qddot.signal.pulse_train(shape, times=[0.5, 0.55, 7.0], duration=0.1, peak=3.0)
    s = propagate(OSCILLATOR, PUSHED, [0.0, 0.0], (0, 10), [signal], output_times=[10.0])
    expected = reference(OSCILLATOR, PUSHED, [0.0, 0.0], np.array([0.0, 10.0]), [signal])
    np.testing.assert_allclose(s.states, expected, rtol=0, atol=2e-11)
    assert s.statistics.steps <= 2 * len(signal.breakpoints)


def test_sines_and_their_rates_with_negative_and_no_rate():
    wave = qddot.signal.sine(1.0, 0.5, 0.7)
    for rate, order in ((-1.3, 0), (-1.3, 1), (0.0, 0), (2.0, 1)):
        signal = wave.shifted(rate, 0.4)
        s = propagate(OSCILLATOR, PUSHED, [0.1, 0.0], (0, 4), [signal], [order], output_times=[0.05, 4.0])
        expected = reference(OSCILLATOR, PUSHED, [0.1, 0.0], s.t, [signal], rates=(0,) if order else ())
        np.testing.assert_allclose(s.states, expected, rtol=0, atol=2e-11)


def test_a_grid_a_jump_and_scattered_times_give_the_same():
    model = load("m113")
    case = {"inputs": roads(model), "initial": np.zeros(14), "method": "exact"}
    grid = qddot.simulate(model, (0, 2), step=1e-3, **case)
    some = [3, 500, 777, 2000]
    jumps = qddot.simulate(model, (0, 2), output_times=grid.t[some], **case)
    assert len(grid.t) == 2001
    np.testing.assert_allclose(jumps.states[1:], grid.states[some], rtol=0, atol=1e-10 * np.abs(grid.states).max())


def test_slices_change_nothing(monkeypatch):
    case = ([[0, 1], [-9, -0.1]], PUSHED, [1.0, 0.0], (0, 3), [qddot.signal.sine(1.0, 0.9)])
    whole = propagate(*case)
    monkeypatch.setattr(run, "SLICE_WORK", 1.0)
    reports = []
    sliced = propagate(*case, progress=reports.append)
    np.testing.assert_array_equal(whole.states, sliced.states)
    assert reports[-1] == 1.0
    assert propagate(*case, time_limit=1e-9).status is Status.TIME_LIMIT


def test_wanted_times():
    case = ([[0, 1], [-9, -0.1]], np.zeros((2, 1)), [1.0, 0.0], (0, 1))
    assert len(propagate(*case).t) == 5001
    np.testing.assert_allclose(propagate(*case, step=0.3).t, [0, 0.3, 0.6, 0.9, 1.0])
    np.testing.assert_allclose(propagate(*case, step=0.125, every=3).t, [0, 0.375, 0.75, 1.0])
    np.testing.assert_allclose(propagate(*case, output_times=[0.2, 0.7]).t, [0, 0.2, 0.7, 1.0])
    with pytest.raises(ValueError, match=r"output time 1\.5 is outside the span"):
        propagate(*case, output_times=[0.2, 1.5])
    with pytest.raises(ValueError, match="too small to advance"):
        propagate(*case, step=1e-17)


def test_a_system_that_grows_out_of_bounds_says_when():
    s = propagate([[0, 1], [1, 0]], np.zeros((2, 1)), [1.0, 1.0], (0, 1000), step=1.0)
    assert s.status is Status.NON_FINITE
    assert s.failed_at == pytest.approx(231.0)  # exp(230.3) = 1e100, the limit
    assert s.t[-1] == pytest.approx(230.0)
    assert np.isfinite(s.states).all()


def test_what_is_not_linear_is_refused():
    with pytest.raises(ValueError, match="model pendulum is nonlinear; choose another, such as dop853"):
        qddot.simulate(load("pendulum"), (0, 1), method="exact")
    with pytest.raises(ValueError, match="needs a linear model"):
        qddot.solve(slopes_of, (0, 1), [0.0], constants=[0.0] * 3, method="exact")


def test_a_study_runs_exactly(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(
        'model = "quarter_car"\nspan = [0, 1]\n[integration]\nmethod = "exact"\nstep = "10 ms"\n'
        '[inputs.z_r]\nkind = "sine"\namplitude = "1 cm"\nfrequency = 2.0\n'
    )
    s = qddot.run_study(path)
    assert len(s.t) == 101
    assert s.metadata["method"] == "exact"


def test_the_bounds_of_the_taylor_polynomials_bound_their_backward_error():
    """Of T_m(x) = exp(x + sum of c_k x^k, k > m), sum of |c_k| theta^(k-1) <= 2^-53 (Al-Mohy, Higham 2011, eq. 3.6)."""
    for m, theta in ((16, ladder.THETA_16), (8, taylor.THETA[8]), (12, taylor.THETA[12]), (24, taylor.THETA[24])):
        assert 0.3 < _backward_error(m, theta) * 2**53 <= 1.0, m


def _backward_error(m, theta, terms=40):
    count = m + terms + 1
    a = [Fraction(0)] * count  # exp(-x) T_m(x) = 1 + sum of a_k x^k, and its logarithm
    for k in range(m + 1, count):
        a[k] = sum(Fraction((-1) ** (k - j), factorial(j) * factorial(k - j)) for j in range(m + 1))
    c = [Fraction(0)] * count
    for k in range(m + 1, count):
        c[k] = a[k] - sum(Fraction(j, k) * c[j] * a[k - j] for j in range(m + 1, k - m))
    return float(sum(abs(float(c[k])) * theta ** (k - 1) for k in range(m + 1, count)))
