"""The numerical differentiation formulas in backward differences: coefficients, change of step, interpolant.

L. F. Shampine, M. W. Reichelt, "The MATLAB ODE Suite", SIAM J. Sci. Comput. 18 (1997) 1-22, section 2. Row DIF + j of
the vectors v holds the (j+1)-st backward difference of the solution at the present step size.
"""

from math import factorial

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.stiff.space import DEGREE, OWN, POLYNOMIAL, vectors

HIGHEST_ORDER = 5

#: Rows of v: predicted state, its correction (the difference of order k + 1), psi of equation 3, a Newton correction,
#: backward differences of orders 1 to 7.
PREDICTED, CORRECTION, PSI, DELTA, DIF = np.arange(OWN, OWN + 5)
ROWS = int(DIF) + HIGHEST_ORDER + 2

#: gamma_k = 1 + 1/2 + ... + 1/k, at index k - 1 like all that follow.
GAMMA = np.cumsum(1.0 / np.arange(1, HIGHEST_ORDER + 1))
#: kappa_k: row 0 of table 1, chosen for the largest step at nearly the stability of the BDFs; row 1 gives the BDFs.
KAPPA = np.array([[-37 / 200, -1 / 9, -0.0823, -0.0415, 0.0], [0.0] * HIGHEST_ORDER])
#: 1 / ((1 - kappa_k) gamma_k).
INVERSE = 1.0 / ((1.0 - KAPPA) * GAMMA)
#: kappa_k gamma_k + 1/(k + 1), the leading coefficient of the local error.
ERROR = KAPPA * GAMMA + 1.0 / np.arange(2, HIGHEST_ORDER + 2)
#: U of section 2.1: backward differences of a polynomial of the step ratio.
U = np.array([[-1.0, -2.0, -3.0, -4.0, -5.0], [0, 1, 3, 6, 10], [0, 0, -1, -4, -10], [0, 0, 0, 1, 5], [0, 0, 0, 0, -1]])


def _powers() -> NDArray[np.float64]:
    """Row j - 1: coefficients of theta, ..., theta^5 in (theta - 1) theta (theta + 1) ... (theta + j - 2)/j!."""
    rows = np.zeros((HIGHEST_ORDER, DEGREE))
    for j in range(1, HIGHEST_ORDER + 1):
        polynomial = np.polynomial.Polynomial.fromroots([1.0 - m for m in range(j)]) / factorial(j)
        rows[j - 1, :j] = polynomial.coef[1:]
    return rows


POWERS = _powers()


@compiled(**LEAN)
def rescale(s, v, k, ratio):
    """Turn the first k differences into those for a step `ratio` times as long: dif (R U) of section 2.1."""
    R, RU = s.R, s.RU
    for j in range(k):
        product = 1.0
        for i in range(k):
            product *= (i - (j + 1) * ratio) / (i + 1)
            R[i, j] = product
    for i in range(k):
        for j in range(k):
            total = 0.0
            for m in range(j + 1):
                total += R[i, m] * U[m, j]
            RU[i, j] = total
    for state in range(v.shape[1]):
        for j in range(k):
            total = 0.0
            for i in range(k):
                total += v[DIF + i, state] * RU[i, j]
            R[0, j] = total
        for j in range(k):
            v[DIF + j, state] = R[0, j]


@compiled(**LEAN)
def prepare_polynomial(space, s):
    """Write the interpolant of the step just taken, in its end and the k differences there (equation 2)."""
    if s.part < 1.0:  # it was cut, and what it was cut from is gone
        return
    v = vectors(space)
    for p in range(DEGREE):
        for i in range(v.shape[1]):
            total = 0.0
            for j in range(s.k):
                total += POWERS[j, p] * v[DIF + j, i]
            v[POLYNOMIAL + p, i] = total
