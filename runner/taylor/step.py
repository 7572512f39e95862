"""Order and step of a Taylor series: A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99-117.

With an order p and a step h = rho tol^(1/p), rho the radius of convergence, the first term left out is about tol of the
solution. p = -ln(tol) / R makes that h = rho e^-R. Their R is 2: the work of an order grows like its number, and then
this costs least a unit of time. Here most of the work of an order is the same for all, and a smaller R costs less;
less where constraints hold, as to put the end of a step on them costs as much as many orders do; least without sums
over lower orders, in linear models, whose solutions converge everywhere: rho then grows with p.
"""

import math

import numpy as np

from qddot.runner.frame.space import states
from qddot.runner.machine.bits import bits_of, elementary, float_of
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.exponentials import about_exp2, about_log2
from qddot.runner.machine.memory import LEAN
from qddot.runner.machine.series_memory import HIGHEST
from qddot.runner.taylor.space import ATOL, RTOL, coefficient

#: R without sums over lower orders, with them, and under constraints; the lowest order. Beyond the highest one, terms
#: of a linear model that cancel would be hundreds of times as large as their sum.
PLAIN, RATIO, HELD, LOWEST = 0.4, 1.5, 0.8, 5


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
def sizes(space, rtol):
    """The largest coefficients of the last two orders, relative to their states or to where the absolute tolerance
    takes over. rtol: the least of all. Infinite where one is no number.
    """
    order = space.highest
    now, before, last = coefficient(space, 0), coefficient(space, order - 1), coefficient(space, order)
    relative, absolute = states(space, RTOL), states(space, ATOL)
    one, two = 0, 0
    for i in range(space.n):
        scale = rtol / max(relative[i] * abs(now[i]), absolute[i])
        of_before, of_last = rank(before[i] * scale), rank(last[i] * scale)
        one, two = of_before if of_before > one else one, of_last if of_last > two else two
    infinite = rank(np.inf)
    return (float_of(one), float_of(two)) if one < infinite and two < infinite else (np.inf, np.inf)


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


@elementary
def allowed(before, last, order, decay):
    """The step by the sizes of the last two coefficients; 0 where one is infinite, infinite where both vanish."""
    one, other = about_log2(before) * (1.0 / (order - 1.0)), about_log2(last) * (1.0 / order)
    return about_exp2(decay - (one if one > other else other))


@compiled(**LEAN)
def step_size(space, rtol, decay):
    """The step that the series allows; 0 where a last coefficient is not finite, infinite where both vanish."""
    before, last = sizes(space, rtol)
    return allowed(before, last, float(space.highest), decay)
