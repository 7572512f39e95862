import numpy as np
import pytest
from adaptive_runs import axle, circle, plain, run
from numba import njit
from published_ode45 import solve
from scipy.integrate import RK23, RK45
from scipy.integrate._ivp.rk import rk_step

from benchmarks.problems.orbits import ARENSTORF_START, arenstorf

M2, K, GRAVITY = 120.0, 2.15e6 + 6.5e4, 9.81
AXLE = (K / M2, GRAVITY)
SCIPY = {"ode23": RK23, "ode45": RK45}


@njit
def ramp(t, x, u, c, dx):
    """x' = -2 x + t."""
    dx[0] = -2.0 * x[0] + t


@njit
def epidemic(t, x, u, c, dx):
    """The susceptible, the infected, the recovered."""
    dx[0] = -0.01 * x[0] * x[1]
    dx[1] = 0.1 * x[0] * x[1] - 0.1 * x[1]
    dx[2] = 0.1 * x[1]


@njit
def growth(t, x, u, c, dx):
    """x' = x."""
    dx[0] = x[0]


def axle_displacement(t):
    return -M2 * GRAVITY / K * (1 - np.cos(np.sqrt(K / M2) * t))


@pytest.mark.parametrize(
    ("method", "points", "steps", "error"), [("ode23", 525, 524, 7.83e-5), ("ode45", 637, 159, 1.351e-5)]
)
def test_the_papers_iteration_counts(method, points, steps, error):
    """Section 3.1 of the paper counts 525 (ODE23) and 637 (ODE45, four points a step) with MATLAB's defaults."""
    trajectory = run(axle, (0, 1), (0, 0), method, c=AXLE)
    assert len(trajectory.t) == points
    assert trajectory.statistics.steps == steps
    assert np.abs(trajectory.states[:, 0] - axle_displacement(trajectory.t)).max() == pytest.approx(error, rel=2e-3)


FIFTHS = {"rtol": 1e-10, "atol": 1e-10, "output_times": np.linspace(0.0, 1.0, 6)}


@pytest.mark.parametrize(
    ("kernel", "span", "x0", "method", "options", "printed"),
    [
        (ramp, (0, 10), (0,), "ode45", {}, (14, 2, 97, 57)),
        (epidemic, (0, 5), (1, 2, 3), "ode45", {}, (None, None, 61, 41)),
        (growth, (0, 1), (1,), "ode45", FIFTHS, (31, 0, 187, 6)),
        (growth, (0, 1), (1,), "ode23", FIFTHS, (742, 0, 2227, 6)),
    ],
)
def test_counts_are_those_that_matlab_prints(kernel, span, x0, method, options, printed):
    """Steps, failed attempts, evaluations (its Stats) and points; None where only the others are printed."""
    trajectory = run(kernel, span, x0, method, **options)
    counts = trajectory.statistics
    found = (counts.steps, counts.failed_attempts, counts.evaluations, len(trajectory.t))
    assert tuple(own for own, theirs in zip(found, printed, strict=True) if theirs is not None) == tuple(
        theirs for theirs in printed if theirs is not None
    )


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-5, 1e-8])
@pytest.mark.parametrize("method", ["ode23", "ode45"])
@pytest.mark.parametrize(
    ("kernel", "c", "span", "x0"),
    [
        (axle, AXLE, (0, 0.2), (0, 0)),
        (circle, (), (0, 7), (1, 0)),
        (arenstorf, (), (0, 2), ARENSTORF_START),
    ],
)
def test_steps_are_those_of_a_second_implementation(method, kernel, c, span, x0, rtol):
    """Times, steps and states, one by one; failed attempts counted."""
    t, h, y, failures = solve(method, plain(kernel, c), *map(float, span), x0, rtol=rtol, atol=1e-3 * rtol)
    trajectory = run(kernel, span, x0, method, c=c, rtol=rtol, atol=1e-3 * rtol, refine=1)
    assert trajectory.statistics.steps == len(t)
    assert trajectory.statistics.failed_attempts == failures
    np.testing.assert_allclose(trajectory.t[1:], t, rtol=1e-6)
    np.testing.assert_allclose(np.diff(trajectory.t), h, rtol=1e-4)  # Errors of tiny steps are rounding.
    np.testing.assert_allclose(trajectory.states[1:], y, rtol=1e-5, atol=1e-5 * np.abs(y).max())


@pytest.mark.parametrize("method", ["ode23", "ode45"])
def test_each_step_is_scipys_step(method):
    scheme = SCIPY[method]
    f = plain(circle)
    trajectory = run(circle, (0, 7), (1, 0), method, refine=1, rtol=1e-5, atol=1e-8)
    for t, after, x, expected in zip(
        trajectory.t, trajectory.t[1:], trajectory.states, trajectory.states[1:], strict=False
    ):
        slopes = np.empty((scheme.n_stages + 1, 2))
        found, _ = rk_step(f, t, x, f(t, x), after - t, scheme.A, scheme.B, scheme.C, slopes)
        np.testing.assert_allclose(expected, found, rtol=0, atol=1e-14)


def test_four_points_a_step_are_the_default_of_ode45_alone():
    refined = run(circle, (0, 7), (1, 0), "ode45")
    assert len(refined.t) == 4 * refined.statistics.steps + 1
    for method in ("ode23", "tsit5", "dop853", "vern7"):
        trajectory = run(circle, (0, 7), (1, 0), method)
        assert len(trajectory.t) == trajectory.statistics.steps + 1


@pytest.mark.parametrize("method", ["ode23", "ode45"])
def test_the_longest_step_is_a_tenth_of_the_span(method):
    trajectory = run(axle, (0, 10), (0, 0), method, c=(0.0, 0.0), refine=1)
    assert np.diff(trajectory.t).max() == pytest.approx(1.0)
    trajectory = run(axle, (0, 10), (0, 0), method, c=(0.0, 0.0), refine=1, max_step=0.25)
    assert np.diff(trajectory.t).max() <= 0.25 * 1.1
