"""A metric of one run: what a batch computes of each of its runs, of a solution."""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import positive, unknown
from qddot.runner.metrics.measure import NEAR, Request, measure, quantity_of
from qddot.runner.solution import Solution


def metric(
    solution: Solution,
    kind: str,
    of: str | None = None,
    *,
    interval: float | None = None,
    after: float | None = None,
    before: float | None = None,
    change: bool = False,
    level: float | None = None,
    band: float | None = None,
    weighting: str | None = None,
    static: float | None = None,
    fraction: float | None = None,
) -> float:
    """A metric of a run by its name, see `qddot list metrics`: "rms" of "heave", in the quantity's unit.

    of: the state, output or input, unless the metric is that of the whole model. interval: between samples, s, taken of
    the method's dense output, see `Solution.at`; not needed where the run's points are evenly spaced. The others are
    the keys of a study's `[metrics]`: after, before (s), change (since the start), and level, band, weighting
    ("Wk", ...), static and fraction of the metrics that take them. NaN where a sample is no finite number.
    Raises ValueError naming what cannot be.
    """
    request = Request(kind, of, after, before, change, level, band, weighting, static, fraction)
    name = quantity_of(kind, request)
    if name not in solution:
        raise ValueError(f"metrics.{kind}.of: {unknown('quantity', name, solution.names)}")
    times = _times(solution, interval)
    samples = _samples(solution, name, times)
    return float(measure(kind, request, (solution.quantity(name),), times)(samples[:, None]))


def _samples(solution: Solution, name: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """The values (n,) of a quantity at times (n,): of saved points where all of these are such."""
    places = np.clip(np.searchsorted(solution.t, times - NEAR * (times[1] - times[0])), 0, len(solution.t) - 1)
    if (np.abs(solution.t[places] - times) <= NEAR * (times[1] - times[0])).all():
        return solution[name][places]
    return solution.at(np.minimum(times, solution.t[-1]))[name]


def _times(solution: Solution, interval: float | None) -> NDArray[np.float64]:
    """Evenly spaced times (n,) of the run, s."""
    start, end = solution.t[0], solution.t[-1]
    if interval is None:
        steps = np.diff(solution.t)
        interval = float((end - start) / max(1, len(steps)))
        if not len(steps) or np.abs(steps - interval).max() > NEAR * interval:
            raise ValueError("interval: missing, and the points of the run are not evenly spaced; give one, in s")
    count = int(np.floor((end - start) / positive("interval", interval) + NEAR)) + 1
    if count < 2:
        raise ValueError(f"interval: {interval:g} s, but the run lasts {end - start:g} s; expected a shorter one")
    return start + interval * np.arange(count)
