"""Order and step of a Taylor series: A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99-117.

With an order p and a step h = rho tol^(1/p), rho the radius of convergence, the first term left out is about tol of the
solution. p = -ln(tol) / R makes that h = rho e^-R. Their R is 2: the work of an order grows like its number, and then
this costs least a unit of time. Here most of the work of an order is the same for all, and a smaller R costs less;
least without sums over lower orders, in linear models, whose solutions converge everywhere: rho then grows with p.
"""

import math

import numpy as np

from qddot.runner.frame.space import states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.taylor.space import ATOL, RTOL, coefficient

#: R without sums over lower orders, and with them; the lowest and the highest order.
PLAIN, RATIO, LOWEST, HIGHEST = 0.75, 1.5, 5, 30


def order_for(rtol: float, sums: int) -> int:
    """The order for a relative tolerance and a series with so many sums over lower orders."""
    return min(HIGHEST, max(LOWEST, math.ceil(-math.log(rtol) / (RATIO if sums else PLAIN))))


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
    order, growth = space.highest, -np.inf  # that of the radius's inverse, as a logarithm: a power takes two of them
    for k in range(order - 1, order + 1):
        found = size(space, rtol, k)
        if found == np.inf:
            return 0.0
        if found > 0.0:
            growth = max(growth, np.log(found) / k)
    return np.exp(np.log(rtol) / order - 0.7 / (order - 1) - growth)
