"""Assumptions of SymPy's symbols: what a run keeps is accepted and then dropped, so that one name is one symbol."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

from sympy import Basic, MatrixBase, Rational, Symbol

if TYPE_CHECKING:
    from qddot.model.system import System

#: What is true of every symbol of a model.
_REAL = Symbol("x", real=True).assumptions0
#: Assumptions from which SymPy concludes others, to be named first.
_TELLING = ("zero", "positive", "negative", "nonnegative", "nonpositive", "integer", "rational", "imaginary", "nonzero")


def plain(value: Any) -> Any:
    """The same value, whatever holds the symbols, with every symbol of no assumptions."""
    if isinstance(value, Symbol):
        return Symbol(value.name) if type(value) is Symbol else value
    if isinstance(value, Basic | MatrixBase):
        found = {symbol: plain(symbol) for symbol in _free(value)}
        changed = {symbol: bare for symbol, bare in found.items() if symbol != bare}
        return value.xreplace(changed) if changed else value
    if is_dataclass(value) and not isinstance(value, type):
        changed = {each.name: plain(getattr(value, each.name)) for each in fields(value)}
        return replace(value, **changed)
    if isinstance(value, tuple):
        return tuple(map(plain, value))
    if isinstance(value, Mapping):
        return {plain(key): plain(entry) for key, entry in value.items()}
    return value


def unkept(system: "System") -> list[str]:
    """What symbols are declared to be, though nothing keeps them to it; and symbols of other kinds."""
    values = {str(p.symbol): [p.default] for p in system.parameters}
    for changed in system.parameter_sets.values():
        for symbol, value in changed.items():
            values.setdefault(str(symbol), []).append(value)
    found = sorted(set(_symbols([getattr(system, each.name) for each in fields(system)])), key=_place)
    return [message for symbol in found for message in _problem(symbol, values.get(symbol.name))]


def _problem(symbol: Symbol, values: list[Any] | None) -> Iterator[str]:
    if type(symbol) is not Symbol:
        kind = type(symbol).__name__
        yield f"{symbol.name} is a {kind}, which equals no other of its name: use Symbol({symbol.name!r})"
        return
    given = {name: value for name, value in symbol.assumptions0.items() if _REAL.get(name) != value}
    if not given:
        return
    said = _said(given)
    if any(_REAL.get(name, value) != value for name, value in given.items()):
        yield f"{symbol} is declared with {said}, and symbols are real here: write Symbol({symbol.name!r}, real=True)"
    elif values is None:
        yield (
            f"{symbol} is declared with {said}, to which nothing keeps it during a run: "
            f"write Symbol({symbol.name!r}, real=True)"
        )
    else:
        for value in values:
            if isinstance(value, Real) and math.isfinite(value) and not _holds(given, float(value)):
                yield f"parameter {symbol} is declared with {said}, and has the value {value!r}"


def _said(given: Mapping[str, bool]) -> str:
    """The assumption that says most."""
    name = next((name for name in _TELLING if given.get(name)), "commutative" if "commutative" in given else min(given))
    return f"{name}={given[name]}"


def _holds(given: Mapping[str, bool], value: float) -> bool:
    number = Rational(value)
    return all(getattr(number, f"is_{name}") == expected for name, expected in given.items())


def _symbols(value: Any) -> Iterator[Symbol]:
    """All symbols in a value."""
    if isinstance(value, Basic | MatrixBase):
        yield from _free(value)
    elif is_dataclass(value) and not isinstance(value, type):
        yield from _symbols([getattr(value, each.name) for each in fields(value)])
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _symbols(part)
    elif isinstance(value, Mapping):
        yield from _symbols([*value.keys(), *value.values()])


def _free(value: Any) -> set[Symbol]:
    return {symbol for symbol in value.free_symbols if isinstance(symbol, Symbol)}


def _place(symbol: Symbol) -> tuple[str, str]:
    return symbol.name, str(symbol.assumptions0)
