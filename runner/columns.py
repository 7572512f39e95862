"""Quantities by name: what a whole run and some moments of it have in common."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import unknown
from qddot.runner.tables import Quantity


class Columns:
    """values (..., n_quantities), one column for each of `quantities`; `columns["q_6"]` is one, (...)."""

    t: NDArray[np.float64]
    values: NDArray[np.float64]
    quantities: tuple[Quantity, ...]

    @cached_property
    def _columns(self) -> dict[str, int]:
        return {quantity.name: i for i, quantity in enumerate(self.quantities)}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the states, outputs and inputs."""
        return tuple(self._columns)

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """The column (...) of this name; KeyError with the nearest name where there is none."""
        if name in ("t", "time"):
            return self.t
        return self.values[..., self._place(name)]

    def __contains__(self, name: object) -> bool:
        """Whether a quantity has this name."""
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self._columns)

    def quantity(self, name: str) -> Quantity:
        """Name, unit and meaning; KeyError with the nearest name where there is none."""
        return self.quantities[self._place(name)]

    def _place(self, name: str) -> int:
        if name not in self._columns:
            raise KeyError(unknown("quantity", name, self._columns))
        return self._columns[name]


@dataclass(frozen=True, eq=False)
class Moments(Columns):
    """What a run is at some times t, s, of any shape: values (*t.shape, n_quantities), one column for each quantity."""

    t: NDArray[np.float64]
    values: NDArray[np.float64]
    quantities: tuple[Quantity, ...]


@dataclass(frozen=True)
class Extremes:
    """The least and the greatest value of a quantity, in its unit, and when it has them, s; NaN where it has none."""

    least: float
    least_at: float
    greatest: float
    greatest_at: float


class Between(Protocol):
    """What a run is between its saved points."""

    def values_at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """All quantities (m, n_quantities) at times (m,), s."""

    def better(self, best: NDArray[np.float64], start: float, end: float) -> None:
        """Better extremes (n_quantities, 4), least value and its time, greatest and its time, between two times."""
