"""The changes that turn an author's equation into the derived one, found greedily: each is the one that mends most.

The state is what is left of printed - derived as products with coefficients. A change of one symbol, sign, factor or
term is worth the number of products it makes agree; what no such change explains is listed product by product. So
the changes always add up to the difference: nothing is left out, and an equal equation has none.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import symengine as se

from qddot.codegen.canonical import canonical, combined
from qddot.codegen.compare.tree import Addend, inner_addends, symbols
from qddot.codegen.compare.values import Reading
from qddot.codegen.equations.spelling import spelling
from qddot.codegen.identities import Polynomial, total
from qddot.codegen.symbols import named

_Names = dict[str, str]

#: Kinds of changes; of two that mend as much, the first is taken.
KINDS = ("index", "dots", "sign", "symbol", "factor", "extra", "missing")


@dataclass(frozen=True)
class Change:
    """What is to change in an equation, and where.

    kind: one of `KINDS`, or remainder: products that no such change explains. at: the place in the file, None for what
    is missing. term: the author's term it is in. addend: the part of it that is to be multiplied by `factor` or lacks a
    factor. found, expected: names, in pairs; for a factor, `expected` is empty where found is too many and the other
    way round. derived: which of the derived terms is missing. expression: the part of printed - derived that this
    change explains.
    """

    kind: str
    at: int | None
    term: Addend | None
    found: tuple[str, ...] = ()
    expected: tuple[str, ...] = ()
    factor: Any = None
    addend: Addend | None = None
    derived: int | None = None
    expression: Any = None


@dataclass(frozen=True)
class _Candidate:
    change: Change
    term: int | None
    reading: Reading | None
    left: Polynomial

    def rank(self) -> tuple[int, int]:
        return len(self.left), KINDS.index(self.change.kind)


def explain(
    printed: Sequence[Addend], derived: Sequence[Any], reading: Reading, roles: Sequence[Sequence[str]]
) -> list[Change]:
    """The changes that make the printed terms those derived.

    printed: the author's terms, the right side's with their signs turned. derived: the derived terms. roles: the
    model's names by what they are: coordinates, velocities and accelerations in this order, then others. A name is only
    taken for another of its role.
    """
    return _Search(printed, derived, reading, roles).run()


class _Search:
    def __init__(
        self, printed: Sequence[Addend], derived: Sequence[Any], reading: Reading, roles: Sequence[Sequence[str]]
    ) -> None:
        self._printed = printed
        self._derived = [canonical(term) for term in derived]
        self._readings = [reading] * len(printed)
        self._worth = [canonical(reading.addend(term)) for term in printed]
        self._rates = _rates(*roles[:3])
        self._role = {name: k for k, names in enumerate(roles) for name in names}
        self._right = {str(symbol) for term in derived for symbol in term.free_symbols}

    def run(self) -> list[Change]:
        signed = [(1, worth) for worth in self._worth] + [(-1, worth) for worth in self._derived]
        left = combined(signed)
        changes: list[Change] = []
        while left:
            best = min(self._candidates(left), key=_Candidate.rank, default=None)
            if best is None or len(best.left) >= len(left):
                return changes + _remainder(left)
            mended = total(combined([(1, left), (-1, best.left)]))
            changes.append(replace(best.change, expression=mended))
            if best.term is not None and best.reading is not None:
                self._readings[best.term] = best.reading
                self._worth[best.term] = canonical(best.reading.addend(self._printed[best.term]))
            left = best.left
        return changes

    def _candidates(self, left: Polynomial) -> Iterator[_Candidate]:
        concerned = _symbols(left)
        for index, worth in enumerate(self._worth):
            if not worth or worth.keys() & left.keys():  # an error may have made a term vanish
                yield from self._names(index, left, concerned)
                yield from self._scales(index, left)
                yield from self._factors(index, left, concerned)
        for k, worth in enumerate(self._derived):
            if worth.keys() <= left.keys():
                rest = combined([(1, left), (1, worth)])
                yield _Candidate(Change("missing", None, None, derived=k), None, None, rest)

    def _names(self, index: int, left: Polynomial, concerned: set[str]) -> Iterator[_Candidate]:
        """One symbol read otherwise; all of one name; all coordinates of a term by their rates, or back."""
        term, reading = self._printed[index], self._readings[index]
        places: dict[str, list[int]] = {}
        for symbol in symbols(term.node):
            name = reading.renamed.get(symbol.at, symbol.name)
            if name is not None:
                places.setdefault(name, []).append(symbol.at)
        for name, found in places.items():
            if reading.symbol(name).free_symbols & {named(s) for s in concerned}:
                for other in sorted(self._alike(name, concerned)):
                    for chosen in [[at] for at in found] + ([found] if len(found) > 1 else []):
                        change = Change(_kind(name, other), chosen[0], term, (name,), (other,))
                        yield self._renamed(index, left, change, dict.fromkeys(chosen, other))
        for turn in self._rates:
            turned = {at: turn[name] for name, found in places.items() if name in turn for at in found}
            if len(turned) > 1:
                names = tuple(name for name in places if name in turn)
                change = Change("dots", min(turned), term, names, tuple(turn[name] for name in names))
                yield self._renamed(index, left, change, turned)

    def _alike(self, name: str, concerned: set[str]) -> set[str]:
        """The names that may have been meant: of the derived equation, of the same role or spelled alike."""
        names = (concerned & self._right) - {name}
        role = self._role.get(name)
        return {other for other in names if role in (None, self._role.get(other)) or _kind(name, other) != "symbol"}

    def _renamed(self, index: int, left: Polynomial, change: Change, renamed: Mapping[int, str | None]) -> _Candidate:
        return self._read(index, left, change, self._readings[index].with_names(renamed))

    def _read(self, index: int, left: Polynomial, change: Change, reading: Reading) -> _Candidate:
        worth = canonical(reading.addend(self._printed[index]))
        return _Candidate(change, index, reading, combined([(1, left), (1, worth), (-1, self._worth[index])]))

    def _scales(self, index: int, left: Polynomial) -> Iterator[_Candidate]:
        """An addend with the other sign, times a number, or left out."""
        term, reading = self._printed[index], self._readings[index]
        for addend in (term, *inner_addends(term.node)):
            without = canonical(reading.with_scale(addend.node, se.Integer(0)).addend(term))
            share = combined([(1, self._worth[index]), (-1, without)])
            ratios = Counter(1 - left[product] / share[product] for product in share.keys() & left.keys())
            for ratio, _ in ratios.most_common(2):
                kind = "extra" if ratio == 0 else "sign" if ratio == -1 else "factor"
                change = Change(kind, addend.at, term, factor=ratio, addend=addend)
                yield _Candidate(
                    change, index, reading.with_scale(addend.node, ratio), combined([(1, left), (ratio - 1, share)])
                )

    def _factors(self, index: int, left: Polynomial, concerned: set[str]) -> Iterator[_Candidate]:
        """A symbol too many in a product, or one that an addend lacks."""
        term, reading = self._printed[index], self._readings[index]
        for symbol in symbols(term.node):
            name = reading.renamed.get(symbol.at, symbol.name)
            if name is not None:
                change = Change("factor", symbol.at, term, found=(name,))
                yield self._renamed(index, left, change, {symbol.at: None})
        for addend in (term, *inner_addends(term.node)):
            for name in sorted(concerned & self._right):
                change = Change("factor", addend.at, term, expected=(name,), addend=addend)
                yield self._read(index, left, change, reading.with_scale(addend.node, named(name)))


def _kind(found: str, expected: str) -> str:
    """How two names differ: in what stands below, in dots, or altogether."""
    one, other = spelling(found), spelling(expected)
    if (one.letter, one.dots) == (other.letter, other.dots):
        return "index"
    return "dots" if (one.letter, one.indices) == (other.letter, other.indices) else "symbol"


def _rates(coordinates: Sequence[str], velocities: Sequence[str], accelerations: Sequence[str]) -> tuple[_Names, ...]:
    """Maps from coordinates to velocities to accelerations, and back."""
    up = dict(zip((*coordinates, *velocities), (*velocities, *accelerations), strict=True))
    return up, {rate: name for name, rate in up.items()}


def _symbols(terms: Iterable[Any]) -> set[str]:
    return {str(symbol) for product in terms for base, _ in product for symbol in base.free_symbols}


def _remainder(left: Polynomial) -> list[Change]:
    """Product by product: a positive remainder is too much on the left side, a negative one is missing there."""
    found = []
    for product, number in sorted(left.items(), key=lambda item: str(total(dict([item])))):
        expression = total({product: number})
        found.append(Change("remainder", None, None, expression=expression))
    return found
