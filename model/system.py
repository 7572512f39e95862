"""What a mechanical model is: coordinates, states, parameters, inputs, quantities, T, Pi, Phi, forces and outputs.

Plain symbols stand for q and qdot (not functions of time). A `System` checks itself at birth, see `check`.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

from sympy import Expr, Integer, Symbol, sympify

from qddot.model.assumptions import plain, unkept
from qddot.model.check import kinds, problems, symbols_given
from qddot.model.constraints import Constraint, Rolling, constrained, reaction_symbol, reaction_unit
from qddot.model.contact import Contact, compliance, problems_of_contacts
from qddot.model.contents import HELD, reached, tables
from qddot.model.definitions import as_expression, as_sum, definitions, in_order
from qddot.model.dimensions import Dimensions, said
from qddot.model.events import Event
from qddot.model.naming import LONGEST, dotted, t
from qddot.model.resting import force_unit, resting
from qddot.model.scene import Shape
from qddot.model.table import Table

__all__ = [
    "Coordinate",
    "Input",
    "ModelError",
    "Output",
    "Parameter",
    "Prescribed",
    "Quantity",
    "State",
    "System",
    "t",
]

_ENERGIES = ("kinetic_energy", "potential_energy", "dissipation")


class ModelError(ValueError):
    """A model that is no physics, or cannot be written down; the message names every culprit."""


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate q with its velocity qdot; `velocity` defaults to the dotted name (q_6 -> qdot_6)."""

    symbol: Symbol
    unit: str
    meaning: str
    velocity: Symbol | None = None

    @property
    def rate(self) -> Symbol:
        """The generalized velocity."""
        return self.velocity or dotted(self.symbol)

    @property
    def acceleration(self) -> Symbol:
        """The generalized acceleration: outputs may use it."""
        return dotted(self.rate)


@dataclass(frozen=True)
class State:
    """An internal state z with its own equation of first order, dz/dt = derivative: an actuator, a filter, an integral.

    The derivative may depend on q, qdot, t, parameters, inputs, quantities and the states, in any form. `rate_symbol`
    names it (default: the dotted name, z -> zdot); forces, quantities and outputs may use that name.
    """

    symbol: Symbol
    derivative: Expr
    unit: str
    meaning: str
    rate_symbol: Symbol | None = None

    @property
    def rate(self) -> Symbol:
        """The name of the time derivative."""
        return self.rate_symbol or dotted(self.symbol)


@dataclass(frozen=True)
class Parameter:
    """A number that is constant during a run."""

    symbol: Symbol
    default: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class Input:
    """A prescribed function of time; `rate` names its time derivative (default: the dotted name, z_1 -> zdot_1).

    position: where along the way of travel it acts, in m ahead of the model's origin, in parameters and quantities made
    of them alone. Inputs that have one can read one road, each at its own time.
    """

    symbol: Symbol
    unit: str
    meaning: str
    rate_symbol: Symbol | None = None
    position: Expr | float | None = None

    @property
    def rate(self) -> Symbol:
        """The time derivative: any expression may use it."""
        return self.rate_symbol or dotted(self.symbol)


@dataclass(frozen=True)
class Prescribed(Input):
    """A prescribed motion: an input whose course has a rate and an acceleration, so that T may hold it with its rate.

    The trolley of a crane, a shaken base, a crank that is turned: the equations need the second derivative, a channel
    of its own (the dotted name of the rate, s -> sdot -> sddot), and so does a constraint on positions that holds it.
    A run takes courses alone whose rate does not jump.
    """

    @property
    def acceleration(self) -> Symbol:
        """The second time derivative: all but T and Pi may use it."""
        return dotted(self.rate)


@dataclass(frozen=True)
class Quantity:
    """A named expression that keeps its name in the generated code, the LaTeX and, as an output, in the results.

    It may use coordinates, velocities, states, parameters, inputs, time and earlier quantities. With `rate`, its time
    derivative is derived and has that name.
    """

    symbol: Symbol
    expression: Expr
    unit: str
    meaning: str
    rate: Symbol | None = None


@dataclass(frozen=True)
class Output:
    """A named expression that is computed at the saved points; it may use accelerations too."""

    symbol: Symbol
    expression: Expr
    unit: str
    meaning: str


