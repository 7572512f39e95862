"""Matrices that kernels write as a run of values, and the way of these to their places in dense storage."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where the entries of a matrix of this shape stand: rows and columns (entries,), row by row.

    symmetric: the entries are those of the lower triangle.
    """

    shape: tuple[int, int]
    rows: Integers
    columns: Integers
    symmetric: bool = False

    @property
    def entries(self) -> int:
        """How many there are."""
        return len(self.rows)

    def places(self, width: int | None = None) -> Integers:
        """Where they stand (entries,) in a matrix stored row by row, its rows `width` long or as its own."""
        return self.rows * (self.shape[1] if width is None else width) + self.columns

    def dense(self, values: Floats) -> Floats:
        """The matrices (..., *shape) with these entries (..., entries)."""
        matrix = np.zeros((*values.shape[:-1], *self.shape))
        matrix[..., self.rows, self.columns] = values
        if self.symmetric:
            matrix[..., self.columns, self.rows] = values
        return matrix


def pattern(rows: Any, shape: tuple[int, int], *, symmetric: bool = False) -> Pattern:
    """The pattern that a module declares, of each row the columns of its entries; ValueError where it is none."""
    if not isinstance(rows, tuple) or len(rows) != shape[0]:
        found = f"{len(rows)} rows" if isinstance(rows, tuple) else repr(rows)
        raise ValueError(f"is {found}, expected the columns of each of {shape[0]} rows")
    for i, columns in enumerate(rows):
        end = i + 1 if symmetric else shape[1]
        numbers = isinstance(columns, tuple) and all(type(column) is int for column in columns)
        if not numbers or list(columns) != sorted(set(columns)) or not all(0 <= column < end for column in columns):
            raise ValueError(f"[{i}] is {columns!r}, expected rising columns from 0 to {end - 1}")
    return Pattern(
        shape,
        np.repeat(np.arange(shape[0]), [len(columns) for columns in rows]),
        np.array([column for columns in rows for column in columns], dtype=np.int64),
        symmetric,
    )


@dataclass(frozen=True, eq=False)
class PlacedKernel:
    """A kernel(t, x, u, c, values) that writes the entries of a matrix, and where they stand."""

    kernel: Any
    pattern: Pattern

    def __call__(self, t: float, x: Floats, u: Floats, c: Floats) -> Floats:
        """The matrix (*shape) at a point."""
        values = np.empty(self.pattern.entries)
        self.kernel(t, x, u, c, values)
        return self.pattern.dense(values)


@compiled(**LEAN)
def scatter(values, places, entries, target, size):
    """Write the `size` numbers at `target`: the values at their places, zeros elsewhere; all four are addresses."""
    source, where, matrix = floats(values, entries), integers(places, entries), floats(target, size)
    for i in range(size):
        matrix[i] = 0.0
    for k in range(entries):
        matrix[where[k]] = source[k]
