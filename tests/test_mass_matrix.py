"""`solve` with a mass matrix: an index-1 DAE by stiff methods; other methods refuse it."""

import numpy as np
import pytest
from numba import njit

import qddot


@njit
def algebraic(t, x, u, c, dx):
    """x' = -y, 0 = y - 2 x: x = exp(-2 t)."""
    dx[0] = -x[1]
    dx[1] = x[1] - 2.0 * x[0]


@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
def test_an_algebraic_equation_holds_along_the_solution(method):
    M = [[1.0, 0.0], [0.0, 0.0]]
    s = qddot.solve(algebraic, (0, 1), [1.0, 2.0], method=method, rtol=1e-8, atol=1e-10, mass_matrix=M)
    assert s["x_1"] == pytest.approx(np.exp(-2 * s.t), rel=1e-5)
    assert s["x_2"] == pytest.approx(2 * s["x_1"], rel=1e-6)


def test_methods_without_mass_matrix_refuse_it():
    with pytest.raises(ValueError, match="method rk4 takes no mass matrix; there are ode15s, rodas5p"):
        qddot.solve(algebraic, (0, 1), [1.0, 2.0], method="rk4", step=0.1, mass_matrix=np.eye(2))
    with pytest.raises(ValueError, match=r"mass_matrix has shape \(3, 3\), expected \(2, 2\)"):
        qddot.solve(algebraic, (0, 1), [1.0, 2.0], method="ode15s", mass_matrix=np.eye(3))
