"""The options of `Options` as keywords of the calls that take them, for editors and type checkers.

A test holds them to the table of options, `options.TABLE`.
"""

from collections.abc import Callable, Iterable
from typing import Any, TypedDict

from numpy.typing import ArrayLike


class StepKeywords(TypedDict, total=False):
    """Options that have to do with steps and tolerances: those of one run and of many."""

    rtol: ArrayLike | None
    atol: ArrayLike | None
    max_step: float | None
    first_step: float | None
    max_steps: int | None
    divergence_limit: float | None


class OptionKeywords(StepKeywords, total=False):
    """Options of one run beside `step`, which stands by itself; see `Options`."""

    output_times: ArrayLike | None
    every: int | None
    progress: Callable[[float], None] | None
    time_limit: float | None
    refine: int | None
    events: Iterable[Any] | None
    controller: str | None
    switching: str | None
    max_order: int | None
    bdf: bool | None


class BatchKeywords(StepKeywords, total=False):
    """Options of many runs by one call."""

    step: float | None
