"""Order and step of a Taylor series: A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99-117.

With an order p and a step h = rho tol^(1/p), rho the radius of convergence, the first term left out is about tol of the
solution. p = -ln(tol) / R makes that h = rho e^-R. Their R is 2: the work of an order grows like its number, and then
this costs least a unit of time. Here most of the work of an order is the same for all, and a smaller R costs less;
less where constraints hold, as to put the end of a step on them costs as much as many orders do; least without sums
over lower orders, in linear models, whose solutions converge everywhere: rho then grows with p.
"""

import math

import numpy as np

from qddot.runner.frame.space import row_address
from qddot.runner.machine.bits import bits_of
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.machine.series_calls import call_step
from qddot.runner.machine.series_memory import HIGHEST
from qddot.runner.taylor.space import ATOL, RTOL, coefficient

#: R without sums over lower orders, with them, and under constraints; the lowest order. Beyond the highest one, terms
#: of a linear model that cancel would be hundreds of times as large as their sum.
PLAIN, RATIO, HELD, LOWEST = 0.4, 1.3, 0.8, 5


def order_for(rtol: float, sums: int, *, held: bool = False) -> int:
    """The order for a relative tolerance and a series with so many sums over lower orders; held: under constraints."""
    ratio = HELD if held else RATIO if sums else PLAIN
    return min(HIGHEST, max(LOWEST, math.ceil(-math.log(rtol) / ratio)))


def decay_for(rtol: float, order: int) -> float:
    """The logarithm, to base 2, of a step over the radius of convergence."""
    return (math.log(rtol) / order - 0.7 / (order - 1)) / math.log(2.0)


@compiled(**LEAN)
def rank(x):
    """The bits of |x| as a whole number, which rises with it; what is no number is above all.

    LLVM finds the largest of whole numbers side by side, and of others one by one: there may be one that is none.
    """
    return bits_of(abs(x))


@compiled(**LEAN)
def largest(row, n):
    """The largest size in a row (n,), or what is no number, as its `rank`."""
    found = 0
    for i in range(n):
        size = rank(row[i])
        found = size if size > found else found
    return found


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
def step_size(space, rtol, decay):
    """The step that the series allows; 0 where a last coefficient is not finite, infinite where both vanish."""
    relative, absolute = row_address(space, RTOL), row_address(space, ATOL)
    return call_step(space.step, space.memory, space.highest, relative, absolute, rtol, decay)
