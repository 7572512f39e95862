"""The first cell of a loop in what stands for the symbols of each, and what that is called."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median_low
from typing import Any

from qddot.codegen.cells import Signatures
from qddot.codegen.kernel import Assignment
from qddot.codegen.nodes import operands
from qddot.codegen.ranges import kind
from qddot.codegen.rewrite import Names, holds_call, rebuild

_NUMBER = re.compile("([0-9]+)")


@dataclass(frozen=True)
class Moving:
    """Cells that are alike. columns: symbol of the first -> those of all. fixed: symbols that are the same in all."""

    count: int
    columns: Mapping[Any, tuple[Any, ...]]
    fixed: frozenset[Any]


class Cell:
    """Expressions of the first cell in what stands for its symbols. definitions: of temporaries.

    temporaries: those that the expressions need. named: of these what became of a temporary -> that one. apart: those
    that are the same in all cells, and take long.
    """

    def __init__(
        self,
        counter: str,
        signatures: Signatures,
        definitions: Mapping[Any, Any],
        names: Names,
    ) -> None:
        self.temporaries: list[Assignment] = []
        self.named: dict[Any, Any] = {}
        self.apart: set[Any] = set()
        self._standing: dict[Any, Any] = {}
        self._known: dict[Any, Any] = {}
        self._moving: dict[Any, bool] = {}
        self._counter, self._signatures, self._definitions, self._names = counter, signatures, definitions, names

    def stand(self, standing: Mapping[Any, Any]) -> None:
        """Let symbols, which no expression has held so far, be known by what stands for them."""
        self._standing |= standing
        self._known |= standing
        self._moving |= dict.fromkeys(standing, True)

    def columns(self, found: Mapping[Any, Any]) -> dict[Any, Any]:
        """What is known of symbols by what stands for them."""
        return {self._standing[symbol]: column for symbol, column in found.items()}

    def __call__(self, node: Any) -> Any:
        """An expression in what stands for its symbols."""
        found = self._known.get(node)
        if found is None:
            found = self._known[node] = self._moved(node) if self._moves(node) else self._fixed(node)
        return found

    def _moves(self, node: Any) -> bool:
        """Whether an expression is another one in each cell."""
        found = self._moving.get(node)
        if found is None:
            parts = (self._definitions[node],) if node in self._definitions else operands(node)
            found = self._moving[node] = not self._signatures.is_long(node) and any(map(self._moves, parts))
        return found

    def _moved(self, node: Any) -> Any:
        if node not in self._definitions:
            return rebuild(node, list(map(self, operands(node))))
        value = self(self._definitions[node])
        found = self._names.fresh(f"{kind(str(node)).strip('_')}_{self._counter}")
        self.temporaries.append((found, value))
        self.named[found] = node
        return found

    def _fixed(self, node: Any) -> Any:
        """What is the same in all cells is computed before them where it takes long."""
        if not operands(node) or not (holds_call(node) or self._signatures.is_long(node)):
            return node
        found = self._names.fresh("tmp_")
        self.temporaries.append((found, node))
        self.apart.add(found)
        return found


@dataclass(eq=False)
class Cells:
    """A loop as it grows; columns and fixed as of `Moving`."""

    cell: Cell
    counter: str
    count: int
    stage: int | None
    columns: dict[Any, tuple[Any, ...]] = field(default_factory=dict)
    fixed: set[Any] = field(default_factory=set)

    def takes(self, stage: int | None, moving: Moving) -> bool:
        """Whether other rows are of the same cells, and can be done together with these."""
        same = stage is not None and stage == self.stage and moving.count == self.count
        apart = self.fixed.isdisjoint(moving.columns) and moving.fixed.isdisjoint(self.columns)
        return (
            same and apart and all(self.columns.get(each, column) == column for each, column in moving.columns.items())
        )

    def join(self, moving: Moving, names: Names) -> None:
        """Know the symbols of other rows."""
        new = {symbol: column for symbol, column in moving.columns.items() if symbol not in self.columns}
        self.cell.stand(dict(zip(new, _names_of(new, self.counter, names), strict=True)))
        self.columns |= new
        self.fixed |= moving.fixed


def _names_of(columns: Mapping[Any, tuple[Any, ...]], counter: str, names: Names) -> list[Any]:
    """What stands for symbols in the cells of a loop: q_i_plus_1 for q_3, q_4, ... where most in the first is q_2."""
    split = [(_NUMBER.split(str(first)), _NUMBER.split(str(second))) for first, second, *_ in columns.values()]
    counting = [_counting(*pair) for pair in split]
    numbers = [int(one[k]) for (one, _), found in zip(split, counting, strict=True) for k in found]
    here = median_low(numbers or [0])
    return [names.fresh(_wish(one, found, counter, here)) for (one, _), found in zip(split, counting, strict=True)]


def _counting(one: list[str], other: list[str]) -> list[int]:
    """Which parts of a name are other numbers in another name."""
    return [k for k in range(1, len(one), 2) if one[k] != other[k]] if len(one) == len(other) else []


def _wish(parts: list[str], counting: Sequence[int], counter: str, here: int) -> str:
    for k in counting:
        ahead = int(parts[k]) - here
        parts[k] = counter if not ahead else f"{counter}_{'plus' if ahead > 0 else 'minus'}_{abs(ahead)}"
    return "".join(parts) if counting else f"{''.join(parts)}_{counter}"