@dataclass(frozen=True)
class System:
    """A model: d/dt(dT/dqdot) - dT/dq + dPi/dq + dPhi/dqdot = Q for each coordinate, dz/dt = derivative for each state.

    kinetic_energy T, potential_energy Pi, dissipation Phi (Rayleigh's function, half of the dissipated power where it
    is quadratic), each an expression or a sequence of terms that are added up, and the generalized forces Q may depend
    on q, qdot, t, states, parameters, inputs and quantities in any form. A Pi that depends on qdot is a generalized
    potential (L = T - Pi throughout; Goldstein, Classical Mechanics, 1.5). A state z is to the energies what an input
    is, a function of time that no variation of q changes: its rate may stand in Q, and in none of them.

    Symbols are real. They may be declared so (`Symbol("x", real=True)`), a parameter also as what its values are
    (positive=True); the system holds plain symbols of the same names.

    constraints: what holds the coordinates to each other; M qddot + G' lambda = f then. The multipliers are outputs by
    name, and so are the reactions, the generalized forces -G' lambda (reaction_x on x). The state is kept on the
    constraints after each step; or, with baumgarte = (alpha, beta) in parameters, f'' + 2 alpha f' + beta^2 f = 0 takes
    the place of f'' = 0 and nothing else keeps it there (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1-16).

    events: what acts on the state where a function crosses zero. contacts: what pushes where a gap is closed; of a
    checked system they have become events, or quantities with what they add to Pi and Phi, and outputs.

    outputs: `Output`s, and quantities to be computed as outputs under their own names.
    scene: how the model looks, see `scene`; nothing that is computed depends on it.
    parameter_sets: name -> {parameter symbol: value}, what differs from the defaults.

    Raises ModelError, naming each culprit.
    """

    name: str
    title: str
    coordinates: Sequence[Coordinate]
    parameters: Sequence[Parameter]
    kinetic_energy: Expr
    potential_energy: Expr = field(default_factory=lambda: Integer(0))
    dissipation: Expr = field(default_factory=lambda: Integer(0))
    generalized_forces: Mapping[Symbol, Expr] = field(default_factory=dict)
    inputs: Sequence[Input] = ()
    quantities: Sequence[Quantity] = ()
    outputs: Sequence[Output | Quantity] = ()
    parameter_sets: Mapping[str, Mapping[Symbol, float]] = field(default_factory=dict)
    states: Sequence[State] = ()
    constraints: Sequence[Constraint | Rolling] = ()
    baumgarte: Sequence[Expr] | None = None
    events: Sequence[Event] = ()
    contacts: Sequence[Contact] = ()
    scene: Sequence[Shape] = ()

    def __post_init__(self) -> None:
        for name in (*HELD, "events", "scene"):
            object.__setattr__(self, name, _tuple(getattr(self, name)))
        for name in _ENERGIES:
            object.__setattr__(self, name, as_sum(getattr(self, name)))
        if self.baumgarte is not None:
            object.__setattr__(self, "baumgarte", tuple(map(as_expression, _tuple(self.baumgarte))))
        self._refuse(unkept(self))
        for each in fields(self):
            object.__setattr__(self, each.name, plain(getattr(self, each.name)))
        if self.contacts:
            for check in (kinds, symbols_given, problems_of_contacts):
                self._refuse(list(check(self)))
            self._take_in(self.contacts)
        self._refuse(problems(self))

    def _take_in(self, contacts: Sequence[Contact]) -> None:
        """Make of contacts what they are: events, or quantities, energy, dissipation and outputs."""
        given: dict[str, Any] = {name: getattr(self, name) for name in ("quantities", "outputs", "events", *_ENERGIES)}
        dimensions = Dimensions(self)
        for contact in contacts:
            if contact.stiffness is None:
                given["events"] += (contact.impact,)
                continue
            found, unit = compliance(contact), dimensions.of(contact.gap)
            gap, force = (
                Quantity(**{"unit": said(unit) if unit is not None else "m", **row}) for row in found.quantities
            )
            known = [quantity.symbol in contact.gap.free_symbols for quantity in given["quantities"]]
            place = max((k + 1 for k, used in enumerate(known) if used), default=0)
            given["quantities"] = (*given["quantities"][:place], gap, force, *given["quantities"][place:])
            given["outputs"] += () if force in given["outputs"] else (force,)
            given["potential_energy"] += found.potential
            given["dissipation"] += found.dissipation
        for name, value in {**given, "contacts": ()}.items():
            object.__setattr__(self, name, value)

    def _refuse(self, found: Sequence[str]) -> None:
        if found:
            raise ModelError(f"model {str(self.name)[:LONGEST]}: " + "\n  ".join(found))

    def force(self, coordinate: Coordinate) -> Expr:
        """The generalized force of a coordinate; zero where none is given."""
        return as_expression(self.generalized_forces.get(coordinate.symbol, 0))

    @cached_property
    def output_expressions(self) -> tuple[Output, ...]:
        """Outputs in order, multipliers, reactions, contact forces; a quantity as an output stands for itself."""
        given = (
            Output(item.symbol, item.symbol, item.unit, item.meaning) if isinstance(item, Quantity) else item
            for item in self.outputs
        )
        multipliers = (Output(c.symbol, c.symbol, c.unit, c.meaning) for c in self.constraints)
        reactions = (
            Output(
                reaction_symbol(c), reaction_symbol(c), reaction_unit(c), f"force of the constraints on: {c.meaning}"
            )
            for c in constrained(self)
        )
        contacts = (
            Output(each.force_symbol, each.force_symbol, force_unit(self, each), f"contact force: {each.meaning}")
            for each in resting(self)
        )
        return (*given, *multipliers, *reactions, *contacts)

    @cached_property
    def definitions(self) -> dict[Symbol, Expr]:
        """Symbol -> expression of all that is named: quantities in order, each one's rate behind it, rates of states.

        Each is made of symbols that are no definitions, and of earlier ones.
        """
        return in_order(definitions(self))

    @cached_property
    def tables(self) -> tuple[Table, ...]:
        """The tables that the expressions hold, by name."""
        return tables(self)

    def written_out(self, expression: Expr | float) -> Expr:
        """An expression with everything named replaced by what it stands for."""
        written = sympify(expression)
        needed = reached(self, written)
        for symbol, definition in self.definitions.items():
            if symbol in needed and symbol not in self._written:
                self._written[symbol] = definition.xreplace(self._written)
        return written.xreplace(self._written)

    @cached_property
    def _written(self) -> dict[Symbol, Expr]:
        """The definitions that have been written out so far."""
        return {}


def _tuple(value: object) -> tuple[object, ...]:
    return tuple(value) if isinstance(value, Iterable) else (value,)
