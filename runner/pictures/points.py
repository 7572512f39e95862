"""Where a function with breakpoints is looked at so that a curve through its values shows all of it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

#: Points of a curve, and what stands between a point and the breakpoint beside it, relative to the width.
POINTS, BESIDE = 2000, 1e-9


def points(function: Callable[[Vector], Vector], breaks: Vector, reach: tuple[float, float]) -> tuple[Vector, Vector]:
    """Arguments and values between two arguments, evenly and to both sides of the breakpoints."""
    begin, end = reach
    inside = breaks[(breaks > begin) & (breaks < end)][:POINTS]
    gaps = np.diff(inside, prepend=begin, append=end)
    near = np.minimum(BESIDE * (end - begin), np.minimum(gaps[1:], gaps[:-1]) / 4)
    near = np.maximum(near, np.spacing(np.abs(inside)))
    between = _between(inside[:100])
    x = np.unique(np.concatenate([np.linspace(begin, end, POINTS), inside - near, inside, inside + near, between]))
    return x, function(x)


def _between(breaks: Vector) -> Vector:
    """Points between breakpoints, the middles among them: a pulse shows its peak."""
    parts = np.linspace(0.0, 1.0, 65)
    return (breaks[:-1, None] + np.diff(breaks)[:, None] * parts).ravel() if len(breaks) > 1 else breaks
