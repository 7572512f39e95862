"""The equations of a system in SymEngine: Lagrange's, M(q) qddot = f, from T, Pi, Phi and Q, and those of its states.

With L = T - Pi:  d/dt(dL/dqdot) - dL/dq + dPhi/dqdot = Q, so that M = d^2 L/dqdot^2 and
f = Q - dPhi/dqdot + dL/dq - (d^2 L/dqdot dq) qdot - d/dt of dL/dqdot at fixed q and qdot.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import symengine as se

from qddot.codegen.calculus import Definitions, Vector, by, dot
from qddot.codegen.constrained import Constraints, contact, derive_constraints, in_order
from qddot.codegen.convert import convert, symbol
from qddot.codegen.modes import Modes
from qddot.codegen.motion import Motion
from qddot.codegen.nodes import forget
from qddot.codegen.ordering import Ordering, ordering
from qddot.codegen.rewrite import Names
from qddot.codegen.switches import Switches
from qddot.model.contents import accelerations, as_prescribed, declared
from qddot.model.definitions import as_expression
from qddot.model.events import event_expressions
from qddot.model.friction import Friction
from qddot.model.resting import resting
from qddot.model.scene import scene_numbers
from qddot.model.system import ModelError, System
from qddot.model.table import knots_of

#: Steps of an elimination that is written out, at most, or of one whose factors are sparse, so many a coordinate; see
#: `Ordering.steps`.
_LONGEST_ELIMINATION, _SPARSE = 400, 10


@dataclass(frozen=True)
class Equations:
    """Derived equations; all expressions are SymEngine's, quantities stay symbols (see `definitions`).

    mass: (k, j) with k >= j -> entry of the symmetric mass matrix, structural zeros left out.
    Per coordinate: gyroscopic (what d/dt(dL/dqdot) - dT/dq leaves beside M qddot), conservative (dPi/dq), dissipative
    (dPhi/dqdot), applied (Q); forces f = applied - dissipative - conservative - gyroscopic.
    states: the internal ones; state_rates: the names of their derivatives, which are among the definitions.
    dissipated_power: qdot . dPhi/dqdot; input_power: what makes d(T + Pi)/dt = input_power - dissipated_power.
    switches: the conditions in time, by their sides. modes: those in the state that the motion depends on.
    positions: name of an input that has a position -> its position.
    constraints: what they say; M qddot + G' lambda = f where there are any. events: their functions, then the values
    that they give to states. scene: the numbers of its shapes.
    contacts: what is 1 while an impact rests that can, else 0. resting: the constraints with those that contacts are.
    """

    system: System
    definitions: Definitions
    time: Any
    coordinates: Vector
    velocities: Vector
    accelerations: Vector
    states: Vector
    state_rates: Vector
    parameters: Vector
    inputs: Vector
    rates: Vector
    second_rates: Vector
    switches: Switches
    modes: Modes
    kinetic: Any
    potential: Any
    dissipation: Any
    mass: Mapping[tuple[int, int], Any]
    gyroscopic: Vector
    conservative: Vector
    dissipative: Vector
    applied: Vector
    dissipated_power: Any
    input_power: Any
    outputs: Vector
    positions: Mapping[str, Any]
    constraints: Constraints
    events: Vector
    scene: Vector
    contacts: Vector
    resting: Constraints

    @property
    def solution(self) -> frozenset[Any]:
        """The symbols of what the equations are solved for: accelerations, multipliers and reactions."""
        found = self.constraints
        return frozenset((*self.accelerations, *found.multipliers, *found.reactions.values()))

    @property
    def channels(self) -> Vector:
        """All that is given from outside: inputs, sides, contacts, rates, prescribed accelerations, and the modes."""
        sides, modes = self.switches.functions, self.modes.functions
        return (*self.inputs, *sides, *self.contacts, *self.rates, *self.second_rates, *modes)

    @cached_property
    def at_rest(self) -> "Equations":
        """These equations with the contacts among the constraints: those that do not rest say nothing in them."""
        if not self.contacts:
            return self
        held = self.resting
        forces = [symbol(impact.force_symbol) for impact in resting(self.system)]
        found = dict(zip(held.multipliers, held.driving, strict=True))
        pushed = {
            force: se.Piecewise((force, se.Lt(0, sign)), (se.Integer(0), True))
            for force, sign in zip(forces, self.contacts, strict=True)
        }
        return replace(
            self,
            constraints=held,
            input_power=self.input_power + se.Add(*(force * found[force] for force in forces)),
            outputs=tuple(output.subs(pushed) for output in self.outputs),
        )

    @property
    def conditions(self) -> Mapping[Any, Any]:
        """The conditions as they were written, by what stands for them: a side, or the one with a mode."""
        return {**self.switches.conditions, **self.modes.written}

    @property
    def state(self) -> Vector:
        """All that is integrated: [q, qdot, z]."""
        return (*self.coordinates, *self.velocities, *self.states)

    @property
    def forces(self) -> Vector:
        """F in M qddot = f."""
        rows = zip(self.applied, self.dissipative, self.conservative, self.gyroscopic, strict=True)
        return tuple(se.Add(q, -phi, -pi, -g) for q, phi, pi, g in rows)

    @property
    def written(self) -> tuple[Any, ...]:
        """All expressions that a reader is shown: of energies, equations of motion, constraints and outputs."""
        energies, held = (self.kinetic, self.potential, self.dissipation), self.constraints
        rows = (*self.mass.values(), *self.forces, *held.residuals, *held.rates, *held.matrix.values())
        return (*energies, *rows, *self.outputs)

    def parameter_only(self, expression: Any) -> bool:
        """Whether an expression is constant during a run."""
        return self.definitions.base_symbols(expression) <= set(self.parameters)

    @property
    def fixed_quantities(self) -> tuple[tuple[Any, Any], ...]:
        """Quantities that are constant during a run, with what defines them."""
        return tuple(item for item in self.definitions.expressions.items() if self.parameter_only(item[1]))

    @property
    def moving_quantities(self) -> tuple[tuple[Any, Any], ...]:
        """Those that are not."""
        return tuple(item for item in self.definitions.expressions.items() if not self.parameter_only(item[1]))

    @cached_property
    def solved_at_run_time(self) -> bool:
        """Whether a function of the runner solves for accelerations: of constraints, or of many coupled coordinates."""
        if self.constraints or self.mass_matrix != "configuration-dependent":
            return bool(self.constraints)
        return self.elimination.steps > max(_LONGEST_ELIMINATION, _SPARSE * len(self.coordinates))

    @cached_property
    def elimination(self) -> Ordering:
        """The order in which coordinates are eliminated from M qddot = f."""
        return ordering(self.mass, len(self.coordinates))

    @property
    def mass_matrix(self) -> str:
        """Diagonal (and constant), constant, or configuration-dependent."""
        if not all(self.parameter_only(entry) for entry in self.mass.values()):
            return "configuration-dependent"
        return "diagonal" if all(k == j for k, j in self.mass) else "constant"


def derive(system: System) -> Equations:
    """Derive Lagrange's equations of a checked system.

    Raises ModelError where a function has no compiled form, or T or Pi depends on the rate of an input that is no
    prescribed motion, whose second derivative the equations need.
    """
    forget()
    q = tuple(symbol(coordinate.symbol) for coordinate in system.coordinates)
    v = tuple(symbol(coordinate.rate) for coordinate in system.coordinates)
    degrees = {table.name: table.pieces.degree for table in system.tables}
    degrees |= {
        knots_of(table.name, k, table.count): each.degree
        for table in system.tables
        for k, each in enumerate(table.knots)
    }
    declared_ones = Definitions({symbol(s): convert(e) for s, e in system.definitions.items()}, degrees)
    time, inputs = symbol("t"), tuple(symbol(channel.symbol) for channel in system.inputs)
    fixed = frozenset(symbol(p.symbol) for p in system.parameters)
    names = Names(each for _, each in declared(system))
    switches = Switches(declared_ones, time, fixed, names)
    timed = {s: switches(e) for s, e in declared_ones.expressions.items()}
    energies = (system.kinetic_energy, system.potential_energy, system.dissipation)
    motion_of = [switches(convert(e)) for e in (*energies, *map(system.force, system.coordinates))]
    held = [switches(convert(each.expression)) for each in in_order(system)]
    state_rates = tuple(symbol(state.rate) for state in system.states)
    knots = {table.name: table.located for table in system.tables}
    modes = Modes(declared_ones, fixed | {time} | switches.functions.keys(), names, knots)
    needed = declared_ones.needed((*motion_of, *held, *state_rates))
    definitions = Definitions({s: modes(e) if s in needed else e for s, e in timed.items()}, degrees, fixed, names)
    kinetic, potential, dissipation, *applied = map(modes, motion_of)
    for friction in (each for each in system.quantities if isinstance(each, Friction)):
        modes.bound(convert(friction.velocity), convert(friction.ratio))
    outputs = tuple(switches(convert(o.expression)) for o in system.output_expressions)
    rates = tuple(symbol(channel.rate) for channel in system.inputs)
    second = {symbol(u.rate): symbol(each) for u in system.inputs for each in accelerations(u)}
    _refuse_rates(system, definitions, kinetic, potential, second)

    states = tuple(symbol(state.symbol) for state in system.states)
    moving = zip((*states, *inputs), (*state_rates, *rates), strict=True)
    motion = Motion(definitions, q, v, {time: se.Integer(1), **dict(moving), **second})
    momenta = by(definitions.gradient(kinetic - potential, v), v)
    mass = motion.mass(momenta)
    rest = motion.unnatural(kinetic, potential, momenta, mass)
    by_mass = rest == 0 and not motion.names_speeds(kinetic)
    dissipative = by(definitions.gradient(dissipation, v), v)
    contacts, held_to = resting(system), dict(zip(in_order(system), map(modes, held), strict=True))
    constraints = derive_constraints(system, held_to, motion) if held_to else Constraints()
    held_to |= {each: convert(each.expression) for each in (contact(system, impact) for impact in contacts)}
    return Equations(
        system=system,
        definitions=definitions,
        time=time,
        coordinates=q,
        velocities=v,
        accelerations=tuple(symbol(c.acceleration) for c in system.coordinates),
        states=states,
        state_rates=state_rates,
        parameters=tuple(symbol(p.symbol) for p in system.parameters),
        inputs=inputs,
        rates=rates,
        second_rates=tuple(second.values()),
        switches=switches,
        modes=modes,
        kinetic=kinetic,
        potential=potential,
        dissipation=dissipation,
        mass=mass,
        gyroscopic=motion.christoffel(mass) if by_mass else motion.gyroscopic(momenta, kinetic),
        conservative=by(definitions.gradient(potential, q), q),
        dissipative=dissipative,
        applied=tuple(applied),
        dissipated_power=dot(v, dissipative),
        input_power=motion.input_power(kinetic, potential, rest, tuple(applied), system)
        + dot(constraints.multipliers, constraints.driving),
        outputs=outputs,
        positions=_positions(system),
        constraints=constraints,
        events=tuple(convert(as_expression(value)) for _, value in event_expressions(system)),
        contacts=tuple(symbol(impact.rests_symbol) for impact in contacts),
        resting=derive_constraints(system, held_to, motion) if contacts else constraints,
        scene=tuple(switches(convert(as_expression(value))) for _, _, value in scene_numbers(system)),
    )


def _refuse_rates(
    system: System, definitions: Definitions, kinetic: Any, potential: Any, second: Mapping[Any, Any]
) -> None:
    """ModelError where d/dt of an energy would need a derivative of an input that is no channel."""
    names = {symbol(u.rate): u for u in system.inputs if symbol(u.rate) not in second}
    for place, energy in (("kinetic", kinetic), ("potential", potential)):
        held = definitions.base_symbols(energy)
        for rate in sorted(held & names.keys(), key=str):
            raise ModelError(
                f"model {system.name}: the {place} energy depends on {rate}, the rate of the input "
                f"{names[rate].symbol}, so the equations need its second derivative: {as_prescribed(names[rate])}"
            )
        for each in sorted(held & set(second.values()), key=str):
            raise ModelError(
                f"model {system.name}: the {place} energy depends on {each}, an acceleration, so the equations would "
                "need its derivative; give what depends on it as a generalized force"
            )


def _positions(system: System) -> dict[str, Any]:
    return {str(channel.symbol): convert(channel.position) for channel in system.inputs if channel.position is not None}
