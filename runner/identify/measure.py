"""What an observation is compared with: numbers and curves taken of a solution."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from qddot.runner.checks import unknown
from qddot.runner.identify.schema import Observation
from qddot.runner.solution import Solution

Vector = NDArray[np.float64]


def measured(solution: Solution, observation: Observation, times: Vector | None) -> Vector:
    """What the run says where the observation has its number (1,), or its curve at `times` (n,).

    Raises ValueError for a quantity that the run does not have, a window without points, or values that are no numbers.
    """
    if observation.quantity not in solution:
        raise ValueError(unknown("quantity", observation.quantity, solution.names))
    t, y = solution.t, np.array(solution[observation.quantity])
    y -= y[0] if observation.change else 0.0
    if times is not None or observation.at is not None:
        wanted = times if times is not None else np.array([observation.at])
        if wanted.min() < t[0] or wanted.max() > t[-1]:
            raise ValueError(f"observed from {wanted.min():g} to {wanted.max():g} s, run from {t[0]:g} to {t[-1]:g} s")
        _refuse_no_number(observation.quantity, t, y)
        return _smooth(t, y, wanted)
    inside = _window(t, observation)
    _refuse_no_number(observation.quantity, t[inside], y[inside])
    return np.array([_MEASURES[observation.measure](t[inside], y[inside])])


def _refuse_no_number(name: str, t: Vector, y: Vector) -> None:
    bad = np.flatnonzero(~np.isfinite(y))
    if bad.size:
        raise ValueError(f"{name} is no finite number ({y[bad[0]]}) at {t[bad[0]]:g} s of the run")


def _window(t: Vector, observation: Observation) -> slice:
    after = t[0] if observation.after is None else observation.after
    before = t[-1] if observation.before is None else observation.before
    first, last = np.searchsorted(t, [after, before], side="left")
    window = slice(int(first), int(np.searchsorted(t, before, side="right")))
    if window.stop - window.start < 3 or first > last:
        raise ValueError(f"the window from {after:g} s to {before:g} s holds fewer than three points of the run")
    return window


def _smooth(t: Vector, y: Vector, wanted: Vector) -> Vector:
    """Between the saved points by a cubic spline; of several points at one time, as at a jump, the last counts."""
    keep = np.append(np.diff(t) > 0, True)
    return CubicSpline(t[keep], y[keep])(wanted)


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


_MEASURES = {
    "greatest": _greatest,
    "least": _least,
    "range": lambda t, y: _greatest(t, y) - _least(t, y),
    "largest": lambda t, y: max(_greatest(t, y), -_least(t, y)),
    "final": lambda t, y: float(y[-1]),
    "rms": _rms,
}
