"""How a run is to be integrated: every option of every family of methods, checked when it is given."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from runner.checks import finite


@dataclass(frozen=True, eq=False)
class Options:
    """Options of an integration; a method reads those of its family.

    step: step size in s, fixed-step methods only (required there).
    output_times: times (n,), rising, at which to save; start and end are always saved.
    every: save every so many grid steps instead (fixed-step methods); None saves about 5000 points.
    progress: called with the fraction done, 0 to 1. time_limit: seconds of wall time.
    divergence_limit: a state of this magnitude counts as diverged, even though still finite.
    rtol, atol: error tolerances of adaptive methods; atol a scalar or one per state (n_states,).
    max_step, first_step: in s. max_steps: accepted steps. refine: points saved per step by dense output.
    events: see `events`. controller: step-size controller of an adaptive method; None takes the method's own.
    max_order, bdf: of the numerical differentiation formulas (ode15s).
    Raises ValueError naming the option, what was found and what was expected.
    """

    step: float | None = None
    output_times: Any = None
    every: int | None = None
    progress: Callable[[float], None] | None = None
    time_limit: float | None = None
    divergence_limit: float = 1e100
    rtol: float = 1e-3
    atol: Any = 1e-6
    max_step: float | None = None
    first_step: float | None = None
    max_steps: int | None = None
    refine: int | None = None
    events: tuple[Any, ...] = ()
    controller: Any = None
    max_order: int = 5
    bdf: bool = False

    def __post_init__(self) -> None:
        """Check each value; arrays become read-only float64."""
        for name in ("step", "time_limit", "divergence_limit", "max_step", "first_step"):
            self._check_positive(name)
        for name in ("every", "max_steps", "refine"):
            self._check_count(name)
        if not 1 <= self.max_order <= 5:
            raise ValueError(f"max_order is {self.max_order!r}, expected an order from 1 to 5")
        if not 0 < finite("rtol", self.rtol) < 1:
            raise ValueError(f"rtol is {self.rtol!r}, expected a number between 0 and 1, such as 1e-6")
        self._freeze("atol", np.asarray(self.atol, dtype=np.float64))
        if not (np.isfinite(self.atol) & (self.atol >= 0)).all() or self.atol.ndim > 1:
            raise ValueError(f"atol is {self.atol!r}, expected a number >= 0 or one for each state")
        if self.output_times is not None:
            self._freeze("output_times", _rising_times(self.output_times))
            if self.every is not None:
                raise ValueError("output_times and every are both given; give the one that says what to save")
        object.__setattr__(self, "events", tuple(self.events))

    def _check_positive(self, name: str) -> None:
        value = getattr(self, name)
        if value is not None and not finite(name, value) > 0:
            raise ValueError(f"{name} is {value!r}, expected a number greater than 0")

    def _check_count(self, name: str) -> None:
        value = getattr(self, name)
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if value is not None and not (whole and value >= 1):
            raise ValueError(f"{name} is {value!r}, expected a whole number, at least 1")

    def _freeze(self, name: str, array: NDArray[np.float64]) -> None:
        array = array.copy()
        array.flags.writeable = False
        object.__setattr__(self, name, array)


def _rising_times(times: ArrayLike) -> NDArray[np.float64]:
    array = np.array(times, dtype=np.float64)
    if array.ndim != 1 or array.size == 0:
        raise ValueError(f"output_times has shape {array.shape}, expected one row of times")
    if not np.isfinite(array).all():
        raise ValueError(f"output_times[{int(np.argmin(np.isfinite(array)))}] is not finite")
    falls = np.flatnonzero(np.diff(array) <= 0)
    if falls.size:
        i = int(falls[0])
        raise ValueError(f"output_times must rise: [{i + 1}] = {array[i + 1]} follows [{i}] = {array[i]}")
    return array
