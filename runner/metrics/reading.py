"""Readings: a number of a run, wherever the points are that it saved; or its curve at other times.

Where a run saved fewer than ENOUGH points, what lies between them is that of the method's dense output.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from qddot.runner.checks import unknown
from qddot.runner.solution import Solution

Vector = NDArray[np.float64]

#: What is read of a quantity within a window; "largest" is the greatest magnitude.
Reading = Literal["greatest", "least", "range", "largest", "final", "rms", "at"]


def reading(
    solution: Solution,
    quantity: str,
    what: Reading = "greatest",
    *,
    change: bool = False,
    after: float | None = None,
    before: float | None = None,
    at: float | None = None,
) -> float:
    """A number of a run: the greatest, least, ... value of a state, output or input, in its unit.

    The points of the run may be spaced in any way.
    change: of the change since the start. after, before: the window, s; the whole run by default. at: the time, s, of
    "at", between points by a cubic spline. Extremes are those of the parabola through the highest point and its
    neighbours; "range" is the greatest less the least value. Of a run of few points, as methods that control their step
    save them, both are those of dense output, see `Solution.extremes`. Raises ValueError for a quantity that the run
    does not have, a window of fewer than three points, or values that are no numbers.
    """
    if what not in (*_READINGS, "at"):
        raise ValueError(unknown("reading", what, (*_READINGS, "at")))
    if (what == "at") != (at is not None):
        raise ValueError('`at` is a time, given with the reading "at" and with no other')
    if at is not None:
        return float(curve_at(solution, quantity, np.array([at]), change=change)[0])
    t, y = _column(solution, quantity, change)
    inside = _window(t, after, before)
    _refuse_no_number(quantity, t[inside], y[inside])
    if solution.closely is not solution and what in _EXTREMES:
        found = solution.extremes(quantity, after, before)
        start = solution[quantity][0] if change else 0.0
        return float(_EXTREMES[what](found.least - start, found.greatest - start))
    return float(_READINGS[what](t[inside], y[inside]))


def curve_at(solution: Solution, quantity: str, times: Vector, *, change: bool = False) -> Vector:
    """A quantity at times (n,) within the run, s, between its points by a cubic spline. Raises as `reading`."""
    t, y = _column(solution, quantity, change)
    if times.min() < t[0] or times.max() > t[-1]:
        raise ValueError(f"observed from {times.min():g} to {times.max():g} s, run from {t[0]:g} to {t[-1]:g} s")
    _refuse_no_number(quantity, t, y)
    keep = np.append(np.diff(t) > 0, True)  # of several points at one time, as at a jump, the last counts
    return np.array(CubicSpline(t[keep], y[keep])(times))


def _column(solution: Solution, quantity: str, change: bool) -> tuple[Vector, Vector]:
    if quantity not in solution:
        raise ValueError(unknown("quantity", quantity, solution.names))
    shown = solution.closely
    y = np.array(shown[quantity])
    return shown.t, y - y[0] if change else y


def _refuse_no_number(name: str, t: Vector, y: Vector) -> None:
    bad = np.flatnonzero(~np.isfinite(y))
    if bad.size:
        raise ValueError(f"{name} is no finite number ({y[bad[0]]}) at {t[bad[0]]:g} s of the run")


def _window(t: Vector, after: float | None, before: float | None) -> slice:
    start, end = t[0] if after is None else after, t[-1] if before is None else before
    first, last = np.searchsorted(t, [start, end], side="left")
    window = slice(int(first), int(np.searchsorted(t, end, side="right")))
    if window.stop - window.start < 3 or first > last:
        raise ValueError(f"the window from {start:g} s to {end:g} s holds fewer than three points of the run")
    return window


def _greatest(t: Vector, y: Vector) -> float:
    """The top of the parabola through the highest point and its neighbours, so that it moves smoothly."""
    k = int(np.argmax(y))
    if not 0 < k < len(y) - 1:
        return float(y[k])
    left, right = t[k - 1] - t[k], t[k + 1] - t[k]
    if left == 0 or right == 0:
        return float(y[k])
    curvature, slope = np.linalg.solve([[left**2, left], [right**2, right]], [y[k - 1] - y[k], y[k + 1] - y[k]])
    return float(y[k] - slope**2 / (4 * curvature)) if curvature < 0 else float(y[k])


def _least(t: Vector, y: Vector) -> float:
    return -_greatest(t, -y)


def _rms(t: Vector, y: Vector) -> float:
    return float(np.sqrt(np.trapezoid(y**2, t) / (t[-1] - t[0])))


_READINGS = {
    "greatest": _greatest,
    "least": _least,
    "range": lambda t, y: _greatest(t, y) - _least(t, y),
    "largest": lambda t, y: max(_greatest(t, y), -_least(t, y)),
    "final": lambda t, y: float(y[-1]),
    "rms": _rms,
}
#: The same of the least and the greatest value.
_EXTREMES = {
    "greatest": lambda least, greatest: greatest,
    "least": lambda least, greatest: least,
    "range": lambda least, greatest: greatest - least,
    "largest": lambda least, greatest: max(greatest, -least),
}
