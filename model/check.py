"""What makes a `System` physics. Each check yields messages; a `System` raises them together."""

import math
from collections.abc import Iterator, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

from sympy import Expr, Symbol, sympify

from qddot.model.constraints import problems_of_constraints, reaction_symbol, reactions
from qddot.model.contents import HELD, declared, energies, expressions, items, outputs, symbols, tables
from qddot.model.dimensions import arguments_of_tables
from qddot.model.events import Event, kinds_of_impacts, problems_of_events, problems_of_impacts
from qddot.model.jumps import is_kinked, jumps, jumps_of_constraints
from qddot.model.naming import LONGEST, name_problem, t
from qddot.model.resting import problems_of_resting
from qddot.model.scene import forms_of_scene, units_of_scene
from qddot.model.uses import fixed_positions, loops, massless, order, still_energies, unused
from qddot.model.vocabulary import complex_comparison, refusals
from qddot.units.worth import problem
from qddot.words import nearest

if TYPE_CHECKING:
    from qddot.model.system import System

#: Roles of what a run solves for, and what they are called.
_SOLVED_FOR = {
    "acceleration": "an acceleration",
    "multiplier": "a multiplier",
    "contact force": "a contact force",
    "sign of a contact": "which is 1 while a contact rests",
}


def problems(system: "System") -> list[str]:
    """Every reason to refuse a system; later checks run only where the earlier ones passed."""
    stages = (
        (kinds, forms_of_scene),
        (symbols_given, kinds_of_impacts),
        (_types,),
        (_names, _texts, _numbers, problems_of_events),
        (_expressions, order, _vocabulary),
        (loops,),
        (_comparisons,),
        (
            unused,
            fixed_positions,
            still_energies,
            problems_of_constraints,
            problems_of_impacts,
            units_of_scene,
            _tables,
        ),
        (reactions, massless, problems_of_resting),
        (jumps, jumps_of_constraints),
    )
    for checks in stages:
        found = [message for check in checks for message in check(system)]
        if found:
            return found
    return []


def kinds(system: "System") -> Iterator[str]:
    """What sequences hold that is of another kind."""
    for name, kinds in HELD.items():
        for item in getattr(system, name):
            if type(item).__name__ not in kinds:
                yield f"{name} holds {item!r}, expected {' or '.join(kinds)}"
    for event in system.events:
        if not isinstance(event, Event):
            yield f"events holds {event!r}, expected Event"
        elif not isinstance(event.then, Mapping):
            yield f"event {event.name} has then = {event.then!r}, expected a mapping from states to values"
    for name in ("generalized_forces", "parameter_sets"):
        if not isinstance(getattr(system, name), Mapping):
            yield f"{name} is a {type(getattr(system, name)).__name__}, expected a mapping"


def symbols_given(system: "System") -> Iterator[str]:
    """What has no symbol."""
    for item in items(system):
        if not isinstance(item.symbol, Symbol):
            kind = type(item).__name__.lower()
            yield f"{kind} {item.symbol!r} is a {type(item.symbol).__name__}, expected a SymPy Symbol"


def _types(system: "System") -> Iterator[str]:
    if not system.coordinates:
        yield "has no coordinates"
    for place, expression in (*expressions(system), *outputs(system)):
        if isinstance(expression, bool) or not isinstance(expression, Expr | int | float):
            hint = "; take its entry, [0, 0]" if getattr(expression, "shape", None) == (1, 1) else ""
            yield f"{place} is a {type(expression).__name__}, expected a SymPy expression{hint}"


def _names(system: "System") -> Iterator[str]:
    if reason := name_problem(system.name):
        yield f"the name {str(system.name)[:LONGEST]!r} {reason}"
    seen: dict[str, str] = {"t": "time"}
    for role, symbol in declared(system):
        if reason := name_problem(symbol.name):
            yield f"{role} {symbol.name[:LONGEST]!r} {reason}; choose another name"
        elif symbol.name == "time" and role != "parameter":
            yield f"{role} 'time' has the name of time in the results; choose another name"
        elif symbol.name in seen:
            yield f"{symbol.name} is used twice, as {seen[symbol.name]} and as {role}"
        seen.setdefault(symbol.name, role)


