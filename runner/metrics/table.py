"""All metrics by name: a new one is a function in `values` or `weighting` and its line here."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from numba import types

from qddot.runner import abi
from qddot.runner.machine.compiled import compiled
from qddot.runner.metrics import values, weighting

#: value(samples (n,), first, stop, t0, h, p): see `values`.
SIGNATURE = types.float64(abi.VECTOR, types.int64, types.int64, abi.SCALAR, abi.SCALAR, abi.VECTOR)


@dataclass(frozen=True)
class MetricKind:
    """A metric: what computes it, the keys it takes beside kind, of, after, before, change and better, and its unit.

    unit: with {} for the unit of the quantity. required: keys without which it means nothing. of: the quantity it is
    always computed of.
    """

    function: Callable[..., Any]
    unit: str = "{}"
    takes: tuple[str, ...] = ()
    required: tuple[str, ...] = ()
    of: str | None = None

    @property
    def meaning(self) -> str:
        """What it is, from the function's documentation."""
        return (self.function.__doc__ or "").split("\n")[0].rstrip(".")


METRICS = {
    "max": MetricKind(values.maximum),
    "min": MetricKind(values.minimum),
    "max_abs": MetricKind(values.largest_magnitude),
    "peak_to_peak": MetricKind(values.peak_to_peak),
    "time_of_max": MetricKind(values.time_of_maximum, "s"),
    "time_of_min": MetricKind(values.time_of_minimum, "s"),
    "start": MetricKind(values.start),
    "final": MetricKind(values.final),
    "mean": MetricKind(values.mean),
    "rms": MetricKind(values.root_mean_square),
    "integral": MetricKind(values.integral, "{} s"),
    "settling_time": MetricKind(values.settling_time, "s", ("band",), ("band",)),
    "crossings": MetricKind(values.crossings, "", ("level",), ("level",)),
    "time_below": MetricKind(values.time_below, "s", ("level",), ("level",)),
    "time_above": MetricKind(values.time_above, "s", ("level",), ("level",)),
    "weighted_rms": MetricKind(weighting.weighted_rms, "{}", ("weighting",), ("weighting",)),
    "vdv": MetricKind(weighting.vibration_dose, "({}) s^0.25", ("weighting",), ("weighting",)),
    "energy_dissipated": MetricKind(values.integral, "J", of="dissipated_power"),
    "dynamic_load": MetricKind(values.dynamic_load, "{}", ("static",)),
    "dynamic_load_coefficient": MetricKind(values.dynamic_load_coefficient, "", ("static",)),
    "lift_off_time": MetricKind(values.lift_off_time, "s", ("static", "fraction")),
}


@cache
def compiled_metric(name: str) -> Any:
    """The compiled function of a metric; releases the interpreter's lock."""
    return compiled(SIGNATURE, nogil=True)(METRICS[name].function)
