"""Events that act: a function of the state crosses zero, and states take other values there, at once."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sympy import Expr, Symbol

from qddot.model.naming import LONGEST, name_problem
from qddot.units.worth import problem

if TYPE_CHECKING:
    from qddot.model.system import System


@dataclass(frozen=True)
class Event:
    """`function` crosses zero, rising (direction 1), falling (-1) or either way (0); `then` states take new values.

    function, and the values in `then` (coordinate, velocity or state -> expression), may depend on q, qdot, t, states,
    parameters, inputs and quantities, all as they are just before. A state that `then` leaves out goes on; a state on
    constraints is put back on these. name: that of the event in results. Nothing in `then`: the event is located and
    told, as a step's end; terminal: the run ends there, after it acted.
    """

    function: Expr
    name: str
    meaning: str
    direction: int = 0
    then: Mapping[Symbol, Expr] = field(default_factory=dict)
    terminal: bool = False


@dataclass(frozen=True)
class Impact(Event):
    """Two bodies, or one and the ground, meet where the gap `function` between them closes, and part again.

    The impulse acts along the gap, through the masses of all that moves with it: with n = d gap/dq and u = d gap/dt,
    qdot becomes qdot + M^-1 n' P, with the P for which u becomes -restitution * u; constraints stay what they are.
    Impacts at one instant act one after the other, in the order of the model.

    Where bounces become too small to be told, the contact rests: the gap is held at zero by a force, until that would
    have to pull (see `runner.frame.contact`). The force is an output: `force`, or force_ and the name; unit: its own,
    found from the gap where it is not given. Beside it rests_ and the name is 1 while the contact rests, else 0.
    """

    direction: int = -1
    restitution: Expr | float = 1.0
    force: Symbol | None = None
    unit: str = ""

    @property
    def force_symbol(self) -> Symbol:
        """The contact force."""
        return self.force if self.force is not None else Symbol(f"force_{self.name}")

    @property
    def rests_symbol(self) -> Symbol:
        """What is 1 while the contact rests."""
        return Symbol(f"rests_{self.name}")


def problems_of_impacts(system: "System") -> Iterator[str]:
    """What is wrong with the impacts of a model, beside what is with any event."""
    positions = {coordinate.symbol for coordinate in system.coordinates}
    moving = {coordinate.rate for coordinate in system.coordinates}
    for event in system.events:
        if not isinstance(event, Impact):
            continue
        place, e = f"impact {event.name}", event.restitution
        gap = system.written_out(event.function).free_symbols
        if event.then:
            yield f"{place} has then, which follows from its restitution; leave it out, or give an Event"
        if event.direction != -1:
            yield f"{place} has the direction {event.direction!r}, but a gap closes, -1; leave it out"
        if gap & moving or not gap & positions:
            yield f"{place}: its gap is {event.function}, expected a distance made of coordinates, and of no velocity"
        if not isinstance(e, Expr) and (isinstance(e, bool) or not isinstance(e, int | float) or not 0 <= e <= 1):
            yield f"{place} has the restitution {e!r}, expected a number from 0 to 1, or an expression"


def kinds_of_impacts(system: "System") -> Iterator[str]:
    """Impacts whose force is no symbol, or in no unit."""
    for event in system.events:
        if isinstance(event, Impact) and not isinstance(event.force, Symbol | None):
            yield f"impact {event.name} has the force {event.force!r}, expected a SymPy Symbol"
        if isinstance(event, Impact) and event.unit and (wrong := problem(event.unit)):
            yield f"impact {event.name}: the unit of its force is {event.unit!r}: {wrong}"


def problems_of_events(system: "System") -> Iterator[str]:
    """What is wrong with the events of a model."""
    movable = {symbol.name for symbol in states_of(system)}
    seen: set[str] = set()
    for event in system.events:
        if not isinstance(event.name, str) or (reason := name_problem(event.name)):
            told = "is no text" if not isinstance(event.name, str) else reason
            yield f"event {str(event.name)[:LONGEST]!r} {told}; choose another name"
            continue
        place = f"event {event.name}"
        if event.name in seen:
            yield f"{place} is there twice"
        seen.add(event.name)
        if not isinstance(event.meaning, str) or not event.meaning.strip() or not event.meaning.isprintable():
            yield f"{place} has no meaning"
        if isinstance(event.direction, bool) or event.direction not in (-1, 0, 1):
            yield f"{place} has the direction {event.direction!r}, expected 1 (rising), -1 (falling) or 0 (both)"
        if not isinstance(event.terminal, bool):
            yield f"{place} has terminal = {event.terminal!r}, expected True or False"
        for symbol in event.then:
            if str(symbol) not in movable:
                yield f"{place} sets {symbol}, which is no coordinate, velocity or state; only these take a new value"


def states_of(system: "System") -> tuple[Symbol, ...]:
    """All that is integrated, in order: coordinates, velocities, internal states."""
    coordinates, states = system.coordinates, system.states
    return (*(c.symbol for c in coordinates), *(c.rate for c in coordinates), *(state.symbol for state in states))


def event_expressions(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of the functions of events, then of the values that they give, in the order of the kernel."""
    yield from ((f"event {event.name}", event.function) for event in system.events)
    for event in system.events:
        for symbol, value in event.then.items():
            yield f"event {event.name}: {symbol}", value


def restitutions(system: "System") -> Iterator[tuple[str, Any]]:
    """(place, expression) of what impacts give back."""
    yield from ((f"impact {event.name}", event.restitution) for event in system.events if isinstance(event, Impact))
