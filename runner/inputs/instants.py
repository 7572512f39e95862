"""Which times are one time, and on which side of a breakpoint a time lies: the one rule of all methods.

Two times are one where no more than rounding is between them, a few spacings of floating-point numbers at these times.
No step, span or duration enters: a pulse of a microsecond is as far from nothing in a step of a second as in one of a
nanosecond, an epoch after zero as at zero.
"""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN

Times = NDArray[np.float64]

#: Times that differ by no more than this part of themselves are one: 16 to 32 spacings. A time that is computed in two
#: ways, as a grid point and as a breakpoint, differs by one or two.
ROUNDING = 16 * 2.0**-52
#: At the ends of a step inputs are looked up at least this part of the step inside, and at least this part of the time:
#: beyond all that is one with the end.
SIDE, INSET = 1e-6, 4 * ROUNDING
#: Edges of a pulse are refused where they are fewer spacings apart: a step from one to the other must see its shape.
RESOLVED = 1000


@compiled(**LEAN)
def rounding(t):
    """What may be between two times at t that are one."""
    return ROUNDING * abs(t)


@compiled(**LEAN)
def side_of(t, h, c):
    """The time at which to look up the inputs of t + c h, 0 <= c <= 1: strictly inside the step from t to t + h."""
    inset = min(max(SIDE * h, INSET * abs(t)), 0.5 * h)
    return t + min(max(c * h, inset), h - inset)


@compiled(**LEAN)
def after(t, ahead):
    """The time at which to look up the inputs of t, from which it is `ahead` to the next breakpoint, however far."""
    return t + min(INSET * abs(t), 0.5 * ahead)


def apart(times: Times) -> NDArray[np.bool_]:
    """Which of rising times (n,) are another time than the last one chosen before them."""
    chosen = np.diff(times, prepend=-np.inf) > ROUNDING * np.abs(times)
    last = 0
    for i in np.flatnonzero(~chosen).tolist():
        last = i - 1 if chosen[i - 1] else last
        chosen[i] = times[i] - times[last] > ROUNDING * abs(times[i])
    return chosen


def between(times: Times, t0: float, t1: float) -> Times:
    """Those of rising times (n,) that are after t0, before t1 and apart from each other."""
    if not len(times):
        return times
    near = ROUNDING * np.abs(times)
    inside = times[(times - t0 > near) & (t1 - times > near)]
    return inside[apart(inside)] if len(inside) > 1 else inside


def check_resolved(what: str, start: float, length: float, unit: str = "s") -> None:
    """ValueError where floating-point numbers do not tell `start` from `start + length` well enough."""
    spacing = float(np.spacing(max(abs(start), abs(start + length))))
    if length < RESOLVED * spacing:
        raise ValueError(
            f"{what} at {start!r} {unit} is {length:.6g} {unit} long, but floating-point numbers there are "
            f"{spacing:.3g} {unit} apart, and it needs {RESOLVED} of them; count from nearer to it, or make it longer"
        )
