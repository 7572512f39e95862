"""A Rosenbrock method without a Jacobian: its differences must not cost steps. BEAM shows what a chain does not."""

import numpy as np
import pytest
from beam import SPAN, N, beam, beam_jacobian
from numba import njit

import qddot

#: Reference at t = 5 of the IVP test set, to the digits that are compared; SciPy's Radau at 1e-10 gives them, too.
FIRST, LAST_RATE = -0.579236659e-2, 0.1186724615e1


def _run(tolerance, jacobian=None):
    x0 = np.zeros(2 * N)
    return qddot.solve(beam, SPAN, x0, method="rodas5p", rtol=tolerance, atol=tolerance, jacobian=jacobian)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7, 1e-9])
def test_differences_cost_no_more_than_half_as_many_steps_again(tolerance):
    differences, exact = _run(tolerance), _run(tolerance, beam_jacobian)
    assert differences.statistics.steps <= 1.5 * exact.statistics.steps
    assert np.abs(differences.states[-1] - exact.states[-1]).max() < 1e4 * tolerance


def test_the_beam_ends_where_the_test_set_says():
    s = _run(1e-8)
    assert s.states[-1, 0] == pytest.approx(FIRST, abs=1e-8)
    assert s.states[-1, -1] == pytest.approx(LAST_RATE, abs=1e-5)


def test_differences_cross_no_edge_of_the_domain():
    """x' = -sqrt(x) reaches no x < 0: where f has no value on one side, that side is not used."""

    @njit
    def draining(t, x, u, c, dx):
        dx[0] = -np.sqrt(x[0])
        dx[1] = -1e3 * (x[1] - x[0])

    s = qddot.solve(draining, (0, 1.9), [1.0, 0.0], method="rodas5p", rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(s["x_1"], (1 - s.t / 2) ** 2, atol=1e-7)
