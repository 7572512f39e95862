"""Which rows of a model are alike: the same expression of symbols that stand so many places further in each.

A signature is what an expression does, its skeleton, and the places of the symbols that it does it with, its leaves.
Rows have it without being compared with each other, so that to find cells costs what it costs to read the rows.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby
from operator import itemgetter, sub
from typing import Any, NamedTuple

import symengine as se

from qddot.codegen.convert import function_name
from qddot.codegen.nodes import operands
from qddot.codegen.printer import Printer
from qddot.codegen.rewrite import leading_number, opposite, product

#: Cells that are written as a loop, at least; rows of one, at most.
LEAST, LONGEST = 8, 12
#: Leaves of an expression from which on each stands there once; of more, or more different ones, nothing repeats.
_FEW_LEAVES, _MOST_LEAVES, _MOST_DIFFERENT = 40, 2000, 200
#: Nodes whose operands have no order.
_UNORDERED = frozenset(("Add", "Mul", "And", "Or"))

#: Functions that are even.
_EVEN = frozenset(("Abs", "cos", "cosh", "sec", "sech"))

#: The list of the indices of what is written.
INDEX = "index"

#: Where a symbol stands: the name of a list, and its place in that.
Place = tuple[str, int]


class Signature(NamedTuple):
    """skeleton: equal where two do the same. leaves: places in lists; the skeleton says in which."""

    skeleton: int
    leaves: tuple[int, ...]


class Signatures:
    """Signatures of expressions. symbols: their places. definitions: of temporaries, which are looked through.

    signs: those of the sums that functions take which are not even, see `sign`.
    """

    def __init__(self, symbols: Mapping[Any, Place], definitions: Mapping[Any, Any]) -> None:
        self.symbols = symbols
        self._definitions = definitions
        self._skeletons: dict[tuple[Any, ...], int] = {}
        self._lists: dict[int, tuple[str, ...]] = {}
        self._known: dict[Any, Signature] = {}
        self.signs: set[int] = set()

    def __call__(self, node: Any) -> Signature:
        """The signature of an expression, or of factors."""
        found = self._known.get(node)
        if found is None:
            found = self._known[node] = self._made(node)
        return found

    def places(self, signature: Signature) -> list[Place]:
        """Where each leaf stands."""
        return list(zip(self._lists[signature.skeleton], signature.leaves, strict=True))

    def row(self, head: str, parts: Sequence[tuple[tuple[int, ...], Any]]) -> Signature:
        """The signature of writes that belong together: of each its index, and its expression."""
        return self.joined(
            head, [each for index, e in parts for each in (*(self._at(INDEX, k) for k in index), self(e))]
        )

    def sign(self, total: Any) -> int:
        """1 where the term of a sum that stands first in its list is subtracted, else -1."""
        first = min(operands(total), key=lambda term: sorted(self.places(self(term))))
        return 1 if leading_number(first).is_negative else -1

    def is_long(self, node: Any) -> bool:
        """Whether an expression is nothing that repeats; it may stand in rows that do, being the same in all."""
        return bool(operands(node)) and not self(node).leaves

    def _made(self, node: Any) -> Signature:
        if isinstance(node, tuple):
            return self.joined("*", list(map(self, node)), node)
        parts = operands(node)
        if parts:
            kind = type(node).__name__
            if (argument := argument_of(node)) is not None:
                sign = self.sign(argument)
                if not is_even(node):
                    self.signs.add(sign)
                elif sign == -1:  # of either sign it has the same value
                    parts = opposite(argument), *parts[1:]
            found = list(map(self, parts))
            if kind in _UNORDERED:
                found.sort()
            head = function_name(node) if isinstance(node, se.FunctionSymbol) else ""
            return self.joined(f"{kind} {head}", found, node)
        if node in self.symbols:
            return self._at(*self.symbols[node])
        if node in self._definitions:
            inside = self(self._definitions[node])
            return inside if inside.leaves else self._at(f"temporary {node}", 0)
        return self._at(f"symbol {node}", 0) if node.is_Symbol else Signature(self._kept((type(node), node), ()), ())

    def _at(self, name: str, place: int) -> Signature:
        return Signature(self._kept(("place", name), (name,)), (place,))

    def joined(self, head: str, parts: Sequence[Signature], node: Any = None) -> Signature:
        """What does something with these parts; node: what it is."""
        leaves = tuple(chain.from_iterable([part[1] for part in parts]))
        skeletons = [part[0] for part in parts]
        if node is not None and len(leaves) > _FEW_LEAVES:
            return self._each_once((head, *skeletons), leaves, node)
        found = self._skeletons.get((head, *skeletons))
        if found is None:
            names = chain.from_iterable(self._lists[each] for each in skeletons)
            found = self._kept((head, *skeletons), tuple(names))
        return Signature(found, leaves)

    def _each_once(self, key: tuple[Any, ...], leaves: tuple[int, ...], node: Any) -> Signature:
        """The signature of what holds most of its leaves again and again; the skeleton says which stands where."""
        names = chain.from_iterable(self._lists[each] for each in key[1:])
        found: dict[Place, int] = {}
        if len(leaves) <= _MOST_LEAVES:
            pattern = tuple([found.setdefault(place, len(found)) for place in zip(names, leaves, strict=True)])
        if not 0 < len(found) <= _MOST_DIFFERENT:
            return Signature(self._kept(("long", node), ()), ())
        return Signature(self._kept((*key, pattern), tuple(name for name, _ in found)), tuple(k for _, k in found))

    def _kept(self, key: tuple[Any, ...], names: tuple[str, ...]) -> int:
        """A skeleton, known from now on."""
        found = self._skeletons.setdefault(key, len(self._skeletons))
        self._lists.setdefault(found, names)
        return found


def argument_of(node: Any) -> Any:
    """The sum that a function of one argument, or an even power, is of; None of all else."""
    if isinstance(node, se.Pow):
        found, exponent = operands(node)
        even = isinstance(exponent, se.Integer) and int(exponent) % 2 == 0
    else:
        even = isinstance(node, se.Function) and not isinstance(node, se.FunctionSymbol) and len(operands(node)) == 1
        found = operands(node)[0] if even else None
    return found if even and isinstance(found, se.Add) else None


def is_even(node: Any) -> bool:
    """Whether a function or power of one argument has the same value where that has the opposite sign."""
    return isinstance(node, se.Pow) or type(node).__name__ in _EVEN


def in_order(terms: Iterable[Any], signatures: Signatures) -> list[Any]:
    """Expressions that are alike one after the other, by what they hold: the same in every process."""
    alike: dict[int, list[tuple[list[Place], Any]]] = {}
    for term in terms:
        signature = signatures(term)
        alike.setdefault(signature.skeleton, []).append((sorted(signatures.places(signature)), term))
    groups = [sorted(group, key=itemgetter(0)) for group in alike.values()]
    groups.sort(key=lambda group: group[0][0])
    text = Printer({})
    same = (list(found) for _, found in groupby(groups, key=lambda group: group[0][0]))
    ordered = (sorted(found, key=lambda group: text(product(group[0][1]))) if found[1:] else found for found in same)
    return [term for found in ordered for group in found for _, term in group]


@dataclass(frozen=True)
class Run:
    """Rows that repeat: the first one, of how many rows a cell is, how many cells, and of each row of the first cell
    how far each leaf goes from one to the next."""

    first: int
    period: int
    count: int
    steps: tuple[tuple[int, ...], ...]

    @property
    def behind(self) -> int:
        """The first row behind."""
        return self.first + self.period * self.count


def runs(rows: Sequence[Signature], longest: int = LONGEST) -> Iterator[Run]:
    """The runs of at least LEAST cells, of at most `longest` rows and as few as may be, one behind the other."""
    at = 0
    while at < len(rows):
        tried = (_run(rows, at, period) for period in range(1, longest + 1) if _repeats(rows, at, period))
        found = next((run for run in tried if run.count >= LEAST), None)
        if found is not None:
            yield found
        at = found.behind if found is not None else at + 1


def _repeats(rows: Sequence[Signature], at: int, period: int) -> bool:
    return at + LEAST * period <= len(rows) and rows[at].skeleton == rows[at + period].skeleton


def _run(rows: Sequence[Signature], at: int, period: int) -> Run:
    """As many cells of this many rows as there are from here on."""
    steps = tuple(_steps(rows[k], rows[k + period]) for k in range(at, at + period))
    behind = at + period
    while behind < len(rows):
        k = behind
        expected = steps[(k - at) % period]
        if expected is None or _steps(rows[k - period], rows[k]) != expected:
            break
        behind += 1
    whole = tuple(each for each in steps if each is not None)
    return Run(at, period, (behind - at) // period, whole)


def _steps(one: Signature, other: Signature) -> tuple[int, ...] | None:
    """How far each leaf goes from one row to another; None where they are not alike."""
    if one.skeleton != other.skeleton:
        return None
    return tuple(map(sub, other.leaves, one.leaves))
