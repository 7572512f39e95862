"""Where a function turns within an interval, judged by the polynomial through its values at Chebyshev's points.

With coefficients b_k of Bernstein's form a polynomial has no more zeros in (0, 1) than the b_k have changes of sign;
halving the interval by de Casteljau's scheme until there is none, or the interval is narrow, misses no zero (R. T.
Farouki, The Bernstein polynomial basis: a centennial retrospective, Computer Aided Geometric Design 29 (2012) 379-419).
"""

from functools import cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, floats, matrix

#: Halvings until an interval is narrow. What a function misses of its extreme there is the square of its width.
HALVINGS = 26
NARROW = 2.0**-HALVINGS
#: The last coefficients of Chebyshev's series are at most this part of what the values range over, where the polynomial
#: stands for the function; or that part of their size, which is rounding.
RESOLVED, ROUNDED = 1e-2, 1e-12


@compiled(**INLINE)
def point(j, degree):
    """The j-th of Chebyshev's points of an interval from 0 to 1, ends included."""
    return 0.5 - 0.5 * np.cos(np.pi * j / degree)


@cache
def points(degree: int) -> NDArray[np.float64]:
    """All of these points, (degree + 1,)."""
    found: NDArray[np.float64] = point.py_func(np.arange(degree + 1), degree)
    return found


@cache
def to_bernstein(degree: int) -> NDArray[np.float64]:
    """The matrix that makes Bernstein's coefficients of values at `points`, (degree + 1, degree + 1)."""
    s, k = points(degree)[:, None], np.arange(degree + 1)
    basis = np.array([comb(degree, i) for i in k]) * s**k * (1.0 - s) ** (degree - k)
    return np.ascontiguousarray(np.linalg.inv(basis))


@cache
def to_tail(degree: int) -> NDArray[np.float64]:
    """The matrix that makes the last two coefficients of Chebyshev's series of values at `points`, (2, degree + 1)."""
    weights = np.full(degree + 1, 2.0 / degree)
    weights[[0, -1]] *= 0.5
    tail = np.array([np.cos(np.pi * np.arange(degree + 1) * k / degree) for k in (degree - 1, degree)]) * weights
    tail[1] *= 0.5
    return tail


def room(degree: int) -> int:
    """Numbers that `turning_points` needs room for."""
    return (HALVINGS + 2) * (degree + 2)


@compiled(**LEAN)
def keeps_sign(c, count):
    """Whether all of these coefficients are above zero, or all below."""
    above = below = 0
    for k in range(count):
        above += c[k] > 0.0
        below += c[k] < 0.0
    return max(above, below) == count


@compiled(**LEAN)
def changes(c, count):
    """Changes of sign of the coefficients; zero counts as above, so that a zero where two intervals meet is in one."""
    found = 0
    for k in range(1, count):
        found += (c[k - 1] >= 0.0) != (c[k] >= 0.0)
    return found


@compiled(**LEAN)
def halve(whole, left, count):
    """Turn the coefficients of an interval into those of its right half, and write those of its left half."""
    for k in range(count):
        left[k] = whole[0]
        for j in range(count - 1 - k):
            whole[j] = 0.5 * (whole[j] + whole[j + 1])


@compiled(**LEAN)
def turning_points(c, degree, stack, found):
    """Write where in (0, 1) the polynomial of coefficients c (degree + 1,) turns, rising; returns how often.

    stack: the address of `room` numbers; found: (2 degree,).
    """
    rows = matrix(stack, HALVINGS + 2, degree + 2)
    for k in range(degree):
        rows[0, k] = c[k + 1] - c[k]
    rows[0, degree], rows[0, degree + 1] = 0.0, 1.0
    count, top = 0, 0
    while top >= 0 and count < 2 * degree:
        whole, start, width = rows[top], rows[top, degree], rows[top, degree + 1]
        if changes(whole, degree) == 0:
            top -= 1
        elif width <= NARROW:
            found[count] = start + 0.5 * width
            count += 1
            top -= 1
        else:
            width *= 0.5
            halve(whole, rows[top + 1], degree)
            rows[top, degree], rows[top, degree + 1] = start + width, width
            rows[top + 1, degree], rows[top + 1, degree + 1] = start, width
            top += 1
    return count


@compiled(**LEAN)
def stands_for(values, first, stride, tail, degree):
    """Whether the polynomial through values at `points`, every `stride`-th from the first on, stands for the function.

    tail: the address of the matrix `to_tail`.
    """
    weights = floats(tail, 2 * (degree + 1))
    least, greatest, last, before = np.inf, -np.inf, 0.0, 0.0
    for j in range(degree + 1):
        value = values[first + stride * j]
        least, greatest = min(least, value), max(greatest, value)
        before += weights[j] * value
        last += weights[degree + 1 + j] * value
    largest = max(abs(least), abs(greatest))
    return not abs(before) + abs(last) > RESOLVED * (greatest - least) + ROUNDED * largest
