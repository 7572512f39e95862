"""Rows of a draft that are alike as one: the first of them, in symbols that stand for those of each cell in turn.

What is left has a row for each kind of cell, however many cells there are, and goes through the same rules as every
draft; only constants, series and the text have to know how often it stands there.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, groupby
from types import MappingProxyType
from typing import Any

import symengine as se

from qddot.codegen.cell import Cell, names_of
from qddot.codegen.cells import INDEX, LEAST, Place, Run, Signature, Signatures, in_order, runs
from qddot.codegen.kernel import Assignment, Loop, Slot
from qddot.codegen.neighbours import kept
from qddot.codegen.nodes import operands
from qddot.codegen.rewrite import Names, is_call
from qddot.codegen.signs import with_signs

Write = tuple[Slot, Any]
#: What counts the cells of a loop is called so where that is free.
_COUNTERS = "ijkmnpqrs"
#: So many times as many functions may be called where neighbours do not share what they give.
_MORE = 1.05


@dataclass(frozen=True)
class Folded:
    """A draft with loops. named: temporaries that stay, in loops as the author named them, or computed before these.

    kept: symbols of what neighbours share -> the items of arrays that it is kept in.
    """

    temporaries: tuple[Assignment, ...]
    writes: tuple[Write, ...]
    loops: tuple[Loop, ...] = ()
    named: frozenset[Any] = frozenset()
    kept: Mapping[Any, Slot] = field(default_factory=dict)


def fold(
    temporaries: Sequence[Assignment],
    writes: Sequence[Write],
    places: Mapping[Any, Place],
    names: Names,
    author: frozenset[Any] = frozenset(),
    *,
    copies: bool = True,
) -> Folded:
    """A draft with what repeats in it written once, the draft itself where nothing does.

    places: of the symbols that it reads. names: those of loops come from here. author: quantities that have names.
    copies: whether rows that only copy a symbol, or a number, are enough.
    """
    before, after, given = list(temporaries), list(writes), names.copy()
    found = _Folding(dict(before), places, given.copy(), author)
    found.fold(after)
    if len(found.signatures.signs) > 1:
        before, after = with_signs(before, after, found.signatures, given)
        found = _Folding(dict(before), places, given.copy(), author)
        found.fold(after)
    most = _MORE * found.called(after) if found.calls else 0
    if found.calls > most:
        shared = kept(before, after, found.signatures, given)
        before, after = shared.written(before, after)
        found = _Folding(dict(before), {**places, **shared.places}, given, author, shared.items)
        found.fold(after)
    if not found.loops or not (copies or found.computes) or found.calls > most:
        return Folded(tuple(temporaries), tuple(writes))
    names.join(found.names)
    return found.result()


def _row_of(slot: Slot) -> tuple[Any, ...]:
    """What writes have in common that belong together: the row of a matrix, or the item itself."""
    return slot.argument, slot.index[0] if len(slot.index) > 1 else slot.index, slot.adds


def _opened(writes: Iterable[Write], folding: "_Folding") -> Iterator[Write]:
    """The writes, those of long sums that repeat term by term, what is alike in order."""
    for slot, expression in writes:
        terms = folding.terms(expression) if len(slot.index) == 1 else ()
        ordered = in_order(terms, folding.signatures) if terms else []
        if any(runs(list(map(folding.signatures, ordered)), 1)):
            yield from ((replace(slot, adds=True), term) for term in ordered)
        else:
            yield slot, expression


class _Folding:
    """What becomes of one draft. definitions: its temporaries, in order."""

    def __init__(
        self,
        definitions: Mapping[Any, Any],
        places: Mapping[Any, Place],
        names: Names,
        author: frozenset[Any],
        kept: Mapping[Any, Slot] = MappingProxyType({}),
    ) -> None:
        self.definitions, self.names, self.author, self._kept = definitions, names, author, kept
        self.signatures = Signatures(places, definitions)
        self.temporaries: list[Assignment] = []
        self.writes: list[Write] = []
        self.loops: list[Loop] = []
        self.named, self.apart = set[Any](), set[Any]()
        self._places = places
        self._symbols = {place: symbol for symbol, place in places.items()}

    @property
    def computes(self) -> bool:
        """Whether there is arithmetic in a loop, and not symbols that are copied alone."""
        return bool(self.temporaries) or any(slot.loop is not None and operands(value) for slot, value in self.writes)

    @property
    def calls(self) -> int:
        """How many functions are called, those of loops for each cell."""
        parts = {None: 1} | {k: loop.count for k, loop in enumerate(self.loops)}
        return sum(
            count * self.called([write for write in self.writes if write[0].loop == k]) for k, count in parts.items()
        )

    def called(self, writes: Iterable[Write]) -> int:
        """How many functions are called by writes, each once, that take longer than arithmetic."""
        definitions = {**self.definitions, **dict(self.temporaries)}
        waiting, met = [value for _, value in writes], set[Any]()
        while waiting:
            node = waiting.pop()
            if node not in met and node not in self.apart:
                met.add(node)
                waiting += (definitions[node],) if node in definitions else operands(node)
        return sum(map(is_call, met))

    def terms(self, expression: Any) -> tuple[Any, ...]:
        """The terms of a long sum, or of one with a factor; none of all else."""
        while expression in self.definitions:
            expression = self.definitions[expression]
        parts = operands(expression)
        if isinstance(expression, se.Mul):
            long = [part for part in parts if isinstance(part, se.Add) and len(operands(part)) >= LEAST]
            if len(long) == 1:
                rest = se.Mul(*(part for part in parts if part is not long[0]))
                return tuple(rest * term for term in operands(long[0]))
        return parts if isinstance(expression, se.Add) and len(parts) >= LEAST else ()

    def fold(self, writes: Iterable[Write]) -> None:
        """Write what is written, what repeats once."""
        rows = [list(row) for _, row in groupby(_opened(writes, self), key=lambda write: _row_of(write[0]))]
        self._write([*chain.from_iterable([[write] for write in row] if row[0][0].adds else [row] for row in rows)])

    def result(self) -> Folded:
        """What has become of the draft."""
        temporaries = (*self.definitions.items(), *self.temporaries)
        staying = frozenset(self.named | self.apart)
        return Folded(temporaries, tuple(self.writes), tuple(self.loops), staying, self._kept)

    def _write(self, rows: Sequence[Sequence[Write]]) -> None:
        signed = [self.signatures.row(row[0][0].argument, [(slot.index, e) for slot, e in row]) for row in rows]
        at = 0
        for run in runs(signed):
            begun, columns = self._begun(run, signed)
            if columns is not None:
                self._plain(rows[at : begun.first])
                self._loop(begun, columns, rows, signed)
                at = run.behind
        self._plain(rows[at:])

    def _begun(self, run: Run, signed: Sequence[Signature]) -> tuple[Run, dict[Any, tuple[Any, ...]] | None]:
        """A run from the first cell on that is as the others, and of each symbol that moves those of all cells.

        In a cell one symbol may stand where there are two in the others. None where there is no such cell.
        """
        while run.count >= LEAST:
            if (moving := self._moving(run, signed)) is not None:
                found = sorted((symbol for symbol, step in moving.items() if step), key=self._places.__getitem__)
                return run, {symbol: self._column(symbol, moving[symbol], run.count) for symbol in found}
            run = replace(run, first=run.first + run.period, count=run.count - 1)
        return run, None

    def _moving(self, run: Run, signed: Sequence[Signature]) -> dict[Any, int] | None:
        """How far each symbol of the first cell goes to the next; None where one goes several ways."""
        moving: dict[Any, int] = {}
        for signature, steps in zip(signed[run.first : run.first + run.period], run.steps, strict=True):
            for place, step in zip(self.signatures.places(signature), steps, strict=True):
                symbol = self._symbols.get(place)
                if symbol is not None and moving.setdefault(symbol, step) != step:
                    return None
        return moving

    def _column(self, symbol: Any, step: int, count: int) -> tuple[Any, ...]:
        """What stands in each cell where this stands in the first."""
        name, first = self._places[symbol]
        return tuple(self._symbols[name, first + step * k] for k in range(count))

    def _plain(self, rows: Iterable[Sequence[Write]]) -> None:
        """Rows as they are; of sums what is left in one write."""
        for slot, alike in groupby(chain.from_iterable(rows), key=lambda write: write[0]):
            found = [expression for _, expression in alike]
            if slot.adds:
                self._begin(replace(slot, adds=False), se.Add(*found))
            else:
                self.writes += [(slot, expression) for expression in found]

    def _begin(self, slot: Slot, expression: Any) -> None:
        """Let a sum begin with this, beside what it begins with already; before what is added to it."""
        same = [k for k, (other, _) in enumerate(self.writes) if other.item == slot.item]
        if same and self.writes[same[0]][0] == slot:
            self.writes[same[0]] = slot, self.writes[same[0]][1] + expression
        else:
            self.writes.insert(min(same, default=len(self.writes)), (slot, expression))

    def _loop(
        self,
        run: Run,
        columns: Mapping[Any, tuple[Any, ...]],
        rows: Sequence[Sequence[Write]],
        signed: Sequence[Signature],
    ) -> None:
        """Write the cells of a run as a loop."""
        counter = str(self.names.fresh(next((each for each in _COUNTERS if each not in self.names), "i")))
        standing = dict(zip(columns, names_of(columns, counter, self.names), strict=True))
        cell = Cell(standing, counter, self.signatures, self.definitions, self.names)
        of_cell = slice(run.first, run.first + run.period)
        for row, signature, steps in zip(rows[of_cell], signed[of_cell], run.steps, strict=True):
            places = zip(self.signatures.places(signature), steps, strict=True)
            of_indices = (step for (name, _), step in places if name == INDEX)
            for slot, expression in row:
                if slot.adds and all(other.item != slot.item for other, _ in self.writes):
                    self._begin(replace(slot, adds=False), se.Integer(0))
                found = tuple(next(of_indices) for _ in slot.index)
                self.writes.append((replace(slot, loop=len(self.loops), steps=found), cell(expression)))
        self.temporaries += cell.temporaries
        self.apart |= cell.apart
        self.named |= {each for each, symbol in cell.named.items() if symbol in self.author}
        self.loops.append(Loop(counter, run.count, {standing[each]: column for each, column in columns.items()}))
