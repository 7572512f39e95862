"""What vanishes identically is not computed: it is found, and proven, at a random point of a finite field.

An expression of degree d that is not zero vanishes at a random point of a field of P elements with a probability of
d / P at most (Schwartz 1980, "Fast probabilistic algorithms for verification of polynomial identities", lemma 1), here
some 1e-36, and there is no rounding. Sine and cosine of an angle are the rational functions 2 r / (1 + r^2) and
(1 - r^2) / (1 + r^2) of a random r, those of a sum come from them by the addition theorems. Other functions, and roots,
are symbols, so nothing is proven by an identity of theirs.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from random import Random
from typing import Any

import symengine as se

from qddot.codegen.canonical import MOST_TURNS
from qddot.codegen.identities import spread
from qddot.codegen.kernel import Kernel
from qddot.codegen.nodes import operands, symbols_of
from qddot.codegen.rewrite import ONE, ZERO, fraction, is_number, rebuild, split_number

#: A Mersenne prime: the numbers below it are a field.
P = 2**127 - 1
#: Dropping a zero may lay another open.
_MOST_ROUNDS = 4
#: An angle that opens to more terms is one of its own.
_MOST_TERMS = 500
_LAST = math.inf

#: Sine and cosine.
_Wave = tuple[int, int]


def without_zeros(kernel: Kernel, point: "Point | None" = None) -> Kernel:
    """The kernel without the sums, and the pairs of terms in sums, that vanish whatever its reads are.

    point: of kernels in which a symbol means the same, each of its nodes then being looked at once.
    """
    point = Point() if point is None else point
    for _ in range(_MOST_ROUNDS):
        if not (found := _vanishing(kernel, point)):
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
    if found.keys().isdisjoint(point.holding(expression)):
        return expression
    if expression not in memo:
        memo[expression] = rebuild(expression, [_left(part, found, point, memo) for part in operands(expression)])
    return memo[expression]


def _vanishing(kernel: Kernel, point: "Point") -> dict[Any, Any]:
    """Sums that are or hold zeros -> what is left of them."""
    for symbol, expression in kernel.temporaries:
        point.assign(symbol, expression)
    return {total: point.left[total] for expression in kernel.expressions for total in point.holding(expression)}


class Point:
    """Values of nodes at a random point, the same for all kernels in which a symbol means the same.

    left: sums that are zero, or have pairs of terms that cancel -> what is left of them.
    """

    def __init__(self) -> None:
        self._chance = Random(3)
        self._values: dict[Any, int] = {}
        self._waves: dict[Any, _Wave] = {}
        self._definitions: dict[Any, tuple[int, Any]] = {}
        self._holding: dict[Any, tuple[Any, ...]] = {}
        self.left: dict[Any, Any] = {}

    def assign(self, symbol: Any, expression: Any) -> None:
        """Let a symbol have the value of an expression."""
        value = self.at(expression)
        if symbol not in self._values:
            self._values[symbol], self._definitions[symbol] = value, (len(self._definitions), expression)

    def holding(self, expression: Any) -> tuple[Any, ...]:
        """The sums in an expression of which less is `left`, innermost first."""
        self.at(expression)
        return self._holding.get(expression, ())

    def at(self, node: Any) -> int:
        """The value of a node; what is no arithmetic has one of its own."""
        value = self._values.get(node)
        if value is None:
            parts = operands(node)
            value = self._values[node] = self._value(node, [self.at(part) for part in parts])
            inside = [self._holding[part] for part in parts if part in self._holding] if self._holding else []
            if inside or node in self.left:
                own = (node,) if node in self.left else ()
                self._holding[node] = tuple(dict.fromkeys((*chain.from_iterable(inside), *own)))
        return value

    def _value(self, node: Any, parts: list[int]) -> int:
        if isinstance(node, se.Add):
            return self._sum(node, parts)
        if isinstance(node, se.Mul):
            return math.prod(parts) % P
        try:
            if is_number(node):
                return _number(node)
            if isinstance(node, se.Pow) and isinstance(operands(node)[1], se.Integer):
                return pow(parts[0], int(operands(node)[1]), P)
            return self._of_wave(node) if isinstance(node, se.sin | se.cos | se.tan) else self._any()
        except ValueError:  # no real number, or divided by zero
            return self._any()

    def _of_wave(self, node: Any) -> int:
        sine, cosine = self._wave(operands(node)[0])
        if isinstance(node, se.tan):
            return sine * pow(cosine, -1, P) % P
        return sine if isinstance(node, se.sin) else cosine

    def _any(self) -> int:
        return self._chance.randrange(2, P)

    def _sum(self, node: Any, parts: list[int]) -> int:
        value = sum(parts) % P
        if value == 0:
            self.left[node] = ZERO
        elif len(parts) > 2 and (cancelling := set(_opposites(parts))):
            self.left[node] = se.Add(*(term for k, term in enumerate(operands(node)) if k not in cancelling))
        return value

    def _wave(self, angle: Any) -> _Wave:
        """Sine and cosine of an angle: of its terms, by the addition theorems."""
        wave = (0, 1)
        for rest, number in self._terms(angle).items():
            wave = _turned(wave, self._wave_of_term(number, rest))
        return wave

    def _terms(self, angle: Any) -> dict[Any, Any]:
        """The terms of an angle -> the numbers before them, with what symbols stand for in place of these."""
        found: dict[Any, Any] = {}
        waiting: dict[Any, Any] = {angle: ONE}
        while waiting:  # the symbol that was assigned last, which no other one waiting holds
            node = max(waiting, key=lambda each: self._definitions.get(each, (_LAST,)))
            scale = waiting.pop(node)
            _, meaning = self._definitions.get(node, (_LAST, node))
            opened = se.expand(meaning) if spread(meaning) <= _MOST_TERMS else meaning
            for term in operands(opened) if isinstance(opened, se.Add) else (opened,):
                number, rest = split_number(term)
                numbers = waiting if rest in self._definitions else found
                numbers[rest] = numbers.get(rest, ZERO) + scale * number
        return found

    def _wave_of_term(self, number: Any, rest: Any) -> _Wave:
        turns = int(number) if isinstance(number, se.Integer) and symbols_of(rest) else 0
        if number != ZERO and not 0 < abs(turns) <= MOST_TURNS:
            turns, rest = (-1, -number * rest) if number.is_negative else (1, number * rest)
        if rest not in self._waves:
            self._waves[rest] = self._wave_alone(rest)
        wave, (sine, cosine) = (0, 1), self._waves[rest]
        for _ in range(abs(turns)):
            wave = _turned(wave, (sine if turns > 0 else -sine, cosine))
        return wave

    def _wave_alone(self, angle: Any) -> _Wave:
        """Sine and cosine of what is no sum: numbers where they are, as of pi, else of a random angle."""
        known = se.sin(angle), se.cos(angle)
        if all(map(is_number, known)):
            return self.at(known[0]), self.at(known[1])
        root = self._any()
        scale = pow(1 + root * root, -1, P)
        return 2 * root * scale % P, (1 - root * root) * scale % P


def _turned(one: _Wave, other: _Wave) -> _Wave:
    """Sine and cosine of the sum of two angles."""
    (s, c), (t, d) = one, other
    return (s * d + c * t) % P, (c * d - s * t) % P


def _number(node: Any) -> int:
    """The value of a literal number; ValueError where it is not real."""
    value = fraction(node)
    return value.numerator * pow(value.denominator, -1, P) % P


def _opposites(parts: Sequence[int]) -> Iterator[int]:
    """Places of terms that cancel each other in pairs."""
    waiting: dict[int, list[int]] = {}
    for k, part in enumerate(parts):
        if others := waiting.get(P - part):
            yield from (others.pop(), k)
        else:
            waiting.setdefault(part, []).append(k)
