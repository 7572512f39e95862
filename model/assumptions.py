"""Assumptions of SymPy's symbols: what a run keeps is accepted and then dropped, so that one name is one symbol."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from numbers import Real
from typing import TYPE_CHECKING, Any

from sympy import Rational, Symbol

from qddot.model.mapping import held, mapped

if TYPE_CHECKING:
    from qddot.model.system import System

#: What is true of every symbol of a model.
_REAL = Symbol("x", real=True).assumptions0
#: Assumptions from which SymPy concludes others, to be named first.
_TELLING = ("zero", "positive", "negative", "nonnegative", "nonpositive", "integer", "rational", "imaginary", "nonzero")


def plain(value: Any) -> Any:
    """The same value, whatever holds the symbols, with every symbol of no assumptions."""
    return mapped(value, lambda symbol: Symbol(symbol.name) if type(symbol) is Symbol else symbol)


def unkept(system: "System") -> list[str]:
    """What symbols are declared to be, though nothing keeps them to it; and symbols of other kinds."""
    values = {str(p.symbol): [p.default] for p in system.parameters}
    for changed in system.parameter_sets.values():
        for symbol, value in changed.items():
            values.setdefault(str(symbol), []).append(value)
    found = sorted(set(held([getattr(system, each.name) for each in fields(system)])), key=_place)
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


def _place(symbol: Symbol) -> tuple[str, str]:
    return symbol.name, str(symbol.assumptions0)
