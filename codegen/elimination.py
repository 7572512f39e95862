"""M x = r solved by an unrolled LDL^T: straight-line assignments, structural zeros left out, never an inverse.

Golub & Van Loan, Matrix Computations, section 4.1; M is positive definite for physics, so there is no pivoting, and the
rows may be taken in any order.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import symengine as se

from qddot.codegen.kernel import Assignment
from qddot.codegen.nodes import operands
from qddot.codegen.ordering import Ordering
from qddot.codegen.rewrite import ZERO

#: Gives a fresh symbol for a wished name.
Name = Callable[[str], Any]


@dataclass(frozen=True)
class Factors:
    """M = L D L^T as symbols: lower[(k, j)], j before k in the order, and reciprocals of D; what makes them."""

    assignments: tuple[Assignment, ...]
    lower: Mapping[tuple[int, int], Any]
    inverse_pivots: tuple[Any, ...]
    ordering: Ordering

    @cached_property
    def rows(self) -> dict[int, list[int]]:
        """Coupled row -> columns of its entries in L; rows and columns in the order."""
        coupled = {index for pair in self.lower for index in pair}
        rows: dict[int, list[int]] = {index: [] for index in self.ordering.order if index in coupled}
        for j, rest in self.columns.items():
            for k in rest:
                rows[k].append(j)
        return rows

    @cached_property
    def columns(self) -> dict[int, list[int]]:
        """Column -> rows of its entries in L; both in the order."""
        order, behind = self.ordering.order, self.ordering.rows
        return {j: [order[place] for place in rest] for j, rest in zip(order, behind, strict=True) if rest}


def factorize(mass: Mapping[tuple[int, int], Any], ordering: Ordering, name: Name) -> Factors:
    """Factors of the symmetric matrix with the lower entries `mass`; a row that nothing is coupled to is its pivot."""
    order = ordering.order
    assignments: list[Assignment] = []
    scaled: dict[tuple[int, int], Any] = {}  # L[k, j] * D[j]
    lower: dict[tuple[int, int], Any] = {}
    inverse: dict[int, Any] = {}
    before: dict[int, list[int]] = {}  # row -> columns of its entries in L that are known
    assign = _assigner(name, assignments)

    for j, behind in zip(order, ordering.rows, strict=True):
        known = before.get(j, [])
        pivot = se.Add(mass.get((j, j), se.Integer(0)), *(-lower[j, i] * scaled[j, i] for i in known))
        inverse[j] = assign(f"inverse_pivot_{j + 1}", 1 / pivot) if operands(pivot) else 1 / pivot
        for k in (order[place] for place in behind):
            shared = [i for i in known if (k, i) in lower]
            given = mass.get((max(j, k), min(j, k)), se.Integer(0))
            entry = se.Add(given, *(-lower[j, i] * scaled[k, i] for i in shared))
            scaled[k, j] = assign(f"scaled_{k + 1}_{j + 1}", entry)
            lower[k, j] = assign(f"lower_{k + 1}_{j + 1}", scaled[k, j] * inverse[j])
            before.setdefault(k, []).append(j)
    return Factors(tuple(assignments), lower, tuple(inverse[k] for k in range(len(order))), ordering)


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
    for k in (*alone, *reversed(factors.rows)):
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
