"""Rules that keep the values and save operations: some Kernel -> Kernel, some local, node -> node."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

import symengine as se

from qddot.codegen.identities import polynomial, total, without_squares
from qddot.codegen.kernel import Assignment, Kernel
from qddot.codegen.nodes import operands, remembered, symbols_of
from qddot.codegen.rewrite import (
    MINUS_ONE,
    ONE,
    content,
    factors,
    is_number,
    is_signed_symbol,
    is_square,
    leading_number,
    operations,
    rewrite,
    split_number,
    without,
)

Change = Callable[[Any], Any]

#: A temporary of at most this many operations that is used once goes where it is used.
_SHORT = 6


def prune(kernel: Kernel) -> Kernel:
    """Drop the temporaries that nothing needs."""
    needed = set().union(*(symbols_of(expression) for _, expression in kernel.writes))
    kept: list[Assignment] = []
    for symbol, expression in reversed(kernel.temporaries):
        if symbol in needed:
            kept.append((symbol, expression))
            needed |= symbols_of(expression)
    return kernel.replace(reversed(kept), kernel.writes)


def inline(kernel: Kernel, keep: frozenset[Any], mere: frozenset[Any] = frozenset()) -> Kernel:
    """Put temporaries that are a mere symbol or number, or short and used once, where they are used; `keep` stay.

    mere: those that go where they are used once, however long.
    """
    if not kernel.temporaries:
        return kernel
    single = _single(kernel.expressions)
    values: dict[Any, Any] = {}
    kept: list[Assignment] = []

    def settle(expression: Any) -> Any:
        found = symbols_of(expression) & values.keys()
        return expression.subs({symbol: values[symbol] for symbol in found}) if found else expression

    for symbol, expression in kernel.temporaries:
        value = settle(expression)
        once = symbol in single and (symbol in mere or operations(value) <= _SHORT)
        if symbol not in keep and (once or is_signed_symbol(value)):
            values[symbol] = value
        else:
            kept.append((symbol, value))
    return kernel.replace(kept, [(slot, settle(expression)) for slot, expression in kernel.writes])


def simplify(kernel: Kernel, changes: Sequence[Change], memo: dict[Any, Any] | None = None) -> Kernel:
    """Apply local changes, one after the other, to every node from the leaves up, in one walk.

    memo: what became of nodes that were met before, in kernels that had the same changes.
    """
    memo = {} if memo is None else memo

    def change(node: Any) -> Any:
        for step in changes:
            node = step(node)
        return node

    return kernel.replace(
        [(symbol, rewrite(expression, change, memo)) for symbol, expression in kernel.temporaries],
        [(slot, rewrite(expression, change, memo)) for slot, expression in kernel.writes],
    )


def flatten(node: Any) -> Any:
    """Open sums within sums: a - (b + 2*(c + d)) -> a - b - 2*c - 2*d."""
    if not isinstance(node, se.Add):
        return node
    terms: list[Any] = []
    for term in operands(node):
        inside: tuple[Any, ...] = operands(term) if isinstance(term, se.Mul) else ()
        opens = len(inside) == 2 and is_number(inside[0]) and isinstance(inside[1], se.Add)
        terms += [inside[0] * inner for inner in operands(inside[1])] if opens else [term]
    return se.Add(*terms) if len(terms) > len(operands(node)) else node


def pythagoras(node: Any) -> Any:
    """Replace a*sin(x)**2 + a*cos(x)**2 by a."""
    if not isinstance(node, se.Add) or not any(map(_holds_squared_sine, operands(node))):
        return node
    return total(without_squares(polynomial(node)))


def tidy(expression: Any) -> Any:
    """An expression with sums within sums opened and sin^2 + cos^2 gone, everywhere in it."""
    return rewrite(expression, lambda node: pythagoras(flatten(node)), {})


@remembered
def _holds_squared_sine(term: Any) -> bool:
    squares = (part for part in factors(term) if isinstance(part, se.Pow) and operands(part)[1] == 2)
    return any(isinstance(operands(part)[0], se.sin) for part in squares)


def collect(node: Any) -> Any:
    """Take the factor that most terms of a sum share out of them: a*x + a*y + b -> a*(x + y) + b, until none is."""
    if not isinstance(node, se.Add):
        return node
    left = {term: factors(term) for term in operands(node)}
    counts = Counter(chain.from_iterable(left.values()))
    taken: list[Any] = []
    while (most := max(counts.values(), default=0)) > 1:
        often = [factor for factor, count in counts.items() if count == most]
        factor = min(often, key=lambda f: (-operations(f), str(f))) if len(often) > 1 else often[0]
        holding = [term for term, parts in left.items() if any(part is factor for part in parts)]
        taken.append(factor * front(collect(se.Add(*(without(term, factor) for term in holding)))))
        for part in chain.from_iterable(map(left.pop, holding)):
            counts[part] -= 1
    if not taken:
        return node
    rest = se.Add(*left)
    for each in reversed(taken):
        rest = se.Add(rest, each)
    return rest


def front(node: Any) -> Any:
    """Take a common number out of a sum where that leaves fewer of them: 4*a - 2*b - 2*c -> 2*(2*a - b - c)."""
    if not isinstance(node, se.Add):
        return node
    numbers = [leading_number(term) for term in operands(node)]
    if any(number == ONE for number in numbers) and all(map(_is_whole, numbers)):
        return node
    common = content(numbers)
    inside = [number / common for number in numbers]
    saved = _multiplications(numbers) - _multiplications(inside) - 1
    if common == ONE or (common != MINUS_ONE and saved < (0 if _is_whole(common) else 1)):
        return node
    return common * se.Add(*(term / common for term in operands(node)))


def _is_whole(number: Any) -> bool:
    return isinstance(number, se.Integer)


def _multiplications(numbers: Sequence[Any]) -> int:
    return sum(number not in (ONE, MINUS_ONE) for number in numbers)


def folded(known: Mapping[Any, Any]) -> Change:
    """What replaces a number times a symbol, within a product, by the symbol that is known to have this value."""
    numbers = {number for number, rest in map(split_number, known) if rest.is_Symbol and number != ONE}

    def change(node: Any) -> Any:
        number = leading_number(node) if isinstance(node, se.Mul) else ONE
        for sign in (1, -1) if number in numbers or -number in numbers else ():
            for part in operands(node)[1:]:
                if symbol := known.get(sign * number * part):
                    return se.Mul(sign * symbol, *(other for other in operands(node)[1:] if other != part))
        return node

    return change


def _single(parts: Iterable[Any]) -> frozenset[Any]:
    """The symbols that stand in only one of these expressions, and there once as it is written out."""
    met, again = set[Any](), set[Any]()
    for part in parts:
        held, once = symbols_of(part), _once(part)
        again |= met & held
        if once is not held:
            again |= held - once
        met |= held
    return frozenset(met - again)


@remembered
def _once(node: Any) -> frozenset[Any]:
    """The symbols that stand in an expression once as it is written out; all of them are `symbols_of` it itself."""
    held, parts = symbols_of(node), operands(node)
    found = frozenset[Any]() if is_square(node) else _single(parts) if parts else held
    return held if len(found) == len(held) else found
