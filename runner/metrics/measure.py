"""Computing the metrics of a study from a block of samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import unknown
from qddot.runner.metrics.table import METRICS, compiled_metric
from qddot.runner.metrics.weighting import TOLERANCE, digital, error, slowest
from qddot.runner.tables import Quantity

#: Units in which a vibration is weighted.
ACCELERATIONS = ("m/s^2", "rad/s^2")
#: A time this close to a sample, in intervals, is that sample's.
NEAR = 1e-6


@dataclass(frozen=True)
class Request:
    """A metric as a study asks for it, in the model's units; see `runner.study.batch_schema.MetricTable`."""

    kind: str
    of: str | None = None
    after: float | None = None
    before: float | None = None
    change: bool = False
    level: float | None = None
    band: float | None = None
    weighting: str | None = None
    static: float | None = None
    fraction: float | None = None


@dataclass(frozen=True, eq=False)
class Measure:
    """A metric ready to be computed: of a column of the samples, first <= i < stop, with the metric's numbers p.

    static: p[0] is the value at the start of the run. meaning: for the results.
    """

    name: str
    kind: str
    column: int
    first: int
    stop: int
    t0: float
    interval: float
    change: bool
    static: bool
    p: NDArray[np.float64]
    unit: str
    meaning: str

    def __call__(self, samples: NDArray[np.float64]) -> float:
        """The metric of one run, of its samples (n, n_quantities); NaN where one in its window is no finite number."""
        values = np.ascontiguousarray(samples[:, self.column])
        if self.change:
            values = values - values[0]
        p = np.concatenate([values[:1], self.p]) if self.static else self.p
        if not (np.isfinite(values[self.first : self.stop]).all() and np.isfinite(p).all()):
            return float("nan")
        return compiled_metric(self.kind)(values, self.first, self.stop, self.t0, self.interval, p)


def quantity_of(name: str, request: Request) -> str:
    """The quantity that a metric is computed of. Raises ValueError that begins with the key it is about."""
    if request.kind not in METRICS:
        raise ValueError(f"metrics.{name}.kind: {unknown('metric', request.kind, METRICS)}")
    fixed = METRICS[request.kind].of
    if fixed is None and request.of is None:
        raise ValueError(f"metrics.{name}.of: missing; the state, output or input that {request.kind} is computed of")
    if fixed is not None and request.of is not None:
        raise ValueError(f"metrics.{name}.of: {request.kind} is that of the whole model; leave it out")
    return fixed or request.of or ""


def measure(name: str, request: Request, quantities: Sequence[Quantity], times: NDArray[np.float64]) -> Measure:
    """The measure of a request, for samples at uniform times (n,) of these quantities.

    Raises ValueError that begins with the key it is about, "metrics.hull.level: ".
    """
    of = quantity_of(name, request)
    column = [quantity.name for quantity in quantities].index(of)
    quantity, kind = quantities[column], METRICS[request.kind]
    _check_keys(name, request)
    interval = float(times[1] - times[0])
    first, stop = _window(name, request, times, interval)
    p, static = _numbers(name, request, quantity, interval)
    own = quantity.unit or "1"
    unit = "m s^-1.75" if (request.kind, own) == ("vdv", "m/s^2") else kind.unit.format(own)
    return Measure(
        name=name,
        kind=request.kind,
        column=column,
        first=first,
        stop=stop,
        t0=float(times[0]),
        interval=interval,
        change=request.change,
        static=static,
        p=p,
        unit="" if unit == "1" else unit,
        meaning=_meaning(request, quantity, interval),
    )


def _check_keys(name: str, request: Request) -> None:
    kind = METRICS[request.kind]
    for key in ("level", "band", "weighting", "static", "fraction"):
        given = getattr(request, key) is not None
        if given and key not in kind.takes:
            raise ValueError(f"metrics.{name}.{key}: {request.kind} takes none; {_takes(request.kind)}")
        if not given and key in kind.required:
            raise ValueError(f"metrics.{name}: {request.kind} needs {key}")
    if request.band is not None and request.band <= 0:
        raise ValueError(f"metrics.{name}.band: {request.band:g}; expected a number greater than 0")
    if request.fraction is not None and not 0 <= request.fraction < 1:
        raise ValueError(f"metrics.{name}.fraction: {request.fraction:g}; expected a part of the static load, 0 to 1")


def _takes(kind: str) -> str:
    own = METRICS[kind].takes
    return f"it takes {', '.join(own)}" if own else "it has no numbers of its own"


def _window(name: str, request: Request, times: NDArray[np.float64], interval: float) -> tuple[int, int]:
    start, end = float(times[0]), float(times[-1])
    after = start if request.after is None else request.after
    before = end if request.before is None else request.before
    for key, time in (("after", after), ("before", before)):
        if not start - NEAR * interval <= time <= end + NEAR * interval:
            raise ValueError(f"metrics.{name}.{key}: {time:g} s is outside the run, from {start:g} to {end:g} s")
    first = int(np.ceil((after - start) / interval - NEAR))
    stop = int(np.floor((before - start) / interval + NEAR)) + 1
    if stop - first < 2:
        raise ValueError(
            f"metrics.{name}: from {after:g} to {before:g} s there are {max(0, stop - first)} samples, {interval:g} s "
            "apart; expected two or more"
        )
    return first, stop


def _numbers(name: str, request: Request, quantity: Quantity, interval: float) -> tuple[NDArray[np.float64], bool]:
    """The metric's own numbers p, and whether the value at the start goes before them."""
    if request.weighting is not None:
        if quantity.unit not in ACCELERATIONS:
            raise ValueError(
                f"metrics.{name}.of: {quantity.name} is in {quantity.unit or 'no unit'}; weightings are of "
                f"accelerations, in {' or '.join(ACCELERATIONS)}"
            )
        if error(request.weighting, interval) > TOLERANCE:
            raise ValueError(
                f"metrics.{name}.weighting: samples {interval:g} s apart are too few for {request.weighting}; set "
                f"outputs.interval to {slowest(request.weighting):g} s or less"
            )
        return digital(interval=interval, weighting=request.weighting).ravel(), False
    takes = METRICS[request.kind].takes
    if "static" in takes:
        fraction = [request.fraction or 0.0] if "fraction" in takes else []
        given = [] if request.static is None else [request.static]
        return np.array([*given, *fraction]), request.static is None
    own: Mapping[str, float | None] = {"level": request.level, "band": request.band}
    return np.array([value for value in own.values() if value is not None], dtype=np.float64), False


def _meaning(request: Request, quantity: Quantity, interval: float) -> str:
    words = f"{METRICS[request.kind].meaning}: {quantity.meaning or quantity.name}"
    if request.change:
        words += ", change since the start"
    if request.after is not None or request.before is not None:
        words += "".join(
            f", {word} {time:g} s"
            for word, time in (("from", request.after), ("to", request.before))
            if time is not None
        )
    if request.weighting is not None:
        words += f", weighting {request.weighting} (error of the gain up to {error(request.weighting, interval):.1%})"
    return words
