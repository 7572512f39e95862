"""A Python function as a signal: a cubic table of its values, fine enough where it bends."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import finite
from qddot.runner.inputs.instants import RESOLVED
from qddot.runner.inputs.signal import C0, START, Signal

Vector = NDArray[np.float64]

#: Intervals of a stretch between breakpoints at first: what is shorter than one of them may not be seen.
FIRST_INTERVALS = 64
#: Parts of an interval at which the table is compared with the function; not even, so that no wave hides between them.
PLACES = (0.21, 0.5, 0.83)
#: Most values of a table, and halvings of a first interval.
MOST_VALUES, MOST_HALVINGS = 100_000, 32


def sampled(
    function: Callable[[float], float],
    start: float,
    end: float,
    *,
    tolerance: float,
    breakpoints: ArrayLike = (),
) -> Signal:
    """A function of time (or of the distance along a road) as a signal: cubics within `tolerance` of it.

    function(t) gives a number, in the unit of the input; it is called for times from start to end, whose values hold
    before and after. Between breakpoints the cubics are a spline, twice continuously differentiable, halved where they
    are farther than `tolerance` (in the same unit) from the function at three places within each; a feature shorter
    than a 64th of the distance between breakpoints may be missed. breakpoints: where the function jumps or bends.
    Raises ValueError naming the argument, the time at which the function is no number, or where it cannot be followed.
    """
    if not callable(function):
        raise ValueError(f"function is {function!r}, expected a function of one number; samples: qddot.signal.table")
    ends = finite("start", start), finite("end", end)
    if not ends[0] < ends[1]:
        raise ValueError(f"start is {start} and end {end}, expected a start before the end")
    if finite("tolerance", tolerance) <= 0:
        raise ValueError(f"tolerance is {tolerance}, expected a number greater than 0, in the unit of the input")
    kinks = np.unique(np.atleast_1d(np.array(breakpoints, dtype=np.float64)))
    if not ((kinks > ends[0]) & (kinks < ends[1])).all():
        raise ValueError(f"breakpoints are {breakpoints!r}, expected times between {start} and {end}")
    knots = np.concatenate([ends[:1], kinks, ends[1:]])
    stretches = [_spline(function, a, b, tolerance, a > ends[0], b < ends[1]) for a, b in pairwise(knots)]
    pieces = np.concatenate([np.zeros((1, 8)), *stretches, np.zeros((1, 8))])
    pieces[0, START], pieces[0, C0] = ends[0] - (ends[1] - ends[0]), _value(function, ends[0])
    pieces[-1, START], pieces[-1, C0] = ends[1], _value(function, ends[1])
    return Signal(pieces, knots)


def _value(function: Callable[[float], float], t: float) -> float:
    value = function(t)
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    return finite(f"the function at {t!r}", value)


def _spline(
    function: Callable[[float], float], a: float, b: float, tolerance: float, from_right: bool, from_left: bool
) -> Vector:
    """Pieces (n, 8) from a to b; at a breakpoint with the limit from within."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - slow to import, and most runs need none

    within = np.nextafter(a, b) if from_right else a, np.nextafter(b, a) if from_left else b
    t = np.linspace(a, b, FIRST_INTERVALS + 1)
    values = np.array([_value(function, each) for each in np.clip(t, *within).tolist()])
    least = max((b - a) / FIRST_INTERVALS * 0.5**MOST_HALVINGS, RESOLVED * np.spacing(max(abs(a), abs(b))))
    if (b - a) / FIRST_INTERVALS < least:
        raise ValueError(f"from {a!r} to {b!r} are too few floating-point numbers to sample a function at")
    while True:
        spline = CubicSpline(t, values)
        places = t[:-1] + np.diff(t) * np.array(PLACES)[:, None]
        found = np.array([_value(function, each) for each in places.ravel().tolist()]).reshape(places.shape)
        off = np.abs(spline(places) - found).max(axis=0)
        bad = np.flatnonzero(off > tolerance)
        if not bad.size:
            break
        if np.diff(t)[bad].min() < 2 * least or len(t) + bad.size > MOST_VALUES:
            worst = bad[np.argmax(off[bad] / np.diff(t)[bad])]
            raise ValueError(
                f"the function cannot be followed to {tolerance:g} at {t[worst]:.9g}: if it jumps or bends there, give "
                f"breakpoints=[{t[worst]:.9g}], else a larger tolerance"
            )
        t, values = np.insert(t, bad + 1, places[1, bad]), np.insert(values, bad + 1, found[1, bad])
    pieces = np.zeros((len(t) - 1, 8))
    pieces[:, START], pieces[:, C0 : C0 + 4] = t[:-1], spline.c[::-1].T
    return pieces
