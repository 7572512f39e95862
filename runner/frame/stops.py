"""The times that a run lands on: where its inputs may jump or have a kink, and its end."""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.instants import ROUNDING, between

Times = NDArray[np.float64]


def stops_to_end(breakpoints: Times, t0: float, t1: float) -> Times:
    """The breakpoints within the span that are apart from each other and from its ends, then the end."""
    if not t0 < t1:
        raise ValueError(f"the span is from {t0} to {t1}, expected a start before the end")
    return np.append(between(breakpoints, float(t0), float(t1)), float(t1))


def grid_stops(breakpoints: Times, wanted: Times, t0: float, t1: float, step: float) -> Times:
    """The stops of a run on the grid t0 + k*step: the wanted times, and the breakpoints that are none of them.

    A breakpoint that is a grid point has the time that the grid gives it.
    """
    times = _elsewhere(between(breakpoints, t0, t1), wanted)
    grid = t0 + np.round((times - t0) / step) * step
    times = np.where(np.abs(times - grid) > ROUNDING * np.abs(times), times, grid)
    return np.sort(np.concatenate([wanted, times]), kind="stable")


def _elsewhere(breakpoints: Times, wanted: Times) -> Times:
    """The breakpoints that are no wanted time: there a run stops anyway."""
    if not wanted.size:
        return breakpoints
    after = np.searchsorted(wanted, breakpoints)
    gaps = [np.abs(breakpoints - wanted[np.clip(after + side, 0, len(wanted) - 1)]) for side in (-1, 0)]
    return breakpoints[np.minimum(*gaps) > ROUNDING * np.abs(breakpoints)]
