"""What a model holds, part by part: its symbols with their roles, its expressions with their places."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from sympy import Expr, Symbol

from qddot.model.events import Impact, event_expressions, restitutions
from qddot.model.nodes import atoms, free
from qddot.model.scene import scene_numbers
from qddot.model.table import Table, Value

if TYPE_CHECKING:
    from qddot.model.system import System

Named = tuple[str, Symbol]

#: What the sequences of a system hold, by the names of its classes.
HELD = {
    "coordinates": ("Coordinate",),
    "parameters": ("Parameter",),
    "inputs": ("Input", "Prescribed"),
    "quantities": ("Quantity", "Friction"),
    "outputs": ("Output", "Quantity", "Friction"),
    "states": ("State",),
    "constraints": ("Constraint", "Rolling"),
    "contacts": ("Contact",),
}


def declared(system: "System") -> Iterator[Named]:
    """(role, symbol) of all that has a name of its own, in order of declaration."""
    for coordinate in system.coordinates:
        yield "coordinate", coordinate.symbol
        yield "velocity", coordinate.rate
        yield "acceleration", coordinate.acceleration
    for state in system.states:
        yield "state", state.symbol
        yield "state rate", state.rate
    yield from (("parameter", parameter.symbol) for parameter in system.parameters)
    for channel in system.inputs:
        yield "input", channel.symbol
        yield "input rate", channel.rate
        yield from (("input acceleration", symbol) for symbol in accelerations(channel))
    for quantity in system.quantities:
        yield "quantity", quantity.symbol
        if quantity.rate is not None:
            yield "quantity rate", quantity.rate
    for table in system.tables:
        yield from (("table", Symbol(name)) for name in table.names)
    yield from (("multiplier", constraint.symbol) for constraint in system.constraints)
    for impact in (event for event in system.events if isinstance(event, Impact)):
        yield "contact force", impact.force_symbol
        yield "sign of a contact", impact.rests_symbol
    quantities = set(system.quantities)
    yield from (("output", output.symbol) for output in system.outputs if output not in quantities)


def accelerations(channel: Any) -> Iterator[Symbol]:
    """The second derivative of an input, where it is a prescribed motion."""
    if hasattr(channel, "acceleration"):
        yield channel.acceleration


def as_prescribed(channel: Any) -> str:
    """What to do where an input's second derivative is needed."""
    return f'declare it as a prescribed motion, Prescribed({channel.symbol}, "{channel.unit}", ...)'


def expressions(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of everything that is derived from; outputs apart."""
    yield from energies(system)
    for symbol, force in system.generalized_forces.items():
        yield f"generalized force of {symbol}", force
    yield from ((f"quantity {quantity.symbol}", quantity.expression) for quantity in system.quantities)
    yield from ((f"static part of {each.symbol}", each.ratio) for each in system.quantities if hasattr(each, "ratio"))
    yield from ((f"rate of {state.symbol}", state.derivative) for state in system.states)
    yield from ((f"constraint {constraint.symbol}", constraint.expression) for constraint in system.constraints)
    yield from (("baumgarte", value) for value in system.baumgarte or ())
    yield from event_expressions(system)
    yield from restitutions(system)
    yield from positions(system)


def energies(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of what is differentiated by coordinates and velocities."""
    yield "kinetic energy", system.kinetic_energy
    yield "potential energy", system.potential_energy
    yield "dissipation", system.dissipation


def outputs(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of what is computed of a state for the eye: outputs, numbers of the scene."""
    yield from ((f"output {output.symbol}", output.expression) for output in system.outputs)
    yield from ((place, expression) for place, _, expression in scene_numbers(system))


def positions(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of the inputs that have a position."""
    for channel in system.inputs:
        if channel.position is not None:
            yield f"position of {channel.symbol}", channel.position


def tables(system: "System") -> tuple[Table, ...]:
    """The tables that expressions hold, by name."""
    found = {
        value.table
        for _, expression in (*expressions(system), *outputs(system))
        for value in (atoms(expression, Value) if isinstance(expression, Expr) else ())
    }
    return tuple(sorted(found, key=lambda table: table.name))


def items(system: "System") -> Iterator[Any]:
    """All that has a symbol, a unit and a meaning."""
    for name in HELD:
        yield from getattr(system, name)


def reached(system: "System", expression: Any) -> set[Symbol]:
    """All symbols that an expression depends on, those that stand for others among them."""
    found = symbols(expression)
    for symbol, definition in reversed(system.definitions.items()):
        if symbol in found:
            found |= symbols(definition)
    return found


def symbols(expression: Any) -> set[Symbol]:
    """The symbols in an expression; none in what is no expression."""
    return free(expression) if isinstance(expression, Expr) else set()
