"""Accuracy and cost of the adaptive methods on problems with known end points, and against SciPy."""

import numpy as np
import pytest
from adaptive_runs import ADAPTIVE, arenstorf, circle, plain, pleiades, run, slope, three, three_at
from scipy.integrate import solve_ivp

from runner.problem import Status

#: HNW, section II.0: the orbit closes after one period.
ARENSTORF = (0.994, 0, 0, -2.00158510637908252240537862224)
PERIOD = 17.0652165601579625588917206249
#: HNW, section II.10: positions and velocities at t = 0.
PLEIADES = [3, 3, -1, -3, 2, -2, 2, 3, -3, 2, 0, 0, -4, 4, 0, 0, 0, 0, 0, 1.75, -1.5, 0, 0, 0, -1.25, 1, 0, 0]
#: Positions at t = 3: F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (2008).
PLEIADES_END = """
    0.3706139143970502  3.237284092057233 -3.222559032418324  0.6597091455775310  0.3425581707156584
    1.562172101400631  -0.7003092922212495 -3.943437585517392 -3.271380973972550  5.225081843456543
    -2.590612434977470  1.198213693392275 -0.2429682344935824 1.091449240428980
"""


@pytest.mark.parametrize("method", ADAPTIVE)
def test_error_is_proportional_to_the_tolerance(method):
    tolerances = 10.0 ** -np.arange(3, 11)
    errors = []
    for rtol in tolerances:
        trajectory = run(three, (0, 20), (1, 1, 0, 1), method, rtol=rtol, atol=rtol, refine=1)
        errors.append(np.abs(trajectory.states - three_at(trajectory.t)).max())
    assert slope(errors, tolerances) == pytest.approx(1, abs=0.15)
    assert max(errors / tolerances) < 50


@pytest.mark.parametrize(
    ("method", "rtol", "error"),
    [("ode45", 1e-9, 1e-2), ("tsit5", 1e-9, 1e-2), ("dop853", 1e-12, 1e-5), ("vern7", 1e-12, 1e-5)],
)
def test_the_arenstorf_orbit_closes(method, rtol, error):
    trajectory = run(arenstorf, (0, PERIOD), ARENSTORF, method, rtol=rtol, atol=rtol)
    assert trajectory.status == Status.FINISHED
    assert np.abs(trajectory.states[-1, :2] - ARENSTORF[:2]).max() < error


@pytest.mark.parametrize("method", ["ode45", "tsit5", "dop853", "vern7"])
def test_the_pleiades_end_where_published(method):
    """28 states: more than one block of the workspace."""
    trajectory = run(pleiades, (0, 3), PLEIADES, method, rtol=1e-10, atol=1e-10, refine=1)
    np.testing.assert_allclose(
        trajectory.states[-1, :14], np.array(PLEIADES_END.split(), dtype=float), rtol=0, atol=2e-6
    )


@pytest.mark.parametrize(("method", "scipys"), [("ode45", "RK45"), ("dop853", "DOP853")])
@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-9])
@pytest.mark.parametrize(
    ("kernel", "span", "x0"),
    [(circle, (0, 20), (1, 0)), (arenstorf, (0, PERIOD), ARENSTORF), (pleiades, (0, 3), PLEIADES)],
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
    once = run(arenstorf, (0, 3), ARENSTORF, atol=1e-9, refine=1)
    each = run(arenstorf, (0, 3), ARENSTORF, atol=[1e-9] * 4, refine=1)
    loose = run(arenstorf, (0, 3), ARENSTORF, atol=[1e-9, 1e-9, 1e3, 1e3], refine=1)
    np.testing.assert_array_equal(once.t, each.t)
    assert len(loose.t) < len(once.t)


def test_an_absolute_tolerance_of_zero_is_no_division_by_zero():
    trajectory = run(circle, (0, 1), (1, 0), atol=0.0)
    assert trajectory.status == Status.FINISHED


def test_an_unknown_controller_is_refused():
    with pytest.raises(ValueError, match="'matlab', 'standard', 'pi'"):
        run(circle, (0, 1), (1, 0), controller="matlib")