def _texts(system: "System") -> Iterator[str]:
    if not isinstance(system.title, str) or not system.title.strip():
        yield "has no title"
    for table in tables(system):
        for unit in (table.unit, *table.units):
            if unit is not None and (wrong := problem(unit) if isinstance(unit, str) else "it is no text"):
                yield f"table {table.name} has the unit {unit!r}: {wrong}"
    for item in items(system):
        for what in ("unit", "meaning"):
            text = getattr(item, what)
            if not isinstance(text, str) or not text.strip():
                hint = '; write "1" where it has none' if what == "unit" else ""
                yield f"{item.symbol} has no {what}{hint}"
            elif not text.isprintable():
                yield f"the {what} of {item.symbol} holds a character that cannot be printed: {text!r}"
            elif what == "unit" and (wrong := problem(text)):
                yield f"the unit of {item.symbol} is {text!r}: {wrong}"


def _numbers(system: "System") -> Iterator[str]:
    known = {parameter.symbol.name for parameter in system.parameters}
    for parameter in system.parameters:
        if not _finite(parameter.default):
            yield f"parameter {parameter.symbol} has the default {parameter.default!r}, expected a finite number"
    for name, values in system.parameter_sets.items():
        if reason := name_problem(name):
            yield f"the parameter set {name!r} {reason}"
        for symbol, value in values.items():
            if str(symbol) not in known:
                yield f"parameter set {name} names {symbol}, which is no parameter{nearest(str(symbol), known)}"
            elif not _finite(value):
                yield f"parameter set {name} gives {symbol} the value {value!r}, expected a finite number"


def _expressions(system: "System") -> Iterator[str]:
    coordinates = {coordinate.symbol for coordinate in system.coordinates}
    for symbol in system.generalized_forces:
        if symbol not in coordinates:
            names = {coordinate.name for coordinate in coordinates}
            yield f"a generalized force is given for {symbol}, which is no coordinate{nearest(str(symbol), names)}"
    solved = {symbol: role for role, symbol in declared(system) if role in _SOLVED_FOR}
    results = {symbol for role, symbol in declared(system) if role in ("output", "table")}
    known = {t} | {symbol for _, symbol in declared(system)} - results
    for place, expression in expressions(system):
        yield from _unknown_symbols(place, expression, known)
        for symbol in sorted(symbols(expression) & solved.keys(), key=str):
            what = _SOLVED_FOR[solved[symbol]]
            yield f"{place} uses {symbol}, {what}, which is not known yet there: outputs may use it"
    if system.constraints:
        known |= {reaction_symbol(coordinate) for coordinate in system.coordinates}
    for place, expression in outputs(system):
        yield from _unknown_symbols(place, expression, known)


def _unknown_symbols(place: str, expression: Any, known: set[Symbol]) -> Iterator[str]:
    if not isinstance(expression, Expr):
        return
    names = {symbol.name for symbol in known}
    for symbol in sorted(symbols(expression) - known, key=str):
        yield f"{place} uses {symbol}, which is not declared{nearest(str(symbol), names)}"


def _tables(system: "System") -> Iterator[str]:
    yield from arguments_of_tables(system, (*expressions(system), *outputs(system)))


def _vocabulary(system: "System") -> Iterator[str]:
    for place, expression in (*expressions(system), *outputs(system)):
        yield from (f"{place} uses {refusal}" for refusal in refusals(sympify(expression)))


def _comparisons(system: "System") -> Iterator[str]:
    """What compares complex values where names are written out, as energies and constraints are for their jumps."""
    constraints = ((f"constraint {each.symbol}", each.expression) for each in system.constraints)
    for place, expression in (*energies(system), *constraints):
        kinked = is_kinked(system, expression)
        if kinked and (reason := complex_comparison(system.written_out(expression))):
            yield f"{place} uses {reason}"


def _finite(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
