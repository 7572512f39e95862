"""All metrics by name: what `values` and `weighting` define."""

from functools import cache
from typing import Any

from numba import types

from qddot.runner import abi
from qddot.runner.machine.compiled import compiled
from qddot.runner.metrics import values, weighting
from qddot.runner.metrics.kind import MetricKind

#: value(samples (n,), first, stop, t0, h, p): see `values`.
SIGNATURE = types.float64(abi.VECTOR, types.int64, types.int64, abi.SCALAR, abi.SCALAR, abi.VECTOR)

METRICS = {
    each.name: each for file in (values, weighting) for each in vars(file).values() if isinstance(each, MetricKind)
}


@cache
def compiled_metric(name: str) -> Any:
    """The compiled function of a metric; releases the interpreter's lock."""
    return compiled(SIGNATURE, nogil=True)(METRICS[name].function)
