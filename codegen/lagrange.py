"""Lagrange's equations of a system: M(q) qddot = f, from T, Pi, Phi and Q, in SymEngine.

With L = T - Pi:  d/dt(dL/dqdot) - dL/dq + dPhi/dqdot = Q, so that M = d^2 L/dqdot^2 and
f = Q - dPhi/dqdot + dL/dq - (d^2 L/dqdot dq) qdot - d/dt of dL/dqdot at fixed q and qdot.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import symengine as se

from codegen.calculus import Definitions
from codegen.convert import convert, symbol
from model.system import ModelError, System

Vector = tuple[Any, ...]


@dataclass(frozen=True)
class Equations:
    """Derived equations; all expressions are SymEngine's, quantities stay symbols (see `definitions`).

    mass: (k, j) with k >= j -> entry of the symmetric mass matrix, structural zeros left out.
    Per coordinate: gyroscopic (what d/dt(dL/dqdot) - dT/dq leaves beside M qddot), conservative (dPi/dq), dissipative
    (dPhi/dqdot), applied (Q); forces f = applied - dissipative - conservative - gyroscopic.
    dissipated_power: qdot . dPhi/dqdot; input_power: what makes d(T + Pi)/dt = input_power - dissipated_power.
    positions: name of an input that has a position -> its position.
    """

    system: System
    definitions: Definitions
    time: Any
    coordinates: Vector
    velocities: Vector
    accelerations: Vector
    parameters: Vector
    inputs: Vector
    rates: Vector
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

    @property
    def forces(self) -> Vector:
        """F in M qddot = f."""
        rows = zip(self.applied, self.dissipative, self.conservative, self.gyroscopic, strict=True)
        return tuple(se.Add(q, -phi, -pi, -g) for q, phi, pi, g in rows)

    def parameter_only(self, expression: Any) -> bool:
        """Whether an expression is constant during a run."""
        return self.definitions.base_symbols(expression) <= set(self.parameters)

    @property
    def mass_matrix(self) -> str:
        """Diagonal (and constant), constant, or configuration-dependent."""
        if not all(self.parameter_only(entry) for entry in self.mass.values()):
            return "configuration-dependent"
        return "diagonal" if all(k == j for k, j in self.mass) else "constant"


def derive(system: System) -> Equations:
    """Derive Lagrange's equations of a checked system.

    Raises ModelError where a function has no compiled form, or T or Pi depends on the rate of an input in a way that
    would need its second derivative.
    """
    q = tuple(symbol(coordinate.symbol) for coordinate in system.coordinates)
    v = tuple(symbol(coordinate.rate) for coordinate in system.coordinates)
    definitions = Definitions({symbol(s): convert(e) for s, e in system.definitions.items()})
    kinetic = convert(system.kinetic_energy)
    potential = convert(system.potential_energy)
    dissipation = convert(system.dissipation)
    applied = tuple(convert(system.force(c)) for c in system.coordinates)
    time, inputs = symbol("t"), tuple(symbol(channel.symbol) for channel in system.inputs)
    rates = tuple(symbol(channel.rate) for channel in system.inputs)
    _refuse_rates(system, definitions, kinetic, potential, rates)

    motion = _Motion(definitions, q, v, {time: se.Integer(1), **dict(zip(inputs, rates, strict=True))})
    momenta = _by(definitions.gradient(kinetic - potential, v), v)
    mass, gyroscopic = motion.mass(momenta), motion.gyroscopic(momenta, kinetic)
    dissipative = _by(definitions.gradient(dissipation, v), v)
    return Equations(
        system=system,
        definitions=definitions,
        time=time,
        coordinates=q,
        velocities=v,
        accelerations=tuple(symbol(c.acceleration) for c in system.coordinates),
        parameters=tuple(symbol(p.symbol) for p in system.parameters),
        inputs=inputs,
        rates=rates,
        kinetic=kinetic,
        potential=potential,
        dissipation=dissipation,
        mass=mass,
        gyroscopic=gyroscopic,
        conservative=_by(definitions.gradient(potential, q), q),
        dissipative=dissipative,
        applied=applied,
        dissipated_power=_dot(v, dissipative),
        input_power=motion.input_power(kinetic, potential, momenta, mass, applied, system),
        outputs=tuple(convert(o.expression) for o in system.output_expressions),
        positions=_positions(system),
    )


@dataclass(frozen=True)
class _Motion:
    """Derivatives along the motion. clock: what moves by itself (t and the inputs) -> how fast."""

    definitions: Definitions
    q: Vector
    v: Vector
    clock: Mapping[Any, Any]

    def mass(self, momenta: Vector) -> dict[tuple[int, int], Any]:
        rows = [self.definitions.gradient(momentum, self.v) for momentum in momenta]
        return {(k, j): rows[k][self.v[j]] for k in range(len(self.v)) for j in range(k + 1) if self.v[j] in rows[k]}

    def gyroscopic(self, momenta: Vector, kinetic: Any) -> Vector:
        """What is left of d/dt(dL/dqdot) - dT/dq beside M qddot."""
        slopes = _by(self.definitions.gradient(kinetic, self.q), self.q)
        return tuple(self._drift(p) - slope for p, slope in zip(momenta, slopes, strict=True))

    def _drift(self, expression: Any) -> Any:
        """d/dt at fixed velocities."""
        speeds = dict(zip(self.q, self.v, strict=True)) | dict(self.clock)
        gradient = self.definitions.gradient(expression, speeds)
        return se.Add(*(gradient[s] * speed for s, speed in speeds.items() if s in gradient))

    def _clockwork(self, expression: Any) -> Any:
        """The explicit part of d/dt: at fixed coordinates and velocities."""
        gradient = self.definitions.gradient(expression, self.clock)
        return se.Add(*(gradient[s] * speed for s, speed in self.clock.items() if s in gradient))

    def input_power(
        self, kinetic: Any, potential: Any, momenta: Vector, mass: Mapping[Any, Any], applied: Vector, system: System
    ) -> Any:
        """Power of Q and of the explicit time dependence; with T not quadratic in qdot, what T + Pi differs by too.

        With h = qdot . dL/dqdot - L, dh/dt = qdot . (Q - dPhi/dqdot) - dL/dt explicit (Goldstein, section 2.7), and
        T + Pi - h = 2 T - qdot . dL/dqdot, which vanishes where L is natural.
        """
        power = se.Add(_dot(self.v, applied), self._clockwork(potential), -self._clockwork(kinetic))
        rest = self._unnatural(kinetic, momenta, mass)
        if rest == 0:
            return power
        accelerations = [symbol(coordinate.acceleration) for coordinate in system.coordinates]
        slopes = _by(self.definitions.gradient(rest, self.v), self.v)
        return se.Add(power, self._drift(rest), _dot(accelerations, slopes))

    def _unnatural(self, kinetic: Any, momenta: Vector, mass: Mapping[Any, Any]) -> Any:
        """Give 2 T - qdot . dL/dqdot, or 0 where T is a homogeneous quadratic form of qdot and Pi has none."""
        at_rest = dict.fromkeys(self.v, se.Integer(0))
        still = self.definitions.substitute((kinetic, *momenta), at_rest)
        natural = (
            still is not None
            and all(part == 0 for part in still)
            and not any(self.definitions.base_symbols(entry) & set(self.v) for entry in mass.values())
        )
        return se.Integer(0) if natural else 2 * kinetic - _dot(self.v, momenta)


def _refuse_rates(system: System, definitions: Definitions, kinetic: Any, potential: Any, rates: Vector) -> None:
    for place, energy in (("kinetic", kinetic), ("potential", potential)):
        for rate in sorted(definitions.base_symbols(energy) & set(rates), key=str):
            raise ModelError(
                f"model {system.name}: the {place} energy depends on {rate}, the rate of an input, so the equations "
                "would need its second derivative; measure the coordinate from the moving base, and let the base's "
                "acceleration be an input"
            )


def _positions(system: System) -> dict[str, Any]:
    return {str(channel.symbol): convert(channel.position) for channel in system.inputs if channel.position is not None}


def _by(gradient: Mapping[Any, Any], variables: Sequence[Any]) -> Vector:
    return tuple(gradient.get(variable, se.Integer(0)) for variable in variables)


def _dot(left: Sequence[Any], right: Sequence[Any]) -> Any:
    return se.Add(*(a * b for a, b in zip(left, right, strict=True)))
