"""Derivatives along the motion: the mass matrix, what stands beside M qddot, and the power put in."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import symengine as se

from qddot.codegen.calculus import Definitions, Vector, by, dot
from qddot.codegen.convert import symbol
from qddot.codegen.kernel import Kernel, Slot
from qddot.codegen.nodes import symbols_of
from qddot.codegen.rules import tidy
from qddot.codegen.zeros import without_zeros
from qddot.model.system import System


@dataclass(frozen=True)
class Motion:
    """Derivatives along the motion. clock: what no coordinate moves (t, the states, the inputs) -> how fast."""

    definitions: Definitions
    q: Vector
    v: Vector
    clock: Mapping[Any, Any]

    def mass(self, momenta: Vector) -> dict[tuple[int, int], Any]:
        """The entries d^2 L/dqdot_k dqdot_j, k >= j, that do not vanish."""
        place = {speed: j for j, speed in enumerate(self.v)}
        rows = [self.definitions.gradient(momentum, set(self.v[: k + 1])) for k, momentum in enumerate(momenta)]
        pairs = ((k, j) for k, row in enumerate(rows) for j in sorted(place[speed] for speed in row))
        entries = {(k, j): tidy(rows[k][self.v[j]]) for k, j in pairs}
        return {pair: entry for pair, entry in self._without_zeros(entries).items() if entry != 0}

    def _without_zeros(self, entries: Mapping[tuple[int, int], Any]) -> dict[tuple[int, int], Any]:
        quantities = tuple(self.definitions.expressions.items())
        used = frozenset().union(*(symbols_of(e) for e in (*self.definitions.expressions.values(), *entries.values())))
        writes = tuple((Slot("mass", pair), entry) for pair, entry in entries.items())
        kernel = without_zeros(Kernel(used - self.definitions.expressions.keys(), quantities, writes))
        return {pair: entry for pair, (_, entry) in zip(entries, kernel.writes, strict=True)}

    def names_speeds(self, kinetic: Any) -> bool:
        """Whether T is written in quantities that depend on velocities, such as those of points."""
        named = self.definitions.needed((kinetic,))
        return any(map(self._holds_speeds, (self.definitions.expressions[s] for s in named)))

    @cached_property
    def _speeds(self) -> frozenset[Any]:
        return frozenset(self.v)

    def _holds_speeds(self, expression: Any) -> bool:
        return not self._speeds.isdisjoint(self.definitions.base_symbols(expression))

    def gyroscopic(self, momenta: Vector, kinetic: Any) -> Vector:
        """What is left of d/dt(dL/dqdot) - dT/dq beside M qddot."""
        slopes = by(self.definitions.gradient(kinetic, self.q), self.q)
        return tuple(self.drift(p) - slope for p, slope in zip(momenta, slopes, strict=True))

    def christoffel(self, mass: Mapping[tuple[int, int], Any]) -> Vector:
        """The same where L is natural, from the derivatives of M; what cancels is never written down.

        With Christoffel's symbols (Goldstein, section 7.5), entry M_kj with its derivative by q_s gives
        qdot_j qdot_s dM_kj/dq_s to row k, the same with k and j exchanged to row j, and -qdot_k qdot_j dM_kj/dq_s to
        row s, half of that where k = j.
        """
        rows: list[list[Any]] = [[] for _ in self.q]
        row = {q: k for k, q in enumerate(self.q)}
        speeds = dict(zip(self.q, self.v, strict=True)) | dict(self.clock)
        for (k, j), entry in mass.items():
            share = se.Rational(1, 2) if k == j else se.Integer(1)
            for s, slope in self.definitions.gradient(entry, speeds.keys()).items():
                for one, other in ((k, j),) if k == j else ((k, j), (j, k)):
                    rows[one].append(slope * self.v[other] * speeds[s])
                if s in row:
                    rows[row[s]].append(-share * slope * self.v[k] * self.v[j])
        return tuple(se.Add(*found) for found in rows)

    def drift(self, expression: Any) -> Any:
        """d/dt at fixed velocities."""
        speeds = dict(zip(self.q, self.v, strict=True)) | dict(self.clock)
        gradient = self.definitions.gradient(expression, speeds.keys())
        return se.Add(*(gradient[s] * speed for s, speed in speeds.items() if s in gradient))

    def _clockwork(self, expression: Any) -> Any:
        """The explicit part of d/dt: at fixed coordinates and velocities."""
        gradient = self.definitions.gradient(expression, self.clock)
        return se.Add(*(gradient[s] * speed for s, speed in self.clock.items() if s in gradient))

    def input_power(self, kinetic: Any, potential: Any, rest: Any, applied: Vector, system: System) -> Any:
        """Power of Q and of the explicit time dependence; with T not quadratic in qdot, what T + Pi differs by too.

        With h = qdot . dL/dqdot - L, dh/dt = qdot . (Q - dPhi/dqdot) - dL/dt explicit (Goldstein, section 2.7), and
        T + Pi - h = 2 T - qdot . dL/dqdot, the `rest`, which vanishes where L is natural.
        """
        power = se.Add(dot(self.v, applied), self._clockwork(potential), -self._clockwork(kinetic))
        if rest == 0:
            return power
        accelerations = [symbol(coordinate.acceleration) for coordinate in system.coordinates]
        slopes = by(self.definitions.gradient(rest, self.v), self.v)
        return se.Add(power, self.drift(rest), dot(accelerations, slopes))

    def unnatural(self, kinetic: Any, potential: Any, momenta: Vector, mass: Mapping[Any, Any]) -> Any:
        """Give 2 T - qdot . dL/dqdot, or 0 where T is a homogeneous quadratic form of qdot and Pi has none."""
        at_rest = dict.fromkeys(self.v, se.Integer(0))
        still = self.definitions.substitute((kinetic, *momenta), at_rest)
        natural = (
            still is not None
            and all(part == 0 for part in still)
            and not any(map(self._holds_speeds, (potential, *mass.values())))
        )
        return se.Integer(0) if natural else 2 * kinetic - dot(self.v, momenta)
