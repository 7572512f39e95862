"""Rules that keep the values and save operations: some Kernel -> Kernel, some local, node -> node."""

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from itertools import chain
from typing import Any

import symengine as se

from qddot.codegen.identities import polynomial, total, without_squares
from qddot.codegen.kernel import Assignment, Kernel
from qddot.codegen.nodes import operands, remembered, symbols_of
from qddot.codegen.rewrite import (
    ONE,
    content,
    factors,
    is_number,
    is_one,
    is_signed_symbol,
    is_square,
    is_unit,
    leading_number,
    operations,
    own_operations,
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


def inline(
    kernel: Kernel, keep: frozenset[Any], mere: frozenset[Any] = frozenset(), apart: frozenset[Any] = frozenset()
) -> Kernel:
    """Put temporaries that are a mere symbol or number, or short and used once, where they are used; `keep` stay.

    mere: those that go where they are used once, however long. apart: those that do not, however short.
    """
    if not kernel.temporaries:
        return kernel
    short = (symbol for symbol, expression in kernel.temporaries if _is_short(expression))
    single = _single(kernel.expressions, {*short, *mere} - keep - apart)
    values: dict[Any, Any] = {}
    kept: list[Assignment] = []

    def settle(expression: Any) -> Any:
        found = symbols_of(expression) & values.keys()
        return expression.subs({symbol: values[symbol] for symbol in found}) if found else expression

    for symbol, expression in kernel.temporaries:
        value = settle(expression)
        once = symbol in single and (symbol in mere or _is_short(value))
        if symbol not in keep and (once or is_signed_symbol(value)):
            values[symbol] = value
        else:
            kept.append((symbol, value))
    return kernel.replace(kept, [(slot, settle(expression)) for slot, expression in kernel.writes])


@remembered
def _is_short(expression: Any) -> bool:
    """Whether an expression is of few operations; a long one is not looked through to its end."""
    left, waiting = _SHORT, [expression]
    while waiting and left >= 0:
        node = waiting.pop()
        left -= own_operations(node)
        waiting += operands(node)
    return left >= 0


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


def shorter(node: Any) -> Any:
    """A sum after the changes that follow here, one after the other; what is none is not asked four times."""
    return front(collect(pythagoras(flatten(node)))) if isinstance(node, se.Add) else node


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
    """An expression with sums within sums opened, sin^2 + cos^2 gone and common numbers in front, everywhere in it."""

    def change(node: Any) -> Any:
        return front(pythagoras(flatten(node))) if isinstance(node, se.Add) else node

    return rewrite(expression, change, {})


def _holds_squared_sine(term: Any) -> bool:
    for part in operands(term) if isinstance(term, se.Mul) else (term,):
        if isinstance(part, se.Pow):
            base, power = operands(part)
            if isinstance(base, se.sin) and power == 2:
                return True
    return False


def collect(node: Any) -> Any:
    """Take the factor that most terms of a sum share out of them: a*x + a*y + b -> a*(x + y) + b, until none is."""
    if not isinstance(node, se.Add):
        return node
    left = {term: factors(term) for term in operands(node)}
    flat = list(chain.from_iterable(left.values()))
    if len(set(flat)) == len(flat):
        return node
    holders: dict[Any, dict[Any, None]] = {factor: {} for factor in flat}
    for term, parts in left.items():
        for part in parts:
            holders[part][term] = None
    taken: list[Any] = []
    while (most := max(map(len, holders.values()))) > 1:
        often = [factor for factor, terms in holders.items() if len(terms) == most]
        factor = min(often, key=lambda f: (-operations(f), str(f))) if len(often) > 1 else often[0]
        holding = list(holders[factor])
        taken.append(factor * front(collect(se.Add(*(without(term, factor) for term in holding)))))
        for term in holding:
            for part in left.pop(term):
                del holders[part][term]
    rest = se.Add(*left)
    for each in reversed(taken):
        rest = se.Add(rest, each)
    return rest


def front(node: Any) -> Any:
    """Take a common number out of a sum where that leaves fewer of them: 4*a - 2*b - 2*c -> 2*(2*a - b - c)."""
    if not isinstance(node, se.Add):
        return node
    numbers = [leading_number(term) for term in operands(node)]
    if any(map(is_one, numbers)) and all(map(_is_whole, numbers)):
        return node
    common = content(numbers)
    if is_one(common):
        return node
    inside = [number / common for number in numbers]
    saved = _multiplications(numbers) - _multiplications(inside) - 1
    if not is_unit(common) and saved < (0 if _is_whole(common) else 1):
        return node
    return common * se.Add(*(term / common for term in operands(node)))


def _is_whole(number: Any) -> bool:
    return isinstance(number, se.Integer)


def _multiplications(numbers: Sequence[Any]) -> int:
    return sum(not is_unit(number) for number in numbers)


def with_constants(kernel: Kernel, known: Mapping[Any, Any]) -> Kernel:
    """Let what is `folded` take the place of all that it may; most expressions hold none of its numbers."""
    numbers, change, memo = _numbers_before_symbols(known), folded(known), dict[Any, Any]()

    def settle(expression: Any) -> Any:
        return rewrite(expression, change, memo) if _leads(expression, numbers) else expression

    if not numbers:
        return kernel
    return kernel.replace(
        [(symbol, settle(expression)) for symbol, expression in kernel.temporaries],
        [(slot, settle(expression)) for slot, expression in kernel.writes],
    )


def _numbers_before_symbols(known: Mapping[Any, Any]) -> set[Any]:
    return {number for number, rest in map(split_number, known) if rest.is_Symbol and not is_one(number)}


def _leads(expression: Any, numbers: Set[Any]) -> bool:
    """Whether a product in an expression has one of these numbers in front, or its opposite."""
    waiting = [expression]
    while waiting:
        node = waiting.pop()
        number = leading_number(node) if isinstance(node, se.Mul) else ONE
        if number is not ONE and (number in numbers or -number in numbers):
            return True
        waiting += operands(node)
    return False


def folded(known: Mapping[Any, Any]) -> Change:
    """What replaces a number times a symbol, within a product, by the symbol that is known to have this value."""
    numbers = _numbers_before_symbols(known)

    def change(node: Any) -> Any:
        number = leading_number(node) if isinstance(node, se.Mul) else ONE
        for sign in (1, -1) if number in numbers or -number in numbers else ():
            for part in operands(node)[1:]:
                if symbol := known.get(sign * number * part):
                    return se.Mul(sign * symbol, *(other for other in operands(node)[1:] if other != part))
        return node

    return change


def _single(expressions: Iterable[Any], wanted: set[Any]) -> set[Any]:
    """Which of the wanted symbols stand in only one of these expressions, and there once as it is written out."""
    met, again = set[Any](), set[Any]()
    waiting = list(expressions) if wanted else []
    while waiting:
        node = waiting.pop()
        if wanted.isdisjoint(symbols_of(node)):
            continue
        if node in met or is_square(node):
            again |= symbols_of(node)
        else:
            met.add(node)
            waiting += operands(node)
    return wanted & met - again
