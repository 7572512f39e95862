"""What a node of SymEngine is made of, asked for once: SymEngine makes its answer anew each time, which takes longer
than all that is done with it.

Equal nodes are one node here, so that to look one up compares no trees. The order of a sum's terms depends on how it
came about, and equal sums have that of the first one: a generation starts with `forget`, so that what was generated
before it has no say in its text.
"""

from collections.abc import Callable, Container, Iterable, Mapping
from typing import Any, TypeVar

import symengine as se

T = TypeVar("T")

_NOTHING: frozenset[Any] = frozenset()


_KEPT: list[dict[Any, Any]] = []


def remembered(function: Callable[[Any], T]) -> Callable[[Any], T]:
    """A function of a node that is computed once for each, until the next `forget`."""

    class Known(dict[Any, T]):
        """Node -> what it gives; functools.cache takes twice as long to look a node up."""

        def __missing__(self, node: Any) -> T:
            found = self[node] = function(node)
            return found

    known = Known()
    _KEPT.append(known)
    return known.__getitem__


#: Node -> the first one that was equal to it.
_FIRST: dict[Any, Any] = {}


def forget() -> None:
    """Let go of all nodes, and of what is known of them."""
    _FIRST.clear()
    for each in _KEPT:
        each.clear()


def one(node: Any) -> Any:
    """The first node that was equal to this."""
    return _FIRST.setdefault(node, node)


@remembered
def operands(node: Any) -> tuple[Any, ...]:
    """What a node is made of; a number is made of nothing."""
    if isinstance(node, se.Number):
        return ()
    parts = node.args
    return tuple(map(_FIRST.setdefault, parts, parts))


@remembered
def symbols_of(node: Any) -> frozenset[Any]:
    """The symbols that an expression holds."""
    inside = operands(node)
    if not inside:
        return frozenset((one(node),)) if node.is_Symbol else _NOTHING
    return _NOTHING.union(*map(symbols_of, inside))


def holding(*kinds: type) -> Callable[[Any], bool]:
    """Give what says whether an expression is of one of these kinds, or holds a node that is."""

    @remembered
    def holds(node: Any) -> bool:
        return isinstance(node, kinds) or any(map(holds, operands(node)))

    return holds


#: Choices between values, and what is looked up in tables.
holds_choice, holds_table = holding(se.Piecewise), holding(se.FunctionSymbol)


def reached(nodes: Iterable[Any], definitions: Mapping[Any, Any], but: Container[Any] = frozenset()) -> set[Any]:
    """The nodes of expressions, of those of the temporaries among them, and so on; not what is in some of these."""
    waiting, met = list(nodes), set[Any]()
    while waiting:
        node = waiting.pop()
        if node not in met:
            met.add(node)
            if node not in but:
                waiting += (definitions[node],) if node in definitions else operands(node)
    return met
