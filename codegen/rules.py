"""Rules that keep the values and save operations: some Kernel -> Kernel, some local, node -> node."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import symengine as se

from codegen.kernel import Assignment, Kernel
from codegen.rewrite import factors, is_number, is_square, operations, rewrite, without

Change = Callable[[Any], Any]

#: A temporary of at most this many operations that is used once goes where it is used.
_SHORT = 6


def prune(kernel: Kernel) -> Kernel:
    """Drop the temporaries that nothing needs."""
    needed = set().union(*(expression.free_symbols for _, expression in kernel.writes))
    kept: list[Assignment] = []
    for symbol, expression in reversed(kernel.temporaries):
        if symbol in needed:
            kept.append((symbol, expression))
            needed |= expression.free_symbols
    return kernel.replace(reversed(kept), kernel.writes)


def inline(kernel: Kernel, keep: frozenset[Any]) -> Kernel:
    """Put temporaries that are a mere symbol or number, or short and used once, where they are used; `keep` stay."""
    uses = Counter(symbol for expression in kernel.expressions for symbol in _leaves(expression))
    values: dict[Any, Any] = {}
    kept: list[Assignment] = []

    def settle(expression: Any) -> Any:
        found = expression.free_symbols & values.keys()
        return expression.subs({symbol: values[symbol] for symbol in found}) if found else expression

    for symbol, expression in kernel.temporaries:
        value = settle(expression)
        if symbol not in keep and (not value.args or (uses[symbol] == 1 and operations(value) <= _SHORT)):
            values[symbol] = value
        else:
            kept.append((symbol, value))
    return kernel.replace(kept, [(slot, settle(expression)) for slot, expression in kernel.writes])


def simplify(kernel: Kernel, changes: Sequence[Change]) -> Kernel:
    """Apply local changes, one after the other, to every node from the leaves up, in one walk."""
    memo: dict[Any, Any] = {}

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
    for term in node.args:
        inside: tuple[Any, ...] = term.args if isinstance(term, se.Mul) else ()
        opens = len(inside) == 2 and is_number(inside[0]) and isinstance(inside[1], se.Add)
        terms += [inside[0] * inner for inner in inside[1].args] if opens else [term]
    return se.Add(*terms) if len(terms) > len(node.args) else node


def pythagoras(node: Any) -> Any:
    """Replace a*sin(x)**2 + a*cos(x)**2 by a."""
    if not isinstance(node, se.Add):
        return node
    terms = list(node.args)
    squares = {term: part for term in terms for part in factors(term) if _is_squared_sine(part)}
    for term, part in squares.items():
        rest = without(term, part)
        partner = rest * se.cos(part.args[0].args[0]) ** 2
        if partner in terms:
            terms.remove(term)
            terms.remove(partner)
            terms.append(rest)
    return se.Add(*terms) if squares else node


def _is_squared_sine(part: Any) -> bool:
    return isinstance(part, se.Pow) and part.args[1] == 2 and isinstance(part.args[0], se.sin)


def collect(node: Any) -> Any:
    """Take the factor that most terms of a sum share out of them: a*x + a*y + b -> a*(x + y) + b."""
    if not isinstance(node, se.Add):
        return node
    found = [(term, factors(term)) for term in node.args]
    counts = Counter(factor for _, parts in found for factor in parts)
    most = max(counts.values(), default=0)
    if most < 2:
        return node
    factor = max((factor for factor, count in counts.items() if count == most), key=operations)
    sharing = [without(term, factor) for term, parts in found if factor in parts]
    others = [term for term, parts in found if factor not in parts]
    return se.Add(collect(se.Add(*others)), factor * collect(se.Add(*sharing)))


def _leaves(expression: Any) -> list[Any]:
    """Symbols of an expression, as often as they occur."""
    if not expression.args:
        return [] if is_number(expression) else [expression]
    if is_square(expression):
        return 2 * _leaves(expression.args[0])
    return [leaf for part in expression.args for leaf in _leaves(part)]
