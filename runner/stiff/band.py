"""Jacobians of chains and other long structures as bands, in an order of the states that makes them narrow.

The order is Cuthill and McKee's, reversed, of the pattern that the derivation found. A band has an entry (i, j) of the
matrix at column order[j], as LAPACK's dgbtrf wants it: see `linear_algebra.factorize_band`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.linear_algebra import factorize_band, solve_band
from qddot.runner.machine.memory import LEAN, floats, integers, matrix
from qddot.runner.matrices import Pattern

Integers = NDArray[np.int64]

#: A band is used where its columns, with room for what fills in, are this part of the matrix's, or less.
NARROW = 1 / 3


@dataclass(frozen=True, eq=False)
class Band:
    """order (n,): where each state comes; entries are at most so far below and above the diagonal."""

    order: Integers
    lower: int
    upper: int

    @property
    def width(self) -> int:
        """Numbers of a column, those included that fill in."""
        return 2 * self.lower + self.upper + 1

    @property
    def multiplications(self) -> int:
        """Of an elimination, with rows exchanged."""
        return len(self.order) * self.lower * (self.lower + self.upper)

    def places(self, pattern: Pattern) -> Integers:
        """Where the entries of a pattern stand (entries,)."""
        rows, columns = self.order[pattern.rows], self.order[pattern.columns]
        return columns * self.width + self.lower + self.upper + rows - columns

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What a space has of it, by its fields."""
        n = len(self.order)
        cells = {name: np.zeros(n * self.width) for name in ("jacobian", "factors")}
        return {**cells, "place_of": self.order, "scratch": np.zeros(n)}


def band_of(n: int, rows: Integers, columns: Integers) -> Band | None:
    """The band of entries at these places, in an order that makes it narrow; None where it is wide all the same."""
    order = _narrow_order(n, rows, columns)
    below = order[rows] - order[columns]
    found = Band(order, max(0, int(below.max(initial=0))), max(0, int(-below.min(initial=0))))
    return found if found.width <= NARROW * n else None


def _narrow_order(n: int, rows: Integers, columns: Integers) -> Integers:
    from scipy.sparse import coo_array  # noqa: PLC0415 - of large models alone
    from scipy.sparse.csgraph import reverse_cuthill_mckee  # noqa: PLC0415

    both = np.concatenate([rows, columns]), np.concatenate([columns, rows])
    states = reverse_cuthill_mckee(coo_array((np.ones(2 * len(rows)), both), shape=(n, n)).tocsr(), symmetric_mode=True)
    order = np.empty(n, dtype=np.int64)
    order[states] = np.arange(n)
    return order


@compiled(**LEAN)
def place_in_band(space, i, j):
    """Where the entry (i, j) of the Jacobian stands; -1 where it is none of the band."""
    order = integers(space.place_of, space.n)
    below = order[i] - order[j]
    if below > space.lower or -below > space.upper:
        return -1
    return order[j] * (space.cells // space.n) + space.lower + space.upper + below


@compiled(**LEAN)
def factorize_shifted_band(space, a, b):
    """Factorize a - b df/dx; whether that failed."""
    n, diagonal, width = space.n, space.lower + space.upper, space.cells // space.n
    jacobian, factors = floats(space.jacobian, space.cells), floats(space.factors, space.cells)
    for k in range(space.cells):
        factors[k] = -b * jacobian[k]
    for j in range(n):
        factors[j * width + diagonal] += a
    band = matrix(space.factors, n, width)
    return factorize_band(space, band, space.lower, space.upper, integers(space.pivots, n)) >= 0


@compiled(**LEAN)
def solve_in_band(space, x):
    """Overwrite x (n,) with the solution of the system last factorized."""
    n, order, scratch = space.n, integers(space.place_of, space.n), floats(space.scratch, space.n)
    for i in range(n):
        scratch[order[i]] = x[i]
    band = matrix(space.factors, n, space.cells // n)
    solve_band(space, band, space.lower, space.upper, integers(space.pivots, n), scratch)
    for i in range(n):
        x[i] = scratch[order[i]]


@compiled(**LEAN)
def multiply_band(space, x, product):
    """Product (n,) = df/dx times x (n,)."""
    n, order, scratch = space.n, integers(space.place_of, space.n), floats(space.scratch, space.n)
    band, diagonal = matrix(space.jacobian, n, space.cells // n), space.lower + space.upper
    for i in range(n):
        scratch[i] = 0.0
    for j in range(n):
        column = order[j]
        for i in range(max(0, column - space.upper), min(n, column + space.lower + 1)):
            scratch[i] += band[column, diagonal + i - column] * x[j]
    for i in range(n):
        product[i] = scratch[order[i]]
