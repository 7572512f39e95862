"""What makes a `System` physics. Each check yields messages; a `System` raises them together."""

import math
import warnings
from collections.abc import Iterator, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

from sympy import Expr, Symbol, sympify

from qddot.model.inertia import inertia
from qddot.model.naming import LONGEST, name_problem, t
from qddot.model.vocabulary import refusals
from qddot.units.worth import problem
from qddot.words import nearest

if TYPE_CHECKING:
    from qddot.model.system import System

Named = tuple[str, Symbol]

#: What the sequences of a system hold, by the names of its classes.
_HELD = {
    "coordinates": ("Coordinate",),
    "parameters": ("Parameter",),
    "inputs": ("Input",),
    "quantities": ("Quantity",),
    "outputs": ("Output", "Quantity"),
}


def problems(system: "System") -> list[str]:
    """Every reason to refuse a system; later checks run only where the earlier ones passed."""
    stages = (
        (_kinds,),
        (_symbols_given,),
        (_types,),
        (_names, _texts, _numbers),
        (_expressions, _order, _vocabulary),
        (_unused, _fixed_positions, _inertia),
    )
    for checks in stages:
        found = [message for check in checks for message in check(system)]
        if found:
            return found
    return []


def declared(system: "System") -> Iterator[Named]:
    """(role, symbol) of all that has a name of its own, in order of declaration."""
    for coordinate in system.coordinates:
        yield "coordinate", coordinate.symbol
        yield "velocity", coordinate.rate
        yield "acceleration", coordinate.acceleration
    yield from (("parameter", parameter.symbol) for parameter in system.parameters)
    for channel in system.inputs:
        yield "input", channel.symbol
        yield "input rate", channel.rate
    for quantity in system.quantities:
        yield "quantity", quantity.symbol
        if quantity.rate is not None:
            yield "quantity rate", quantity.rate
    quantities = set(system.quantities)
    yield from (("output", output.symbol) for output in system.outputs if output not in quantities)


