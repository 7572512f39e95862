"""M x = r solved by an unrolled LDL^T: straight-line assignments, structural zeros left out, never an inverse.

Golub & Van Loan, Matrix Computations, section 4.1; M is positive definite for physics, so there is no pivoting.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import symengine as se

from qddot.codegen.kernel import Assignment
from qddot.codegen.nodes import operands
from qddot.codegen.rewrite import ZERO

#: Gives a fresh symbol for a wished name.
Name = Callable[[str], Any]


@dataclass(frozen=True)
class Factors:
    """M = L D L^T as symbols: lower[(k, j)], k > j, and the reciprocals of D; the assignments that make them."""

    assignments: tuple[Assignment, ...]
    lower: Mapping[tuple[int, int], Any]
    inverse_pivots: tuple[Any, ...]

    @cached_property
    def rows(self) -> dict[int, list[int]]:
        """Coupled row -> columns of its entries in L, rising."""
        rows: dict[int, list[int]] = {index: [] for index in sorted({index for pair in self.lower for index in pair})}
        for k, j in sorted(self.lower):
            rows[k].append(j)
        return rows

    @cached_property
    def columns(self) -> dict[int, list[int]]:
        """Column -> rows of its entries in L, rising."""
        columns: dict[int, list[int]] = {}
        for k, j in sorted(self.lower):
            columns.setdefault(j, []).append(k)
        return columns


def factorize(mass: Mapping[tuple[int, int], Any], n: int, name: Name) -> Factors:
    """Factors of the symmetric matrix with the lower entries `mass`; a row that nothing is coupled to is its pivot."""
    assignments: list[Assignment] = []
    scaled: dict[tuple[int, int], Any] = {}  # L[k, j] * D[j]
    lower: dict[tuple[int, int], Any] = {}
    inverse: list[Any] = []
    assign = _assigner(name, assignments)

    below: dict[int, list[int]] = {}  # column -> rows that hold an entry of M or are filled in
    for k, j in mass:
        if k != j:
            below.setdefault(j, []).append(k)
    for j in range(n):
        known = [i for i in range(j) if (j, i) in lower] if below else []
        pivot = se.Add(mass.get((j, j), se.Integer(0)), *(-lower[j, i] * scaled[j, i] for i in known))
        inverse.append(assign(f"inverse_pivot_{j + 1}", 1 / pivot) if operands(pivot) else 1 / pivot)
        for k in sorted(below.get(j, ())):
            shared = [i for i in known if (k, i) in lower]
            entry = se.Add(mass.get((k, j), se.Integer(0)), *(-lower[j, i] * scaled[k, i] for i in shared))
            scaled[k, j] = assign(f"scaled_{k + 1}_{j + 1}", entry)
            lower[k, j] = assign(f"lower_{k + 1}_{j + 1}", scaled[k, j] * inverse[j])
            for i in below[j]:
                if i > k and i not in below.setdefault(k, []):
                    below[k].append(i)
    return Factors(tuple(assignments), lower, tuple(inverse))


def steps(mass: Iterable[tuple[int, int]], n: int) -> int:
    """How many entries the factors have below the diagonal, and products of two of a column are taken for them."""
    below: list[set[int]] = [set() for _ in range(n)]
    for k, j in mass:
        if k != j:
            below[j].add(k)
    for rows in below:
        if rows:
            below[min(rows)] |= rows - {min(rows)}
    return sum(len(rows) * (len(rows) + 3) // 2 for rows in below)


def solve(
    factors: Factors, right: Mapping[int, Any], name: Name, wishes: Sequence[str] = ()
) -> tuple[list[Assignment], dict[int, Any]]:
    """Assignments, and x as expressions in them, for one right-hand side; zeros are left out of both.

    With `wishes`, each entry of x becomes an assignment of that name.
    """
    assignments: list[Assignment] = []
    assign = _assigner(name, assignments)
    forward = {k: value for k, value in right.items() if value != ZERO}
    for k, columns in factors.rows.items():
        subtracted = [-factors.lower[k, j] * forward[j] for j in columns if j in forward]
        if k in forward or subtracted:
            forward[k] = assign(f"reduced_{k + 1}", se.Add(forward.get(k, se.Integer(0)), *subtracted))
    x: dict[int, Any] = {}
    alone = [k for k in sorted(forward) if k not in factors.rows]
    for k in alone + sorted(factors.rows, reverse=True):
        subtracted = [-factors.lower[j, k] * x[j] for j in factors.columns.get(k, ()) if j in x]
        if k in forward or subtracted:
            value = se.Add(forward.get(k, se.Integer(0)) * factors.inverse_pivots[k], *subtracted)
            used = bool(factors.rows.get(k))
            x[k] = assign(wishes[k] if wishes else f"solved_{k + 1}", value) if wishes or used else value
    return assignments, x


def _assigner(name: Name, assignments: list[Assignment]) -> Callable[[str, Any], Any]:
    """What gives an expression a name by appending an assignment; a symbol or number stays as it is."""

    def assign(wish: str, expression: Any) -> Any:
        if not operands(expression):
            return expression
        symbol = name(wish)
        assignments.append((symbol, expression))
        return symbol

    return assign
