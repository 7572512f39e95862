"""The times at which a run is to be saved, checked against its span; its ends are saved whatever is wanted."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.instants import ROUNDING, between

Times = NDArray[np.float64]

#: Points that one run may save.
MOST_POINTS = 100_000_000


def check_within(times: Any, t0: float, t1: float) -> None:
    """ValueError naming the first of the output times (n,), None for none, that lies outside the span, either way."""
    if times is None:
        return
    times, low, high = np.asarray(times), min(t0, t1), max(t0, t1)
    outside = times[(low - times > ROUNDING * abs(low)) | (times - high > ROUNDING * abs(high))]
    if outside.size:
        raise ValueError(f"output time {outside[0]} is outside the span from {t0} to {t1}")


def wanted_times(times: Any, t0: float, t1: float) -> Times:
    """The output times strictly within the span from t0 to a later t1; raises as `check_within` does."""
    check_within(times, t0, t1)
    return np.empty(0) if times is None else between(np.asarray(times), float(t0), float(t1))


def check_points(count: int) -> None:
    """ValueError where a run would save more points than there may be."""
    if count > MOST_POINTS:
        raise ValueError(
            f"{count} points are to be saved, expected at most {MOST_POINTS}; give a larger every, or output_times"
        )
