"""Accuracy and cost of the adaptive methods on problems with known end points, and against SciPy."""

import numpy as np
import pytest
from adaptive_runs import ADAPTIVE, circle, plain, run, slope, three, three_at
from scipy.integrate import solve_ivp

from benchmarks.problems.orbits import ARENSTORF_START, STARS, arenstorf, pleiades
from qddot.runner.problem import Status


@pytest.mark.parametrize("method", ADAPTIVE)
def test_error_is_proportional_to_the_tolerance(method):
    tolerances = 10.0 ** -np.arange(3, 11)
    errors = []
    for rtol in tolerances:
        trajectory = run(three, (0, 20), (1, 1, 0, 1), method, rtol=rtol, atol=rtol, refine=1)
        errors.append(np.abs(trajectory.states - three_at(trajectory.t)).max())
    assert slope(errors, tolerances) == pytest.approx(1, abs=0.15)
    assert max(errors / tolerances) < 50


@pytest.mark.parametrize(("method", "scipys"), [("ode45", "RK45"), ("dop853", "DOP853")])
@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-9])
@pytest.mark.parametrize(
    ("kernel", "span", "x0"),
    [(circle, (0, 20), (1, 0)), (arenstorf, (0, 17), ARENSTORF_START), (pleiades, (0, 3), STARS)],
)
def test_evaluations_are_those_of_scipy(method, scipys, rtol, kernel, span, x0):
    """Same pair, norm and elementary controller; the stretch of the last step and the bounds of factors differ."""
    options = {"rtol": rtol, "atol": rtol}
    ours = run(kernel, span, x0, method, controller="standard", refine=1, **options)
    theirs = solve_ivp(plain(kernel), span, x0, method=scipys, **options)
    assert ours.statistics.evaluations == pytest.approx(theirs.nfev, rel=0.05)
    assert len(ours.t) == pytest.approx(len(theirs.t), rel=0.05)


@pytest.mark.parametrize("controller", ["matlab", "standard", "pi"])
@pytest.mark.parametrize("method", ADAPTIVE)
def test_every_controller_serves_every_method(method, controller):
    trajectory = run(circle, (0, 20), (1, 0), method, rtol=1e-6, atol=1e-6, controller=controller, refine=1)
    assert trajectory.status == Status.FINISHED
    assert np.abs(trajectory.states[-1] - (np.cos(20), np.sin(20))).max() < 3e-3


def test_each_state_has_its_own_absolute_tolerance():
    """Loosening the tolerance of one state changes the steps; giving it n times is giving it once."""
    once = run(arenstorf, (0, 3), ARENSTORF_START, atol=1e-9, refine=1)
    each = run(arenstorf, (0, 3), ARENSTORF_START, atol=[1e-9] * 4, refine=1)
    loose = run(arenstorf, (0, 3), ARENSTORF_START, atol=[1e-9, 1e-9, 1e3, 1e3], refine=1)
    np.testing.assert_array_equal(once.t, each.t)
    assert len(loose.t) < len(once.t)


def test_an_absolute_tolerance_of_zero_is_no_division_by_zero():
    trajectory = run(circle, (0, 1), (1, 0), atol=0.0)
    assert trajectory.status == Status.FINISHED


def test_an_unknown_controller_is_refused():
    with pytest.raises(ValueError, match="'matlab', 'standard', 'pi'"):
        run(circle, (0, 1), (1, 0), controller="matlib")
