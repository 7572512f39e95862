"""Piecewise polynomials through the points of a table: straight lines, a spline, or a monotone one; in plain Python."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from typing import Any

#: An origin and the coefficients of the powers of the distance from it, from the constant to the cube.
Piece = tuple[float, float, float, float, float]

#: The degree of the polynomials of each kind.
DEGREES = {"linear": 1, "cubic": 3, "monotone": 3}
#: How many derivatives of each do not jump at the points.
SMOOTHNESS = {"linear": 0, "cubic": 2, "monotone": 1}
OUTSIDE = ("hold", "extend", "refuse")


@dataclass(frozen=True)
class Pieces:
    """Polynomials: the first before all points, each other one from its origin to that of the next."""

    pieces: tuple[Piece, ...]
    degree: int

    def at(self, x: Any, order: int = 0) -> Any:
        """The value at x, or the derivative of that order; x is a number of any kind that Python's signs know."""
        origin, *coefficients = self.pieces[bisect_right(self.pieces, x, lo=1, key=itemgetter(0)) - 1]
        return polynomial(coefficients, x - origin, order)


def polynomial(coefficients: Sequence[Any], distance: Any, order: int) -> Any:
    """The value of a polynomial, its coefficients by rising power, or its derivative of that order."""
    value: Any = 0.0
    for power in range(len(coefficients) - 1, order - 1, -1):
        value = value * distance + math.perm(power, order) * coefficients[power]
    return value


def interpolated(x: Sequence[float], y: Sequence[float], kind: str, outside: str) -> Pieces:
    """The pieces through points that rise in x, two or more.

    kind: "linear"; "cubic", a spline twice continuously differentiable with not-a-knot ends (de Boor, A Practical Guide
    to Splines, chapter IV); "monotone", once continuously differentiable and without new extremes (Fritsch and Butland,
    SIAM J. Sci. Stat. Comput. 5 (1984) 300-304). outside: "hold" the end values, "extend" the end slopes, or "refuse",
    which gives no number.
    """
    steps = [b - a for a, b in pairwise(x)]
    rises = [(b - a) / h for (a, b), h in zip(pairwise(y), steps, strict=True)]
    if kind == "linear" or len(x) == 2:
        inner = [(x[i], y[i], rises[i], 0.0, 0.0) for i in range(len(steps))]
        ends = rises[0], rises[-1]
    else:
        slopes = (_spline_slopes if kind == "cubic" else _monotone_slopes)(steps, rises)
        inner = [_hermite(x[i], y[i], steps[i], rises[i], slopes[i], slopes[i + 1]) for i in range(len(steps))]
        ends = slopes[0], slopes[-1]
    behind = math.nextafter(x[-1], math.inf) if outside == "refuse" else x[-1]
    before, after = _beyond(x[0], y[0], ends[0], outside), _beyond(behind, y[-1], ends[1], outside)
    return Pieces((before, *inner, after), DEGREES[kind])


def alternating(x: Sequence[float], *, refused: bool) -> Pieces:
    """What changes its sign at each point of a table, and its slope at none: arcs between them, up and down in turn.

    refused: that there is nothing outside, so that the sign stays what it is at the first and at the last point.
    """
    n = len(x)
    signs = [1.0 if i % 2 == 0 else -1.0 for i in range(n + 1)]
    steps = [b - a for a, b in pairwise(x)]
    inner: list[Piece] = [(x[i], 0.0, s, -s / h, 0.0) for i, (h, s) in enumerate(zip(steps, signs[1:], strict=False))]
    before: Piece = (x[0], 0.0, -signs[0], 0.0, 0.0)
    after: Piece = (x[-1], 0.0, signs[-1], 0.0, 0.0)
    if refused:
        inner[-1] = after = (x[n - 2], 0.0, signs[n - 1], 0.0, 0.0)
        inner[0] = before = (x[0], signs[1] * steps[0], -signs[1], 0.0, 0.0)
        after = (math.nextafter(x[-1], math.inf), signs[n - 1] * steps[-1], signs[n - 1], 0.0, 0.0)
    return Pieces((before, *inner, after), DEGREES["cubic"])


def _beyond(x: float, y: float, slope: float, outside: str) -> Piece:
    if outside == "refuse":
        return (x, math.nan, math.nan, math.nan, math.nan)
    return (x, y, slope if outside == "extend" else 0.0, 0.0, 0.0)


def _hermite(x: float, y: float, step: float, rise: float, first: float, second: float) -> Piece:
    """The cubic from x to x + step with the mean slope `rise` and these slopes at its ends."""
    bend = (first + second - 2 * rise) / step
    return (x, y, first, (rise - first) / step - bend, bend / step)


def _spline_slopes(h: Sequence[float], m: Sequence[float]) -> list[float]:
    """Slopes at the points such that second derivatives agree, third ones at the second and last but one point too."""
    n = len(h) + 1
    if n == 3:  # one parabola
        bend = (m[1] - m[0]) / (h[0] + h[1])
        return [m[0] - bend * h[0], m[0] + bend * h[0], m[1] + bend * h[1]]
    below = [0.0, *h[1:], h[-1] + h[-2]]
    middle = [h[1], *(2 * (h[i - 1] + h[i]) for i in range(1, n - 1)), h[-2]]
    above = [h[0] + h[1], *h[:-1], 0.0]
    right = [_end(h[0], h[1], m[0], m[1])]
    right += [3 * (h[i] * m[i - 1] + h[i - 1] * m[i]) for i in range(1, n - 1)]
    right += [_end(h[-1], h[-2], m[-1], m[-2])]
    for i in range(1, n):
        factor = below[i] / middle[i - 1]
        middle[i] -= factor * above[i - 1]
        right[i] -= factor * right[i - 1]
    slopes = [right[-1] / middle[-1]]
    for i in range(n - 2, -1, -1):
        slopes.insert(0, (right[i] - above[i] * slopes[0]) / middle[i])
    return slopes


def _end(h: float, inner: float, m: float, inner_m: float) -> float:
    both = h + inner
    return ((h + 2 * both) * inner * m + h * h * inner_m) / both


def _monotone_slopes(h: Sequence[float], m: Sequence[float]) -> list[float]:
    """Weighted harmonic means of the neighbouring slopes, zero where these have not the same sign."""
    inner = [
        0.0
        if not _same_sign(m[i - 1], m[i])
        else 3 * (h[i - 1] + h[i]) / ((2 * h[i] + h[i - 1]) / m[i - 1] + (h[i] + 2 * h[i - 1]) / m[i])
        for i in range(1, len(h))
    ]
    return [_monotone_end(h[0], h[1], m[0], m[1]), *inner, _monotone_end(h[-1], h[-2], m[-1], m[-2])]


def _monotone_end(h: float, inner: float, m: float, inner_m: float) -> float:
    """The parabola's slope at the end, cut off where it would overshoot."""
    slope = ((2 * h + inner) * m - h * inner_m) / (h + inner)
    if not _same_sign(slope, m):
        return 0.0
    return 3 * m if not _same_sign(m, inner_m) and abs(slope) > 3 * abs(m) else slope


def _same_sign(one: float, other: float) -> bool:
    """Whether both are positive or both negative; their product may be too small for a number."""
    return (one > 0 and other > 0) or (one < 0 and other < 0)
