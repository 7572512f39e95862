"""What a node of SymEngine is made of, asked for once: SymEngine makes its answer anew each time, which takes longer
than all that is done with it.

Equal nodes are one node here, so that to look one up compares no trees. The order of a sum's terms depends on how it
came about, and equal sums have that of the first one: a generation starts with `forget`, so that what was generated
before it has no say in its text.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar, cast

import symengine as se

F = TypeVar("F", bound=Callable[..., Any])

_NOTHING: frozenset[Any] = frozenset()
_KEPT: list[Any] = []


def remembered(function: F) -> F:
    """A function of nodes that is computed once for each, until the next `forget`."""
    kept = cache(function)
    _KEPT.append(kept)
    return cast("F", kept)


def forget() -> None:
    """Let go of all nodes, and of what is known of them."""
    for each in _KEPT:
        each.cache_clear()


@remembered
def one(node: Any) -> Any:
    """The first node that was equal to this."""
    return node


@remembered
def operands(node: Any) -> tuple[Any, ...]:
    """What a node is made of; a number is made of nothing."""
    return () if isinstance(node, se.Number) else tuple(map(one, node.args))


@remembered
def symbols_of(node: Any) -> frozenset[Any]:
    """The symbols that an expression holds."""
    inside = operands(node)
    if not inside:
        return frozenset((one(node),)) if node.is_Symbol else _NOTHING
    return _NOTHING.union(*map(symbols_of, inside))


@remembered
def holds(node: Any, *kinds: type) -> bool:
    """Whether an expression is of one of these kinds, or holds a node that is."""
    return isinstance(node, kinds) or any(holds(part, *kinds) for part in operands(node))
