"""What a metric is: what computes it, and what it takes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class MetricKind:
    """A metric by its name: what computes it, the keys it takes beside kind, of, after, before, change and better.

    unit: with {} for the unit of the quantity. required: keys without which it means nothing. of: the quantity it is
    always computed of.
    """

    name: str
    function: Callable[..., Any]
    unit: str = "{}"
    takes: tuple[str, ...] = ()
    required: tuple[str, ...] = ()
    of: str | None = None

    @property
    def meaning(self) -> str:
        """What it is, from the function's documentation."""
        return (self.function.__doc__ or "").split("\n")[0].rstrip(".")


def metric(
    name: str, unit: str = "{}", takes: tuple[str, ...] = (), required: tuple[str, ...] = ()
) -> Callable[[Callable[..., Any]], MetricKind]:
    """Make a metric of a function `(samples, first, stop, t0, h, p) -> number`, see `values`."""
    return lambda function: MetricKind(name, function, unit, takes, required)
