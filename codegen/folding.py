"""Rows of a draft that are alike as one: the first of them, in symbols that stand for those of each cell in turn.

What is left has a row for each kind of cell, however many cells there are, and goes through the same rules as every
draft; only constants, series and the text have to know how often it stands there.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, groupby
from types import MappingProxyType
from typing import Any, NamedTuple

import symengine as se

from qddot.codegen.cell import Cell, Cells, Moving
from qddot.codegen.cells import INDEX, LEAST, Place, Run, Signature, Signatures, in_order, runs
from qddot.codegen.kernel import Assignment, Loop, Slot
from qddot.codegen.neighbours import kept
from qddot.codegen.nodes import operands, reached
from qddot.codegen.opened import terms
from qddot.codegen.rewrite import Names, is_call, product
from qddot.codegen.signs import with_signs

Write = tuple[Slot, Any]
#: Writes that belong together: a row of a matrix, an item of a vector, or one term of a sum.
Rows = Sequence[Sequence[Write]]
#: What counts the cells of a loop is called so where that is free.
_COUNTERS = "ijkmnpqrs"
#: So many times as many functions may be called where neighbours do not share what they give.
_MORE = 1.05
#: More calls for each item written that take less time than what they would share is worth.
_FEW_CALLS = 0.1
#: What is left of nodes, at most, where equations are those of cells, and not each row a loop of its own length.
_SHORT = 0.5


@dataclass(frozen=True)
class Folded:
    """A draft with loops. named: temporaries that stay, in loops as the author named them.

    apart: those that are computed before loops. kept: symbols of what neighbours share -> the items of arrays that hold
    it.
    """

    temporaries: tuple[Assignment, ...]
    writes: tuple[Write, ...]
    loops: tuple[Loop, ...] = ()
    named: frozenset[Any] = frozenset()
    apart: frozenset[Any] = frozenset()
    kept: Mapping[Any, Slot] = field(default_factory=dict)


def fold(
    temporaries: Sequence[Assignment],
    writes: Sequence[Write],
    places: Mapping[Any, Place],
    names: Names,
    author: frozenset[Any] = frozenset(),
    *,
    copies: bool = True,
    stages: Mapping[str, int] = MappingProxyType({}),
) -> Folded:
    """A draft with what repeats in it written once, the draft itself where nothing does.

    places: of the symbols that it reads. names: those of loops come from here. author: quantities that have names.
    copies: whether rows that only copy a symbol, or a number, are enough. stages: arrays of zeros, any item of which is
    written, or added to, at any time of its stage; what is done for the same cells in one stage is one loop.
    """
    before, after, given = list(temporaries), list(writes), names.copy()
    signatures = Signatures(places, dict(before))
    for _, expression in after:
        signatures(expression)
    staged = [write for write in after if write[0].argument in stages]
    if staged and not _any_repeat(staged, signatures):
        return Folded(tuple(temporaries), tuple(writes))
    if len(signatures.signs) > 1:
        before, after = with_signs(before, after, signatures, given)
        signatures = Signatures(places, dict(before))
    found = _Folding(dict(before), signatures, given.copy(), author, stages)
    found.fold(after)
    whole, extra = reached((value for _, value in after), dict(before)), _FEW_CALLS * len(after) if stages else 0
    most = _MORE * sum(map(is_call, whole)) + extra
    if found.cost.calls > most:
        shared = kept(before, after, signatures, given)
        before, after = shared.written(before, after)
        signatures = Signatures({**places, **shared.places}, dict(before))
        found = _Folding(dict(before), signatures, given, author, stages, shared.items)
        found.fold(after)
    short = not stages or found.cost.nodes <= _SHORT * len(whole)
    if not found.loops or not short or not (copies or found.computes) or found.cost.calls > most:
        return Folded(tuple(temporaries), tuple(writes))
    names.join(found.names)
    return found.result()


def _row_of(slot: Slot) -> tuple[Any, ...]:
    """What writes have in common that belong together: the row of a matrix, or the item itself."""
    return slot.argument, slot.index[0] if len(slot.index) > 1 else slot.index, slot.adds


def _any_repeat(writes: Iterable[Write], signatures: Signatures) -> bool:
    """Whether any rows repeat as they are: what is equal has equations of its own."""
    return any(runs(_signed(_rows(writes), signatures)))


def _rows(writes: Iterable[Write]) -> list[list[Write]]:
    """The writes, those that belong together beside each other."""
    return [list(row) for _, row in groupby(writes, key=lambda write: _row_of(write[0]))]


def _signed(rows: Rows, signatures: Signatures) -> list[Signature]:
    """The signature of each row."""
    return [signatures.row(row[0][0].argument, [(slot.index, e) for slot, e in row]) for row in rows]


class Cost(NamedTuple):
    """How many functions are called that take longer than arithmetic, and how many nodes are written down."""

    calls: int
    nodes: int


class _Folding:
    """What becomes of one draft. definitions: its temporaries, in order."""

    def __init__(
        self,
        definitions: Mapping[Any, Any],
        signatures: Signatures,
        names: Names,
        author: frozenset[Any],
        stages: Mapping[str, int],
        kept: Mapping[Any, Slot] = MappingProxyType({}),
    ) -> None:
        self.definitions, self.names, self.author, self._stages, self._kept = definitions, names, author, stages, kept
        self.signatures = signatures
        self.writes: list[Write] = []
        self._cells: list[Cells] = []
        self._symbols = {place: symbol for symbol, place in signatures.symbols.items()}

    @property
    def temporaries(self) -> list[Assignment]:
        """Those of all loops."""
        return [each for cells in self._cells for each in cells.cell.temporaries]

    @property
    def apart(self) -> set[Any]:
        """Those that are computed before the loops that they are of."""
        return {each for cells in self._cells for each in cells.cell.apart}

    @property
    def loops(self) -> tuple[Loop, ...]:
        """What has become loops."""
        return tuple(Loop(each.counter, each.count, each.cell.columns(each.columns)) for each in self._cells)

    @property
    def computes(self) -> bool:
        """Whether there is arithmetic in a loop, and not symbols that are copied alone."""
        return bool(self.temporaries) or any(slot.loop is not None and operands(value) for slot, value in self.writes)

    @property
    def cost(self) -> Cost:
        """What is computed before the loops is called once, what is in them for each cell."""
        before = {**self.definitions, **{symbol: e for symbol, e in self.temporaries if symbol in self.apart}}
        within = dict(self.temporaries)
        waiting, calls, nodes = [value for slot, value in self.writes if slot.loop is None], 0, 0
        for k, cells in enumerate(self._cells):
            met = reached((value for slot, value in self.writes if slot.loop == k), within, before)
            waiting += met & before.keys()
            calls, nodes = calls + cells.count * sum(map(is_call, met)), nodes + len(met)
        met = reached(waiting, before)
        return Cost(calls + sum(map(is_call, met)), nodes + len(met))

    def fold(self, writes: Iterable[Write]) -> None:
        """Write what is written, what repeats once."""
        opened = chain.from_iterable(
            self._opened(slot, e) if len(slot.index) == 1 else [(slot, e)] for slot, e in writes
        )
        whole = chain.from_iterable([[write] for write in row] if row[0][0].adds else [row] for row in _rows(opened))
        self._write(list(whole), self._others)

    def result(self) -> Folded:
        """What has become of the draft."""
        named = (each for cells in self._cells for each, one in cells.cell.named.items() if one in self.author)
        return Folded(
            (*self.definitions.items(), *self.temporaries),
            tuple(self.writes),
            self.loops,
            frozenset(named),
            frozenset(self.apart),
            self._kept,
        )

    def _opened(self, slot: Slot, expression: Any) -> Sequence[Write]:
        """A write, or those of the terms of a long sum that repeat, what is alike in order."""
        found = in_order(terms(expression, self.definitions), self.signatures)
        if any(runs(list(map(self.signatures, found)), 1)):
            return [(replace(slot, adds=True), term) for term in found]
        return [(slot, expression)]

    def _write(self, rows: Rows, rest: Callable[[Rows], None]) -> None:
        """Write rows that repeat as loops; rest: what writes those that do not."""
        signed, at = _signed(rows, self.signatures), 0
        for run in runs(signed):
            begun, moving = self._begun(run, signed)
            if moving is not None:
                rest(rows[at : begun.first])
                self._loop(begun, moving, rows, signed)
                at = run.behind
        rest(rows[at:])

    def _others(self, rows: Rows) -> None:
        """Rows that do not repeat, of which parts may."""
        for opens, alike in groupby(rows, key=self._opens):
            if not opens:
                self._plain(alike)
            for row in alike if opens else ():
                self._write([[write] for each in row for write in self._opened(*each)], self._plain)

    def _opens(self, row: Sequence[Write]) -> bool:
        """Whether the entries of a row can be written at any time."""
        slot, _ = row[0]
        return slot.argument in self._stages and len(slot.index) > 1

    def _begun(self, run: Run, signed: Sequence[Signature]) -> tuple[Run, Moving | None]:
        """A run from the first cell on that is as the others, and what moves in it.

        In a cell one symbol may stand where there are two in the others. None where there is no such cell.
        """
        while run.count >= LEAST:
            if (steps := self._steps(run, signed)) is not None:
                found = sorted(
                    (symbol for symbol, step in steps.items() if step), key=self.signatures.symbols.__getitem__
                )
                columns = {symbol: self._column(symbol, steps[symbol], run.count) for symbol in found}
                return run, Moving(run.count, columns, frozenset(steps.keys() - columns.keys()))
            run = replace(run, first=run.first + run.period, count=run.count - 1)
        return run, None

    def _steps(self, run: Run, signed: Sequence[Signature]) -> dict[Any, int] | None:
        """How far each symbol of the first cell goes to the next; None where one goes several ways."""
        found: dict[Any, int] = {}
        for signature, steps in zip(signed[run.first : run.first + run.period], run.steps, strict=True):
            for place, step in zip(self.signatures.places(signature), steps, strict=True):
                symbol = self._symbols.get(place)
                if symbol is not None and found.setdefault(symbol, step) != step:
                    return None
        return found

    def _column(self, symbol: Any, step: int, count: int) -> tuple[Any, ...]:
        """What stands in each cell where this stands in the first."""
        name, first = self.signatures.symbols[symbol]
        return tuple(self._symbols[name, first + step * k] for k in range(count))

    def _plain(self, rows: Iterable[Sequence[Write]]) -> None:
        """Rows as they are; of sums what is left in one write."""
        for slot, alike in groupby(chain.from_iterable(rows), key=lambda write: write[0]):
            found = [product(expression) for _, expression in alike]
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

    def _loop(self, run: Run, moving: Moving, rows: Rows, signed: Sequence[Signature]) -> None:
        """Write the cells of a run in a loop, in one that there is where they can be done together."""
        of_cell = slice(run.first, run.first + run.period)
        number = self._loop_of(moving, {self._stages.get(row[0][0].argument) for row in rows[of_cell]})
        self._cells[number].join(moving, self.names)
        for row, signature, steps in zip(rows[of_cell], signed[of_cell], run.steps, strict=True):
            places = zip(self.signatures.places(signature), steps, strict=True)
            of_indices = (step for (name, _), step in places if name == INDEX)
            for slot, expression in row:
                found = tuple(next(of_indices) for _ in slot.index)
                self._do(replace(slot, loop=number, steps=found), self._cells[number].cell(product(expression)))

    def _loop_of(self, moving: Moving, stages: set[int | None]) -> int:
        """The number of a loop that takes these cells."""
        stage = stages.pop() if len(stages) == 1 else None
        for number, cells in enumerate(self._cells):
            if cells.takes(stage, moving):
                return number
        counter = str(self.names.fresh(next((each for each in _COUNTERS if each not in self.names), "i")))
        cell = Cell(counter, self.signatures, self.definitions, self.names)
        self._cells.append(Cells(cell, counter, moving.count, stage))
        return len(self._cells) - 1

    def _do(self, slot: Slot, expression: Any) -> None:
        """Write what is written for each cell; what is added to the same item is one sum."""
        if slot.adds and slot.argument in self._stages:
            for k, (other, value) in enumerate(self.writes):
                if other == slot:
                    self.writes[k] = slot, value + expression
                    return
        elif slot.adds and all(other.item != slot.item for other, _ in self.writes):
            self._begin(replace(slot, adds=False, loop=None, steps=()), se.Integer(0))
        self.writes.append((slot, expression))
