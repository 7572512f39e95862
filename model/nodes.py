"""The parts of expressions, each once: written out as a tree an expression holds what it shares many times over."""

from functools import lru_cache
from typing import Any

from sympy import Basic, Symbol


@lru_cache(maxsize=4096)
def nodes(expression: Basic) -> frozenset[Basic]:
    """An expression and all that it is made of."""
    found: set[Basic] = set()
    waiting = [expression]
    while waiting:
        node = waiting.pop()
        if node not in found:
            found.add(node)
            waiting += node.args
    return frozenset(found)


@lru_cache(maxsize=4096)
def atoms(expression: Basic, *kinds: type) -> frozenset[Any]:
    """The parts of these kinds."""
    return frozenset(node for node in nodes(expression) if isinstance(node, kinds))


def free(value: Any) -> set[Symbol]:
    """The symbols in an expression or a matrix that nothing in it binds."""
    found = set(_free(value)) if isinstance(value, Basic) else value.free_symbols
    return {symbol for symbol in found if isinstance(symbol, Symbol)}


@lru_cache(maxsize=4096)
def _free(expression: Basic) -> frozenset[Basic]:
    parts = nodes(expression)
    return frozenset(expression.free_symbols if any(map(_binds, {type(part) for part in parts})) else parts)


def _binds(kind: type) -> bool:
    """Whether a node of this kind may bind symbols, as an integral does."""
    return next(each for each in kind.__mro__ if "free_symbols" in vars(each)) not in (Basic, Symbol)
