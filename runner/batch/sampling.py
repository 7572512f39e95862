"""The uniform samples of the runs of a batch."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.methods import find_method

#: Samples of a run where nobody says how many, about; and the most.
DEFAULT_SAMPLES, MOST_SAMPLES = 5000, 10_000_000
#: How nearly a whole number of intervals makes up the span, relative.
WHOLE = 1e-9


@dataclass(frozen=True)
class Sampling:
    """Uniform samples of a run, `count` of them, the first at t0 and the last at t1, in s."""

    t0: float
    t1: float
    count: int

    @property
    def interval(self) -> float:
        """Time between two samples, s."""
        return (self.t1 - self.t0) / (self.count - 1)

    @property
    def times(self) -> NDArray[np.float64]:
        """The times (count,) in s."""
        return np.linspace(self.t0, self.t1, self.count)


def sampling_of(arguments: Mapping[str, Any], interval: float | None) -> Sampling:
    """The samples of runs with these arguments of `simulate`, an interval (s) apart.

    By default they are the points that a fixed-step method saves, or the span in 5000. Raises ValueError that begins
    with "outputs.interval: ".
    """
    t0, t1 = arguments["span"]
    if not t0 < t1:
        raise ValueError(f"span: from {t0:g} to {t1:g} s; expected a start before the end")
    if interval is None:
        return Sampling(t0, t1, 1 + _default_count(t1 - t0, arguments))
    if not 0 < interval <= t1 - t0:
        raise ValueError(f"outputs.interval: {interval:g} s; expected a time greater than 0, up to {t1 - t0:g} s")
    count = round((t1 - t0) / interval)
    if abs(count * interval - (t1 - t0)) > WHOLE * (t1 - t0):
        nearest = (t1 - t0) / count
        raise ValueError(
            f"outputs.interval: {interval:g} s does not divide the span of {t1 - t0:g} s; {nearest:.9g} s does"
        )
    if count > MOST_SAMPLES:
        raise ValueError(f"outputs.interval: {interval:g} s makes {count} samples a run; at most {MOST_SAMPLES} work")
    return Sampling(t0, t1, 1 + count)


def _default_count(span: float, arguments: Mapping[str, Any]) -> int:
    step = arguments.get("step")
    if not step or find_method(arguments.get("method", "rk4")).adaptive:
        return DEFAULT_SAMPLES
    steps = round(span / step)
    every = arguments.get("every") or max(1, -(-steps // DEFAULT_SAMPLES))
    count = round(span / (every * step)) if steps else 0
    fits = count > 0 and abs(count * every * step - span) <= WHOLE * span
    return min(count, MOST_SAMPLES) if fits else DEFAULT_SAMPLES
