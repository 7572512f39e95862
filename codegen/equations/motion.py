"""The equations of motion as they are read, M qddot + gyroscopic terms + dPi/dq + dPhi/dqdot + G' lambda = Q, and M."""

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import accumulate
from math import inf
from typing import Any

import symengine as se

from qddot.codegen.calculus import terms
from qddot.codegen.equations.document import MassMatrix
from qddot.codegen.equations.entries import Entry
from qddot.codegen.equations.legible import legible
from qddot.codegen.equations.order import Order
from qddot.codegen.equations.phrases import Formula, Sum
from qddot.codegen.equations.reading import Reader
from qddot.codegen.equations.repeating import Repeating, Rows
from qddot.codegen.lagrange import Equations
from qddot.codegen.rewrite import replaced

#: Entries of M a coordinate, of models whose rows are looked through for what repeats.
_SPARSE = 4


class Motion:
    """What was derived of one model, rearranged to read well; of large models only the first equations.

    entries: of the coordinates. author: reads what is kept as it was written, as generalized forces are. most: terms
    after which no further equation is written. found: of each equation what it is of, and the formula; left_out: how
    many coordinates have none.
    """

    def __init__(
        self,
        equations: Equations,
        entries: tuple[Entry, ...],
        order: Order,
        repeating: Repeating | None,
        author: Reader,
        most: int | None,
    ) -> None:
        self._equations, self._entries, self._author = equations, entries, author
        self._repeating, self._most = repeating, most
        self._derived = Reader(order, turn=True, conditions=equations.conditions, repeating=repeating)
        self._legible = partial(legible, fixed=order.fixed)
        self._mass: dict[tuple[int, int], Any] = {}
        self._columns: list[list[int]] = [[] for _ in equations.coordinates]
        for k, j in equations.mass:
            self._columns[k].append(j)
            if j != k:
                self._columns[j].append(k)
        found = tuple(self._written())
        self.found = tuple((entry, formula) for _, entry, formula in found)
        self.left_out = len(equations.coordinates) - sum(count for count, _, _ in found)

    def mass(self) -> MassMatrix:
        """Its rows, of a multiple of the identity all: of others no more than there would be equations one by one."""
        equations, size = self._equations, len(self._equations.coordinates)
        written = size - self.left_out
        if self._most is not None and len(set(equations.mass.values())) > 1:
            within = sum(total <= self._most for total in accumulate(_lengths(equations)))
            written = min(written, max(1, within))
        found = {at: entry for at, entry in equations.mass.items() if at[0] < written}
        read = {entry: self._derived.sum(self._entry(*at)) for at, entry in found.items()}
        return MassMatrix(written, equations.mass_matrix, {at: read[e] for at, e in found.items()}, size - written)

    def _written(self) -> Iterator[tuple[int, Entry, Formula]]:
        """The equations of motion, up to so many terms; one at least. Of each how many it is, and of what."""
        most = inf if self._most is None else self._most
        lengths = _lengths(self._equations)
        derived = written = 0
        for rows in self._rows():
            for k in rows.rows:
                derived += lengths[k]
                if written and derived > most:
                    return
                equation = self._equation(k, rows.range.standing if rows.range else {})
                before, written = written, written + len(equation.left.terms) + len(equation.right.terms)
                if before and written > most:
                    return
                yield rows.times, rows.entry(self._entries, k), equation

    def _rows(self) -> list[Rows]:
        """The coordinates, those whose equations repeat by the first of them."""
        equations, size = self._equations, len(self._equations.coordinates)
        if self._repeating is None or len(equations.mass) > _SPARSE * size:
            return [Rows((k,)) for k in range(size)]
        parts = (equations.gyroscopic, equations.conservative, equations.dissipative, equations.applied)
        return self._repeating.rows(
            [
                (
                    equations.coordinates[k],
                    *(se.Mul(equations.mass[max(k, j), min(k, j)], equations.accelerations[j]) for j in columns),
                    *(part[k] for part in parts),
                    *equations.constraints.pull(k),
                )
                for k, columns in enumerate(map(sorted, self._columns))
            ]
        )

    def _entry(self, k: int, j: int) -> Any:
        """An entry of M as it is read."""
        at = max(k, j), min(k, j)
        if at not in self._mass:
            self._mass[at] = self._legible(self._equations.mass[at])
        return self._mass[at]

    def _equation(self, k: int, standing: Mapping[Any, Any]) -> Formula:
        """The equation of coordinate k, its terms in the order of Lagrange's equation.

        standing: what stands for symbols in it.
        """
        equations, put = self._equations, partial(replaced, found=standing)
        entries = [(self._entry(k, j), equations.accelerations[j]) for j in sorted(self._columns[k])]
        inertia = [self._derived.term(put(se.Mul(entry, acceleration))) for entry, acceleration in entries]
        others = (equations.gyroscopic[k], equations.conservative[k], equations.dissipative[k])
        sums = [self._derived.sum(self._legible(put(part)), positive_first=False) for part in others]
        held = [
            self._derived.term(part)
            for pull in equations.constraints.pull(k)
            for part in terms(self._legible(put(pull)))
        ]
        left = (*inertia, *(part for found in sums for part in found.terms), *held)
        return Formula(Sum(left), self._author.sum(put(equations.applied[k])))


def _lengths(equations: Equations) -> list[int]:
    """How many terms each equation of motion has as it was derived."""
    lengths = [0] * len(equations.coordinates)
    for k, j in equations.mass:
        lengths[k] += 1
        lengths[j] += k != j
    for part in (equations.gyroscopic, equations.conservative, equations.dissipative, equations.applied):
        for k, expression in enumerate(part):
            lengths[k] += len(terms(expression))
    return lengths
