"""Parameter-only arithmetic out of the hot kernel, into constants computed once a run."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import compress
from operator import not_
from typing import Any

import symengine as se

from qddot.codegen.kernel import Assignment, Kernel
from qddot.codegen.nodes import operands, symbols_of
from qddot.codegen.rewrite import Names, factors, is_condition, rebuild, split_number

#: Numbers and powers that have a word, by which a constant is named; what would become longer is numbered.
_NUMBERS = {
    **{se.Integer(1): "", se.Integer(2): "twice_", se.Integer(3): "three_times_", se.Integer(4): "four_times_"},
    **{se.Rational(1, 2): "half_", se.Rational(1, 3): "third_", se.Rational(1, 4): "quarter_"},
}
_POWERS = {
    **{se.Integer(1): "{}", se.Integer(2): "{}_squared", se.Integer(3): "{}_cubed"},
    se.Rational(1, 2): "root_of_{}",
}
_LONGEST = 32


def hoist(
    kernel: Kernel, parameters: frozenset[Any], names: Names, known: Iterable[Assignment] = ()
) -> tuple[tuple[Assignment, ...], Kernel]:
    """Split a kernel into constants, (symbol, expression) in parameters and earlier constants, and what is left.

    Whole parameter-only subexpressions and the parameter-only parts of products and sums become constants, divisions by
    parameters with them. The kernel that is left reads the constants. known: constants that there are.
    """
    hoisting = _Hoisting(set(parameters), names, known)
    kept: list[Assignment] = []
    for symbol, expression in kernel.temporaries:
        if symbols_of(expression) <= hoisting.constant:
            hoisting.move(symbol, expression)
        else:
            kept.append((symbol, hoisting.stripped(expression)))
    writes = [(slot, hoisting.stripped(expression)) for slot, expression in kernel.writes]
    reads = kernel.reads | {symbol for symbol, _ in hoisting.assignments}
    return tuple(hoisting.assignments), replace(kernel, reads=reads, temporaries=tuple(kept), writes=tuple(writes))


class _Hoisting:
    """One pass over a kernel. constant: symbols that are. renamed: those that only this kernel knows -> what all do."""

    def __init__(self, constant: set[Any], names: Names, known: Iterable[Assignment]) -> None:
        self.constant = constant
        self.names = names
        self.assignments: list[Assignment] = []
        self.known: dict[Any, Any] = {expression: symbol for symbol, expression in known}
        self.renamed: dict[Any, Any] = {}

    def move(self, symbol: Any, expression: Any) -> None:
        """Make a temporary a constant; a name that only this kernel knows is exchanged for one known to all."""
        if symbol in self.names:
            self.assign(symbol, self.settled(expression))
        else:
            self.renamed[symbol] = self.named(expression)
            self.constant.add(symbol)

    def settled(self, expression: Any) -> Any:
        """A parameter-only expression in symbols that all know."""
        found = {symbol: self.renamed[symbol] for symbol in symbols_of(expression) if symbol in self.renamed}
        return expression.subs(found) if found else expression

    def assign(self, symbol: Any, expression: Any) -> None:
        self.assignments.append((symbol, expression))
        self.constant.add(symbol)
        self.known.setdefault(expression, symbol)

    def named(self, expression: Any) -> Any:
        """The constant with this value; a sign stays outside."""
        value = self.settled(expression)
        number, _ = split_number(value)
        if number.is_negative:
            return -self.named(-value)
        if not operands(value):
            return value
        if value not in self.known:
            self.assign(self.names.fresh(telling(value) or "constant_"), value)
        return self.known[value]

    def stripped(self, expression: Any) -> Any:
        """The expression with its parameter-only parts named."""
        parts, symbols = operands(expression), symbols_of(expression)
        if symbols.isdisjoint(self.constant):
            return expression
        if symbols <= self.constant and not is_condition(expression):
            return self.named(expression)
        if not isinstance(expression, se.Mul | se.Add):
            return rebuild(expression, [self.stripped(part) for part in parts])
        build = se.Mul if isinstance(expression, se.Mul) else se.Add
        still = [symbols_of(part) <= self.constant for part in parts]
        fixed, moving = list(compress(parts, still)), list(compress(parts, map(not_, still)))
        left = [self.stripped(part) for part in moving]
        if any(map(symbols_of, fixed)):
            return build(self.named(build(*fixed)), *left)
        same = all(new is old for new, old in zip(left, moving, strict=True))
        return expression if same else build(*fixed, *left)


def telling(expression: Any) -> str | None:
    """A short name that says what an expression is: half_L_squared, g_times_m_2, inverse_m_1; None where there is none.

    It is made of the symbols' own names and of words, so it is an identifier if these are.
    """
    name = _sum_name(expression) if isinstance(expression, se.Add) else _product_name(expression)
    return name if name and len(name) <= _LONGEST else None


def _sum_name(total: Any) -> str | None:
    """m_1_plus_m_2 or l_10_minus_l_9, for sums of two."""
    signed = [split_number(term) for term in operands(total)]
    if len(signed) != 2 or not all(part.is_Symbol and abs(number) == 1 for number, part in signed):
        return None
    (first, left), (second, right) = sorted(((-number, str(part)) for number, part in signed))
    return f"{left}_{'plus' if second == -1 else 'minus'}_{right}" if first == -1 else None


def _product_name(product: Any) -> str | None:
    number, _ = split_number(product)
    words: dict[bool, list[str]] = {True: [], False: []}
    for factor in factors(product):
        base, exponent = operands(factor) if isinstance(factor, se.Pow) else (factor, se.Integer(1))
        if not base.is_Symbol or abs(exponent) not in _POWERS:
            return None
        words[bool(exponent > 0)].append(_POWERS[abs(exponent)].format(base))
    if number not in _NUMBERS:
        return None
    above, below = (sorted(words[up], key=lambda word: (word.lower(), word)) for up in (True, False))
    top = _NUMBERS[number] + "_times_".join(above)
    if not below:
        return top
    bottom = "_and_".join(below)
    return f"{top.removesuffix('_')}_over_{bottom}" if top else f"inverse_{bottom}"
