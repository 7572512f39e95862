"""Energies that jump as a coordinate or velocity moves: their force would be an impulse, which no derivative shows.
Constraints that jump, or whose derivatives do: positions or velocities would.

Found by numbers: both sides of the roots of what conditions compare, along random lines.
"""

import random
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any

from sympy import Expr, Piecewise, Symbol, lambdify
from sympy.core.relational import Equality, Relational, Unequality

from qddot.model.constraints import Constraint
from qddot.model.contents import energies, reached
from qddot.model.interpolation import SMOOTHNESS
from qddot.model.kinks import KINKED, cases
from qddot.model.naming import t
from qddot.model.table import Value

if TYPE_CHECKING:
    from qddot.model.system import System

Line = Callable[[float], float]

#: Lines through random points, how far they go to each side, points at which they are looked at.
_LINES, _REACHES, _SAMPLES = 4, (1.0, 0.01, 100.0), 40
#: Distances from a root, in parts of the reach, at which both sides are compared; a change this large beside the energy
#: that hardly shrinks with the distance is a jump.
_NEAR, _NEARER, _SHRINKING, _LARGE = 1e-6, 1e-9, 0.9, 1e-6


def jumps(system: "System") -> Iterator[str]:
    """Energies that jump, each with one place where it does."""
    positions = {coordinate.symbol for coordinate in system.coordinates}
    velocities = {coordinate.rate for coordinate in system.coordinates}
    moving = {"kinetic energy": positions | velocities, "potential energy": positions | velocities}
    for place, expression in energies(system):
        if not is_kinked(system, expression):
            continue
        written = cases(system.written_out(expression))
        found = _where_it_jumps(system, written, moving.get(place, velocities))
        if found is not None:
            yield (
                f"{place} jumps {found}: its force would be an impulse, which is lost; make it continuous there, or "
                "give the force as a generalized force"
            )


def jumps_of_constraints(system: "System") -> Iterator[str]:
    """Constraints that jump, or whose derivatives do where positions would have to, each with one place."""
    moving = {coordinate.symbol for coordinate in system.coordinates} | {t}
    moving |= {symbol for channel in system.inputs for symbol in (channel.symbol, channel.rate)}
    hint = "write it smoothly, or let a stiff spring stand for it"
    for each in system.constraints:
        written = cases(system.written_out(each.expression))
        if not written.has(Piecewise, Value):
            continue
        found = _where_it_jumps(system, written, moving)
        if found is not None:
            yield f"constraint {each.symbol} jumps {found}: nothing can follow it; make it continuous there"
            continue
        if not isinstance(each, Constraint):
            continue
        slopes = (written.diff(symbol) for symbol in sorted(written.free_symbols & moving, key=str))
        kinks = (_where_it_jumps(system, slope, moving) for slope in slopes)
        found = next((kink for kink in kinks if kink is not None), None)
        if found is not None:
            yield f"constraint {each.symbol} has a kink {found}, at which velocities would jump; {hint}"


def _where_it_jumps(system: "System", written: Expr, moving: set[Symbol]) -> str | None:
    """Where an expression in cases jumps as these symbols move, in words; None where it does not."""
    for value in sorted(written.atoms(Value), key=str):
        if value.smoothness < 0 and reached(system, value) & moving:
            within = SMOOTHNESS[value.table.interpolation] < max(value.orders)
            return f"at the {'points' if within else 'ends'} of the table {value.table.name}"
    for condition in sorted(written.atoms(Relational), key=str):
        variables = condition.free_symbols & moving
        if variables and not isinstance(condition, Equality | Unequality):
            found = _jump(system, written, condition.lhs - condition.rhs, sorted(variables, key=str))
            if found is not None:
                return f"where {condition.lhs} passes {condition.rhs}, as at {found}"
    return None


def is_kinked(system: "System", expression: Any) -> bool:
    """Whether an expression, or what it names, has cases or tables."""
    used = reached(system, expression)
    parts = [expression, *(each for symbol, each in system.definitions.items() if symbol in used)]
    return any(isinstance(part, Expr) and part.has(Piecewise, Value, *KINKED) for part in parts)


def _jump(system: "System", energy: Expr, difference: Expr, variables: Sequence[Symbol]) -> str | None:
    """Where an energy jumps at a root of the difference that moving the variables passes; None where it does not."""
    symbols = sorted(energy.free_symbols | difference.free_symbols, key=str)
    functions = [_function(each, symbols) for each in (energy, difference)]
    defaults = {parameter.symbol: float(parameter.default) for parameter in system.parameters}
    chance = random.Random(5)
    for reach in _REACHES:
        for _ in range(_LINES):
            base = {symbol: defaults.get(symbol, chance.uniform(-reach, reach)) for symbol in symbols}
            way = {symbol: chance.uniform(0.5, 1.0) * chance.choice((-1, 1)) for symbol in variables}

            def along(function: Callable[..., float], s: float, base: Any = base, way: Any = way) -> float:
                return function(*(base[symbol] + s * way.get(symbol, 0.0) for symbol in symbols))

            height, side = (partial(along, function) for function in functions)
            for root in _roots(side, 2 * reach):
                if _jumps(height, root, reach):
                    return ", ".join(f"{symbol} = {base[symbol] + root * way[symbol]:.4g}" for symbol in variables)
    return None


def _function(expression: Expr, symbols: Sequence[Symbol]) -> Callable[..., float]:
    """An expression as a function that gives no number where it has no value."""
    held = {value.func for value in expression.atoms(Value)}
    tables = {each.__name__: each.at for each in held}
    plain = lambdify(symbols, expression, modules=[tables, "math"])

    def guarded(*values: float) -> float:
        try:
            return float(plain(*values))
        except (ArithmeticError, ValueError, TypeError):
            return float("nan")

    return guarded


def _roots(side: Line, reach: float) -> Iterator[float]:
    """Where a function changes its sign between samples."""
    samples = [reach * (2 * k / _SAMPLES - 1) for k in range(_SAMPLES + 1)]
    for low, high in pairwise(samples):
        if side(low) * side(high) < 0:
            yield _root(side, low, high)


def _root(side: Line, low: float, high: float) -> float:
    """The root between two arguments, by halving."""
    first = side(low)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if side(middle) * first > 0 else (low, middle)
    return 0.5 * (low + high)


def _jumps(height: Line, root: float, reach: float) -> bool:
    """Whether a function changes across a root by what does not shrink with the distance from it."""
    (wide, _), (narrow, size) = (_change(height, root, part * reach) for part in (_NEAR, _NEARER))
    return isfinite(wide) and isfinite(size) and narrow > _SHRINKING * wide and narrow > _LARGE * size


def _change(height: Line, root: float, distance: float) -> tuple[float, float]:
    """The change of a function across a root, and how large it is there."""
    one, other = height(root - distance), height(root + distance)
    return abs(other - one), abs(other) + abs(one)
