"""What vanishes identically is not computed: found at a random point, dropped where it is proven.

The point says which sums may vanish, in whole or by two of their terms; the canonical form says that they do. Functions
other than sine, cosine and tangent are symbols to both, so nothing is proven by an identity of theirs.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise
from random import Random
from typing import Any

import symengine as se

from qddot.codegen.canonical import AlgebraError, canonical
from qddot.codegen.identities import spread
from qddot.codegen.kernel import Kernel
from qddot.codegen.nodes import operands, remembered, symbols_of
from qddot.codegen.rewrite import is_number, rebuild

#: A sum this small against its terms may be zero.
_SMALL = 1e-11
#: A sum that opens to more terms than this is left as it is.
_MANY = 500
#: Dropping a zero may lay another open.
_MOST_ROUNDS = 4
_WAVES = {"sin": math.sin, "cos": math.cos, "tan": math.tan}


def without_zeros(kernel: Kernel, point: "Point | None" = None) -> Kernel:
    """The kernel without the sums, and the pairs of terms in sums, that vanish whatever its reads are.

    point: of kernels in which a symbol means the same, each of its nodes then being looked at once.
    """
    point = Point() if point is None else point
    for _ in range(_MOST_ROUNDS):
        if not (found := _proven(kernel, point)):
            return kernel
        memo: dict[Any, Any] = {}
        temporaries = [(symbol, _left(expression, found, point, memo)) for symbol, expression in kernel.temporaries]
        writes = [(slot, _left(expression, found, point, memo)) for slot, expression in kernel.writes]
        kernel = kernel.replace(temporaries, writes)
    return kernel


def _left(expression: Any, found: Mapping[Any, Any], point: "Point", memo: dict[Any, Any]) -> Any:
    """An expression with what is `found` in it replaced: see `replaced`, which looks at all nodes."""
    if expression in found:
        return _left(found[expression], found, point, memo)
    if found.keys().isdisjoint(point.suspects(expression)):
        return expression
    if expression not in memo:
        memo[expression] = rebuild(expression, [_left(part, found, point, memo) for part in operands(expression)])
    return memo[expression]


def _proven(kernel: Kernel, point: "Point") -> dict[Any, Any]:
    """Sums that are or hold zeros -> what is left of them."""
    for symbol, expression in kernel.temporaries:
        point.assign(symbol, expression)
    totals = {total: None for expression in kernel.expressions for total in point.suspects(expression)}
    definitions = dict(kernel.temporaries)
    found: dict[Any, Any] = {}
    for total in totals:
        pairs = point.pairs[total]
        if not pairs and _is_zero(total, definitions):
            found[total] = se.Integer(0)
        for one, other in pairs:
            if total not in found and _is_zero(one + other, definitions):
                found[total] = se.Add(*(term for term in operands(total) if term not in (one, other)))
    return found


def _is_zero(expression: Any, definitions: Mapping[Any, Any]) -> bool:
    """Whether the canonical form is empty: with assigned symbols as they are, or with what they stand for."""
    while True:
        empty = _is_empty(expression)
        if empty:
            return True
        inside = symbols_of(expression) & definitions.keys()
        if empty is None or not inside:
            return False
        expression = expression.subs({symbol: definitions[symbol] for symbol in inside})


@remembered
def _is_empty(expression: Any) -> bool | None:
    """Whether the canonical form is; None where there is none, or too long a one.

    Kernels of a model share most of their sums, and each of them asks again in every round.
    """
    try:
        return None if spread(expression) > _MANY else not canonical(expression)
    except AlgebraError:
        return None


class Point:
    """Values of nodes at a random point, the same for all kernels in which a symbol means the same.

    pairs: sums that may be zero, or have pairs of terms that may cancel -> those pairs, none of the former.
    """

    def __init__(self) -> None:
        self._chance = Random(3)
        self._values: dict[Any, float] = {}
        self._suspects: dict[Any, tuple[Any, ...]] = {}
        self.pairs: dict[Any, list[tuple[Any, Any]]] = {}

    def assign(self, symbol: Any, expression: Any) -> None:
        """Let a symbol have the value of an expression."""
        value = self.at(expression)
        self._values.setdefault(symbol, value)

    def suspects(self, expression: Any) -> tuple[Any, ...]:
        """The sums in an expression that have `pairs`, innermost first."""
        self.at(expression)
        return self._suspects.get(expression, ())

    def at(self, node: Any) -> float:
        """The value of a node; what is no arithmetic has one of its own."""
        value = self._values.get(node)
        if value is None:
            parts = operands(node)
            value = self._values[node] = self._value(node, [self.at(part) for part in parts])
            inside = [self._suspects[part] for part in parts if part in self._suspects]
            if inside or node in self.pairs:
                own = (node,) if node in self.pairs else ()
                self._suspects[node] = tuple(dict.fromkeys((*chain.from_iterable(inside), *own)))
        return value

    def _value(self, node: Any, parts: list[float]) -> float:
        if isinstance(node, se.Add):
            return self._sum(node, parts)
        if isinstance(node, se.Mul):
            return math.prod(parts)
        power = isinstance(node, se.Pow) and isinstance(operands(node)[1], se.Integer)
        work = math.pow if power else _WAVES.get(type(node).__name__)
        try:
            if is_number(node):
                return float(node)
            return work(*parts) if work else self._chance.choice((-1, 1)) * self._chance.uniform(0.3, 1.3)
        except (ArithmeticError, RuntimeError, TypeError, ValueError):  # too large, or no real number
            return math.nan

    def _sum(self, node: Any, parts: list[float]) -> float:
        value = sum(parts)
        if abs(value) <= _SMALL * sum(map(abs, parts)):
            self.pairs[node] = []
        elif len(parts) > 2 and (pairs := list(_opposites(operands(node), parts))):
            self.pairs[node] = pairs
        return value


def _opposites(terms: Sequence[Any], parts: Sequence[float]) -> Iterator[tuple[Any, Any]]:
    """Pairs of terms that may cancel: neighbours by size, of opposite values."""
    order = sorted(range(len(terms)), key=lambda k: abs(parts[k]))
    for k, j in pairwise(order):
        if abs(parts[k] + parts[j]) <= _SMALL * abs(parts[k]):
            yield terms[k], terms[j]
