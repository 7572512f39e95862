"""Order and step of a Taylor series: A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99-117.

With an order p and a step h = rho e^-R, rho the radius of convergence, the first term left out is about e^(-R p) of the
solution. Their R is 2: the work of an order grows like its square, so p = -ln(tol) / 2 + 1 costs least a unit of time.
Here most of the work of an order is the same for all, and R = 1.5 costs less.
"""

import math

import numpy as np

from qddot.runner.frame.space import states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.taylor.space import ATOL, RTOL, coefficient

#: R, and the lowest and highest order.
RATIO, LOWEST, HIGHEST = 1.5, 5, 30


def order_for(rtol: float) -> int:
    """The order for a relative tolerance."""
    return min(HIGHEST, max(LOWEST, math.ceil(-math.log(rtol) / RATIO)))


@compiled(**LEAN)
def size(space, rtol, k):
    """The largest coefficient of order k, relative to its state or to where the absolute tolerance takes over.

    rtol: the least of all. Infinite where one is no number.
    """
    now, row = coefficient(space, 0), coefficient(space, k)
    relative, absolute = states(space, RTOL), states(space, ATOL)
    largest = 0.0
    for i in range(space.n):
        part = abs(row[i]) * rtol / max(relative[i] * abs(now[i]), absolute[i])
        if not part <= largest:
            largest = part if part < np.inf else np.inf
    return largest


@compiled(**LEAN)
def worst_state(space, k):
    """Index of the first state whose coefficient of order k is not finite, or else of the largest one."""
    row, found = coefficient(space, k), 0
    for i in range(space.n):
        if not np.isfinite(row[i]):
            return i
        if abs(row[i]) > abs(row[found]):
            found = i
    return found


@compiled(**LEAN)
def step_size(space, rtol):
    """The step by the last two coefficients; 0 where one is not finite, infinite where both vanish."""
    order, radius = space.highest, np.inf
    for k in range(order - 1, order + 1):
        found = size(space, rtol, k)
        if found == np.inf:
            return 0.0
        if found > 0.0:
            radius = min(radius, found ** (-1.0 / k))
    return radius * np.exp(-RATIO - 0.7 / (order - 1))
