"""Symbols exchanged for others in whatever holds them: expressions, matrices, declarations, tuples and mappings."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from sympy import Basic, MatrixBase, Symbol

from qddot.model.nodes import free


def mapped(value: Any, change: Callable[[Symbol], Any]) -> Any:
    """The same value, every symbol in it replaced by what `change` gives for it, all of them at once."""
    if isinstance(value, Symbol):
        return change(value)
    if isinstance(value, Basic | MatrixBase):
        found = {symbol: change(symbol) for symbol in free(value)}
        changed = {symbol: other for symbol, other in found.items() if symbol != other}
        return value.xreplace(changed) if changed else value
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: mapped(getattr(value, each.name), change) for each in fields(value)})
    if isinstance(value, tuple):
        return tuple(mapped(part, change) for part in value)
    if isinstance(value, Mapping):
        return {mapped(key, change): mapped(entry, change) for key, entry in value.items()}
    return value


def held(value: Any) -> Iterator[Symbol]:
    """All symbols in a value."""
    if isinstance(value, Basic | MatrixBase):
        yield from free(value)
    elif is_dataclass(value) and not isinstance(value, type):
        yield from held([getattr(value, each.name) for each in fields(value)])
    elif isinstance(value, list | tuple):
        for part in value:
            yield from held(part)
    elif isinstance(value, Mapping):
        yield from held([*value.keys(), *value.values()])
