"""Jacobians without a band, as of a hull on its wheels: what elimination fills in is found once, the rest left out.

The order is one of minimum degree of the pattern and its transpose, and the pattern of the factors that of SuperLU (X.
S. Li, ACM Trans. Math. Software 31 (2005) 302-325) for a matrix that needs no pivots. Elimination goes row by row (T.
A. Davis, Direct Methods for Sparse Linear Systems, SIAM 2006, chapter 6), and takes the diagonal for its pivots, which
a step that is short enough makes large; that they serve is tried each time, see `factorize_shifted_sparse`.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers
from qddot.runner.matrices import Pattern

Integers = NDArray[np.int64]

#: How far from 1 the solution of a system whose solution is 1 may be.
ACCURATE = 1e-6


@dataclass(frozen=True, eq=False)
class Sparse:
    """Factors by rows. order (n,): where each state comes; begins (n + 1,): where a row's entries begin, and end;
    columns (entries,) of the entries, rising; diagonals (n,): where the entries on the diagonal are."""

    order: Integers
    begins: Integers
    columns: Integers
    diagonals: Integers

    @cached_property
    def multiplications(self) -> int:
        """Of an elimination: each row is taken from all that hold its state."""
        behind = self.begins[1:] - self.diagonals - 1
        return int((behind * behind).sum())

    def places(self, pattern: Pattern) -> Integers:
        """Where the entries of a pattern stand (entries,)."""
        n, rows, columns = len(self.order), self.order[pattern.rows], self.order[pattern.columns]
        own = np.repeat(np.arange(n), np.diff(self.begins)) * n + self.columns
        return np.searchsorted(own, rows * n + columns)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """What a space has of it, by its fields."""
        cells = {name: np.zeros(len(self.columns)) for name in ("jacobian", "factors")}
        own = {"begins": self.begins, "columns": self.columns, "diagonals": self.diagonals}
        return {**cells, **own, "place_of": self.order, "scratch": np.zeros(2 * len(self.order))}


def fewest_multiplications(n: int, rows: Integers, columns: Integers) -> float:
    """Those of an elimination in which nothing fills in and all rows are as long: the least that `Sparse` can have."""
    beside = rows != columns
    first, last = np.minimum(rows, columns)[beside], np.maximum(rows, columns)[beside]
    return len(np.unique(first * n + last)) ** 2 / n


def sparse_of(n: int, rows: Integers, columns: Integers) -> Sparse | None:
    """The factors of a matrix with entries at these places and on the diagonal; None where SuperLU finds no order."""
    from scipy.sparse import coo_array, csr_array, eye_array  # noqa: PLC0415 - of large models alone
    from scipy.sparse.linalg import splu  # noqa: PLC0415

    both = np.concatenate([rows, columns]), np.concatenate([columns, rows])
    beside = -(coo_array((np.ones(2 * len(rows)), both), shape=(n, n)).tocsc() != 0).astype(float)
    dominant = beside + (2.0 * n) * eye_array(n, format="csc")
    found = splu(dominant.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    if not np.array_equal(found.perm_r, found.perm_c):
        return None
    filled = csr_array(abs(found.L) + abs(found.U) + abs(found.L).T + abs(found.U).T)
    filled.sort_indices()
    begins, held = filled.indptr.astype(np.int64), filled.indices.astype(np.int64)
    rows_of = np.repeat(np.arange(n), np.diff(begins))
    return Sparse(found.perm_c.astype(np.int64), begins, held, np.flatnonzero(rows_of == held).astype(np.int64))


@compiled(**LEAN)
def place_in_sparse(space, i, j):
    """Where the entry (i, j) of the Jacobian stands; -1 where it is none."""
    order, columns = integers(space.place_of, space.n), integers(space.columns, space.cells)
    begins, wanted = integers(space.begins, space.n + 1), order[j]
    first, last = begins[order[i]], begins[order[i] + 1] - 1
    while first < last:
        middle = (first + last) // 2
        if columns[middle] < wanted:
            first = middle + 1
        else:
            last = middle
    return first if columns[first] == wanted else -1


@compiled(**LEAN)
def factorize_shifted_sparse(space, a, b):
    """Factorize a - b df/dx; whether that failed: a system whose solution is 1 in all states is solved for a trial."""
    n, jacobian, factors = space.n, floats(space.jacobian, space.cells), floats(space.factors, space.cells)
    begins, diagonals = integers(space.begins, n + 1), integers(space.diagonals, n)
    trial = floats(space.scratch + 8 * n, n)
    for k in range(space.cells):
        factors[k] = -b * jacobian[k]
    for i in range(n):
        factors[diagonals[i]] += a
        total = 0.0
        for k in range(begins[i], begins[i + 1]):
            total += factors[k]
        trial[i] = total
    for i in range(n):
        if not _eliminate_row(space, i):
            return True
    _substitute(space, trial)
    farthest = 0.0
    for i in range(n):
        away = abs(trial[i] - 1.0)
        farthest = away if not away <= farthest else farthest
    return not farthest <= ACCURATE


@compiled(**LEAN)
def _eliminate_row(space, i):
    """Take from a row what the rows before it hold of it; whether its pivot, which becomes a reciprocal, is usable."""
    n, columns, factors = space.n, integers(space.columns, space.cells), floats(space.factors, space.cells)
    begins, diagonals, row = integers(space.begins, n + 1), integers(space.diagonals, n), floats(space.scratch, n)
    for k in range(begins[i], begins[i + 1]):
        row[columns[k]] = factors[k]
    for k in range(begins[i], diagonals[i]):
        s = columns[k]
        share = row[s] * factors[diagonals[s]]
        row[s] = share
        if share != 0.0:
            for m in range(diagonals[s] + 1, begins[s + 1]):
                row[columns[m]] -= share * factors[m]
    for k in range(begins[i], begins[i + 1]):
        factors[k] = row[columns[k]]
    pivot = factors[diagonals[i]]
    factors[diagonals[i]] = 1.0 / pivot
    return 0.0 < abs(pivot) < np.inf


@compiled(**LEAN)
def _substitute(space, x):
    """Overwrite x (n,), in the order of elimination, with the solution of the system last factorized."""
    n, columns, factors = space.n, integers(space.columns, space.cells), floats(space.factors, space.cells)
    begins, diagonals = integers(space.begins, n + 1), integers(space.diagonals, n)
    for i in range(n):
        value = x[i]
        for k in range(begins[i], diagonals[i]):
            value -= factors[k] * x[columns[k]]
        x[i] = value
    for i in range(n - 1, -1, -1):
        value = x[i]
        for k in range(diagonals[i] + 1, begins[i + 1]):
            value -= factors[k] * x[columns[k]]
        x[i] = value * factors[diagonals[i]]


@compiled(**LEAN)
def solve_sparse(space, x):
    """Overwrite x (n,) with the solution of the system last factorized."""
    n, order, scratch = space.n, integers(space.place_of, space.n), floats(space.scratch, space.n)
    for i in range(n):
        scratch[order[i]] = x[i]
    _substitute(space, scratch)
    for i in range(n):
        x[i] = scratch[order[i]]


@compiled(**LEAN)
def multiply_sparse(space, x, product):
    """Product (n,) = df/dx times x (n,)."""
    n, order, scratch = space.n, integers(space.place_of, space.n), floats(space.scratch, space.n)
    columns, jacobian = integers(space.columns, space.cells), floats(space.jacobian, space.cells)
    begins = integers(space.begins, n + 1)
    for i in range(n):
        scratch[order[i]] = x[i]
    for i in range(n):
        total = 0.0
        for k in range(begins[order[i]], begins[order[i] + 1]):
            total += jacobian[k] * scratch[columns[k]]
        product[i] = total
