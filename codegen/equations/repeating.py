"""Terms and rows that repeat: the first of them in symbols with an index, and from where to where that runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from qddot.codegen.cells import LEAST, Place, Run, Signature, Signatures, in_order, runs
from qddot.codegen.equations.entries import Entry, label, numbered, with_index
from qddot.codegen.equations.order import Order
from qddot.codegen.rewrite import replaced
from qddot.codegen.symbols import named

#: What an index may be called.
_INDICES = "ijkmn"


@dataclass(frozen=True)
class Range:
    """The numbers that an index takes, one after the other; standing: what stands for the symbols of the first."""

    index: str
    first: int
    last: int
    standing: Mapping[Any, Any]


@dataclass(frozen=True)
class Series:
    """Terms that are alike: one of them for all, and the first of them as it is."""

    range: Range
    term: Any
    begins: Any


@dataclass(frozen=True)
class Rows:
    """Rows that stand together; range: where they are the first of many, which they then stand for."""

    rows: tuple[int, ...]
    range: Range | None = None

    @property
    def times(self) -> int:
        """How many rows each of them stands for."""
        return self.range.last - self.range.first + 1 if self.range else 1

    def entry(self, entries: Sequence[Entry], k: int) -> Entry:
        """What row k is of, from what all rows are of."""
        if self.range is None:
            return entries[k]
        period = len(self.rows)
        alike = entries[k : k + period * self.times : period]
        return with_index(alike, self.range.index, self.range.first, self.range.last)


class Repeating:
    """What repeats in the expressions of one model; what has an index is ranked in its order as what it stands for.

    index: of rows; sums have another one, as they may stand in such rows. None where the model has no letter left.
    """

    def __init__(self, order: Order) -> None:
        self._order = order
        names = [(symbol, str(symbol)) for symbol in order.symbols]
        found = ((symbol, numbered(name)) for symbol, name in names)
        self._places: dict[Any, Place] = {symbol: place for symbol, place in found if place}
        self._symbols = {place: symbol for symbol, place in self._places.items()}
        taken = {part for _, name in names for part in name.split("_")}
        free = [letter for letter in _INDICES if letter not in taken]
        self.index: str | None
        self._of_sums: str | None
        self.index, self._of_sums = (free[0], free[1]) if len(free) > 1 else (None, None)
        self._signatures = Signatures(self._places, {})

    def terms(self, terms: Sequence[Any]) -> tuple[list[Any], list[Series]]:
        """Terms of a sum: those that stand alone, and those that repeat."""
        if len(terms) < LEAST or self._of_sums is None:
            return list(terms), []
        ordered = in_order(terms, self._signatures)
        signed = [self._signatures(term) for term in ordered]
        alone, series, at = [], [], 0
        for run in runs(signed, 1):
            span = self._range(run, signed, self._of_sums)
            if span is not None:
                alone += ordered[at : run.first]
                begins = ordered[run.first]
                series.append(Series(span, replaced(begins, span.standing), begins))
                at = run.behind
        return alone + ordered[at:], series

    def rows(self, rows: Sequence[Sequence[Any]]) -> list[Rows]:
        """Rows of expressions, those that repeat by the first; the first expression of each is what it is of."""
        if len(rows) < LEAST or self.index is None:
            return [Rows((k,)) for k in range(len(rows))]
        signed = [self._signatures.row("row", [((), part) for part in row]) for row in rows]
        found, at = [], 0
        for run in runs(signed):
            span = self._range(run, signed, self.index, rows[run.first][0])
            if span is not None:
                found += [Rows((k,)) for k in range(at, run.first)]
                found.append(Rows(tuple(range(run.first, run.first + run.period)), span))
                at = run.behind
        return found + [Rows((k,)) for k in range(at, len(rows))]

    def _range(self, run: Run, signed: Sequence[Signature], index: str, subject: Any = None) -> Range | None:
        """Where a run goes, and in which symbols; None where its numbers do not rise by one.

        subject: the symbol whose numbers the index takes; without one it takes the highest.
        """
        steps: dict[Any, int] = {}
        for signature, moved in zip(signed[run.first : run.first + run.period], run.steps, strict=True):
            for place, step in zip(self._signatures.places(signature), moved, strict=True):
                symbol = self._symbols.get(place)
                if step not in (0, 1) or (symbol is not None and steps.setdefault(symbol, step) != step):
                    return None
        moving = [symbol for symbol, step in steps.items() if step]
        if not moving:
            return None
        first = max(self._places[symbol][1] for symbol in ([subject] if subject in moving else moving))
        standing = {symbol: self._indexed(symbol, index, first) for symbol in moving}
        return Range(index, first, first + run.count - 1, standing)

    def _indexed(self, symbol: Any, index: str, first: int) -> Any:
        """q_3 as q_i, q_2 as q_i-1 where `first` is 3."""
        stem, number = self._places[symbol]
        found = named(f"{stem}{label(index, number - first)}")
        self._order.stand_in(found, symbol)
        return found
