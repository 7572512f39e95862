"""Contact that rests: what an impact becomes once its bounces are too small to be told, and where it cannot.

While it rests, the gap of an impact is held at zero as a constraint, by a force along it that pushes and never pulls.
The equations then need the second derivative of the gap.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from sympy import Expr, Piecewise, Symbol

from qddot.model.contents import accelerations, as_prescribed, symbols
from qddot.model.dimensions import Dimensions, said
from qddot.model.events import Impact
from qddot.model.kinks import KINKED
from qddot.model.table import Value

if TYPE_CHECKING:
    from qddot.model.system import System

#: Most coordinates and constraints together, contacts among them: they are solved for densely, on the stack.
MOST = 200
#: Units of forces along a gap, by what the gap is measured in.
_FORCES = {"m": "N", "1": "N m"}


def resting(system: "System") -> tuple[Impact, ...]:
    """The impacts of a model that can come to rest, in order."""
    return tuple(each for each in system.events if isinstance(each, Impact) and not unable_to_rest(system, each))


def unable_to_rest(system: "System", impact: Impact) -> str:
    """Why an impact cannot come to rest, its gap's second derivative not being known; "" where it can."""
    gap = system.written_out(impact.function)
    free = symbols(gap)
    for state in system.states:
        if free & {state.symbol, state.rate}:
            return f"its gap depends on the state {state.symbol}, whose second derivative would be needed"
    for channel in system.inputs:
        if free & {channel.rate, *accelerations(channel)}:
            return f"its gap depends on {min(map(str, free & {channel.rate, *accelerations(channel)}))}, a rate"
        if channel.symbol in free and not tuple(accelerations(channel)):
            return (
                f"its gap depends on the input {channel.symbol}, whose second derivative would be needed: "
                f"{as_prescribed(channel)}"
            )
    if gap.atoms(Value) or gap.has(Piecewise, *KINKED):
        return "its gap has a kink or reads a table, so that its second derivative jumps"
    count = len(system.coordinates) + len(system.constraints) + sum(isinstance(e, Impact) for e in system.events)
    if count > MOST:
        return f"the model has {count} coordinates, constraints and impacts, and {MOST} can be solved for together"
    return ""


def force_unit(system: "System", impact: Impact) -> str:
    """The unit of the force along a gap: times the gap it is an energy. N where the gap's unit is not certain."""
    if impact.unit:
        return impact.unit
    gap: Expr = impact.function
    found = Dimensions(system).of(gap)
    if found is None:
        return "N"
    unit = said(found)
    return _FORCES.get(unit, f"J/({unit})")


def problems_of_resting(system: "System") -> Iterator[str]:
    """Forces of contacts that something reads, though they cannot rest, and those that must be able to."""
    read = {symbol for output in system.outputs for symbol in symbols(output.expression)}
    for event in system.events:
        if not isinstance(event, Impact) or not (why := unable_to_rest(system, event)):
            continue
        names: set[Symbol] = {event.force_symbol, event.rests_symbol}
        if event.force is not None:
            yield f"impact {event.name} has the force {event.force}, but it cannot rest: {why}"
        elif found := names & read:
            yield f"an output uses {min(found, key=str)}, but impact {event.name} cannot rest: {why}"
