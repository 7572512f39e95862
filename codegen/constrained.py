"""Constraints derived: M qddot + G' lambda = f with G qddot = gamma, and what vanishes of positions and velocities."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import symengine as se
from sympy import Piecewise

from qddot.codegen.calculus import Vector, by
from qddot.codegen.convert import convert, symbol
from qddot.codegen.motion import Motion
from qddot.codegen.rules import tidy
from qddot.model.constraints import Constraint, constrained, reaction_symbol
from qddot.model.events import Impact
from qddot.model.resting import force_unit
from qddot.model.system import System


@dataclass(frozen=True)
class Constraints:
    """What the constraints say, those on positions first; each entry SymEngine's, all empty where there are none.

    residuals: f(q, t), 0 for those on velocities. rates: their derivatives by time, or what is linear in the
    velocities: they vanish too. matrix: (j, k) -> entry of G, the derivative of rates by the velocities. slopes: (j, k)
    -> derivative of rates by the coordinates. driving: rates where all velocities vanish. drifts: gamma.
    reactions: coordinate -> the symbol of the force on it.
    """

    multipliers: Vector = ()
    residuals: Vector = ()
    rates: Vector = ()
    matrix: Mapping[tuple[int, int], Any] = field(default_factory=dict)
    slopes: Mapping[tuple[int, int], Any] = field(default_factory=dict)
    driving: Vector = ()
    drifts: Vector = ()
    reactions: Mapping[int, Any] = field(default_factory=dict)

    def pull(self, k: int) -> list[Any]:
        """What stands in the equation of coordinate k for the constraints, term by term: its row of G' lambda."""
        return [self.multipliers[j] * entry for (j, i), entry in self.matrix.items() if i == k]

    @property
    def n_positions(self) -> int:
        """How many are on positions."""
        return sum(residual != 0 for residual in self.residuals)

    def __len__(self) -> int:
        return len(self.multipliers)


def derive_constraints(system: System, expressions: Mapping[Any, Any], motion: Motion) -> Constraints:
    """The constraints of a checked system; expressions: theirs, of contacts that rest among them, by what they are."""
    given = positions_first(expressions)
    pairs = [_residual_and_rate(each, expressions[each], motion) for each in given]
    residuals, rates = zip(*pairs, strict=True)
    matrix = _entries(rates, motion, motion.v)
    drifts = [se.Add(*(-part for part in _moved(rate, motion))) for rate in rates]
    if system.baumgarte is not None:
        alpha, beta = map(convert, system.baumgarte)
        held = zip(drifts, rates, residuals, strict=True)
        drifts = [drift - 2 * alpha * rate - beta**2 * residual for drift, rate, residual in held]
    acted_on = constrained(system)
    return Constraints(
        multipliers=tuple(symbol(each.symbol) for each in given),
        residuals=residuals,
        rates=rates,
        matrix=matrix,
        slopes=_entries(rates, motion, motion.q),
        driving=tuple(_driving(rate, j, matrix, motion) for j, rate in enumerate(rates)),
        drifts=tuple(drifts),
        reactions={k: symbol(reaction_symbol(c)) for k, c in enumerate(system.coordinates) if c in acted_on},
    )


def contact(system: System, impact: Impact) -> Constraint:
    """The constraint that an impact is while it rests, and says nothing while it does not; its multiplier pushes."""
    expression = -Piecewise((1, impact.rests_symbol > 0), (0, True)) * impact.function
    return Constraint(impact.force_symbol, expression, force_unit(system, impact), impact.meaning)


def in_order(system: System) -> list[Any]:
    """The constraints of a system as kernels have them: those on positions first."""
    return positions_first(system.constraints)


def positions_first(constraints: Iterable[Any]) -> list[Any]:
    """Constraints as kernels have them."""
    return sorted(constraints, key=lambda each: not isinstance(each, Constraint))


def _residual_and_rate(constraint: Any, expression: Any, motion: Motion) -> tuple[Any, Any]:
    if not isinstance(constraint, Constraint):
        return se.Integer(0), expression
    return expression, motion.drift(expression)


def _entries(rates: Vector, motion: Motion, variables: Vector) -> dict[tuple[int, int], Any]:
    """Derivatives of the rates by variables, those that vanish left out; by velocities they hold none."""
    found: dict[tuple[int, int], Any] = {}
    for j, rate in enumerate(rates):
        for k, slope in enumerate(by(motion.definitions.gradient(rate, variables), variables)):
            linear = variables is motion.v and motion.definitions.base_symbols(slope) & set(motion.v)
            entry = tidy(se.expand(slope) if linear else slope)
            if entry != 0:
                found[j, k] = entry
    return found


def _moved(rate: Any, motion: Motion) -> list[Any]:
    """The terms of the derivative of a rate by time at fixed velocities."""
    moved = tidy(motion.drift(rate))
    return list(moved.args) if isinstance(moved, se.Add) else [moved]


def _driving(rate: Any, j: int, matrix: Mapping[tuple[int, int], Any], motion: Motion) -> Any:
    """What is left of a rate where nothing moves; 0 where the constraint does not depend on time."""
    found = motion.definitions.substitute((rate,), dict.fromkeys(motion.v, se.Integer(0)))
    return (
        rate - se.Add(*(entry * motion.v[k] for (i, k), entry in matrix.items() if i == j)) if not found else found[0]
    )