def expressions(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of everything that is derived from; outputs apart."""
    yield "kinetic energy", system.kinetic_energy
    yield "potential energy", system.potential_energy
    yield "dissipation", system.dissipation
    for symbol, force in system.generalized_forces.items():
        yield f"generalized force of {symbol}", force
    yield from ((f"quantity {quantity.symbol}", quantity.expression) for quantity in system.quantities)
    yield from positions(system)


def outputs(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of the outputs."""
    yield from ((f"output {output.symbol}", output.expression) for output in system.outputs)


def positions(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of the inputs that have a position."""
    for channel in system.inputs:
        if channel.position is not None:
            yield f"position of {channel.symbol}", channel.position


def _kinds(system: "System") -> Iterator[str]:
    for name, kinds in _HELD.items():
        for item in getattr(system, name):
            if type(item).__name__ not in kinds:
                yield f"{name} holds {item!r}, expected {' or '.join(kinds)}"
    for name in ("generalized_forces", "parameter_sets"):
        if not isinstance(getattr(system, name), Mapping):
            yield f"{name} is a {type(getattr(system, name)).__name__}, expected a mapping"


def _symbols_given(system: "System") -> Iterator[str]:
    lists = (system.coordinates, system.parameters, system.inputs, system.quantities, system.outputs)
    for item in (item for items in lists for item in items):
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
    for item in (*system.coordinates, *system.parameters, *system.inputs, *system.quantities, *system.outputs):
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
    accelerations = {coordinate.acceleration for coordinate in system.coordinates}
    results = {symbol for role, symbol in declared(system) if role == "output"}
    known = {t} | {symbol for _, symbol in declared(system)} - results
    for place, expression in expressions(system):
        yield from _unknown_symbols(place, expression, known - accelerations)
    for output in system.outputs:
        yield from _unknown_symbols(f"output {output.symbol}", output.expression, known)


def _fixed_positions(system: "System") -> Iterator[str]:
    fixed = {parameter.symbol for parameter in system.parameters}
    for symbol, expression in system.definitions.items():
        if _symbols(expression) <= fixed:
            fixed.add(symbol)
    for place, expression in positions(system):
        for symbol in sorted(_symbols(expression) - fixed, key=str):
            yield f"{place} depends on {symbol}, which moves; it may depend on parameters alone"


def _unknown_symbols(place: str, expression: Any, known: set[Symbol]) -> Iterator[str]:
    if not isinstance(expression, Expr):
        return
    names = {symbol.name for symbol in known}
    for symbol in sorted(_symbols(expression) - known, key=str):
        yield f"{place} uses {symbol}, which is not declared{nearest(str(symbol), names)}"


def _vocabulary(system: "System") -> Iterator[str]:
    for place, expression in (*expressions(system), *outputs(system)):
        yield from (f"{place} uses {refusal}" for refusal in refusals(sympify(expression)))


def _order(system: "System") -> Iterator[str]:
    later = {quantity.symbol for quantity in system.quantities}
    later |= {quantity.rate for quantity in system.quantities if quantity.rate is not None}
    for quantity in system.quantities:
        for symbol in sorted(_symbols(quantity.expression) & later, key=str):
            itself = symbol in (quantity.symbol, quantity.rate)
            yield f"quantity {quantity.symbol} uses {'itself' if itself else f'{symbol}, which comes later'}"
        later -= {quantity.symbol, quantity.rate}
        velocities = _symbols(quantity.expression) & {coordinate.rate for coordinate in system.coordinates}
        if quantity.rate is not None and velocities:
            velocity = min(map(str, velocities))
            yield f"quantity {quantity.symbol} depends on {velocity}, so its rate would need accelerations"


def _unused(system: "System") -> Iterator[str]:
    used: set[Symbol] = set()
    for _, expression in expressions(system):
        used |= _symbols(expression)
    for output in system.outputs:
        used |= _symbols(output.expression)
    for parameter in system.parameters:
        if parameter.symbol not in used:
            yield f"parameter {parameter.symbol} is used nowhere; remove it, or check the expressions for a slip"
    for channel in system.inputs:
        if not {channel.symbol, channel.rate} & used:
            yield f"input {channel.symbol} is used nowhere; remove it, or check the expressions for a slip"
    outputs = {output.symbol for output in system.outputs}
    for quantity in system.quantities:
        if not {quantity.symbol, quantity.rate} & (used | outputs):
            yield f"quantity {quantity.symbol} is used nowhere; remove it, or list it among the outputs"


def _inertia(system: "System") -> Iterator[str]:
    reached = _symbols(system.kinetic_energy)
    for symbol, expression in reversed(system.definitions.items()):
        if symbol in reached:
            reached |= _symbols(expression)
    velocities = [coordinate.rate for coordinate in system.coordinates]
    if not reached.intersection(velocities):
        yield f"the kinetic energy depends on no velocity ({', '.join(sorted(map(str, velocities)))})"
        return
    missing = [coordinate for coordinate in system.coordinates if coordinate.rate not in reached]
    for coordinate in missing:
        yield (
            f"coordinate {coordinate.symbol} has no inertia: the kinetic energy does not depend on {coordinate.rate}, "
            "so the mass matrix is singular"
        )
    if missing:
        return
    defaults = {parameter.symbol: float(parameter.default) for parameter in system.parameters}
    found = inertia(sympify(system.kinetic_energy), velocities, system.definitions, defaults)
    if found.massless:
        names = ", ".join(str(system.coordinates[k].symbol) for k in found.massless)
        together = " together" if len(found.massless) > 1 else ""
        what = "the mass matrix is singular" if found.singular else "the kinetic energy is not positive"
        yield f"{what}: a motion of {names}{together} has no kinetic energy"
    elif not found.is_known:
        warnings.warn(
            f"model {system.name}: the kinetic energy has no real value near the default parameters, nor at the other "
            "points that were tried; whether the mass matrix can be inverted is not known",
            stacklevel=2,
        )


def _symbols(expression: Any) -> set[Symbol]:
    found = expression.free_symbols if isinstance(expression, Expr) else ()
    return {symbol for symbol in found if isinstance(symbol, Symbol)}


def _finite(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
