"""What holds a mechanism together: constraints on positions and on velocities, and what must be true of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from sympy import Add, Expr, Symbol, expand

from qddot.model.contents import accelerations, as_prescribed, declared, outputs, symbols
from qddot.model.dimensions import Dimension, Dimensions, dimension_of_unit, product, said
from qddot.model.kinks import cases
from qddot.model.naming import t

if TYPE_CHECKING:
    from qddot.model.system import Coordinate, System


#: Operations of an expression that is not opened.
_LONG = 400


@dataclass(frozen=True)
class Constraint:
    """f(q, t) = 0 with its multiplier lambda: M qddot + G' lambda = f, G the derivative of f by q.

    unit: the multiplier's, such that f times it is an energy: N where f is a length, N m where it is an angle or a
    number. The force of the constraint on a coordinate q is -lambda df/dq.
    """

    symbol: Symbol
    expression: Expr
    unit: str
    meaning: str


@dataclass(frozen=True)
class Rolling:
    """a(q, t) qdot + b(q, t) = 0, linear in the velocities, with its multiplier: a motion without slip, a blade.

    unit: the multiplier's, such that the expression times it is a power: N where the expression is a velocity. The
    force of the constraint on a coordinate is -lambda times the factor of its velocity.
    """

    symbol: Symbol
    expression: Expr
    unit: str
    meaning: str


def reaction_symbol(coordinate: "Coordinate") -> Symbol:
    """The symbol of the generalized force by which all constraints act on a coordinate: reaction_x."""
    return Symbol(f"reaction_{coordinate.symbol}")


def reaction_unit(coordinate: "Coordinate") -> str:
    """The unit of a generalized force on a coordinate."""
    return {"m": "N", "rad": "N m", "1": "J"}.get(coordinate.unit, f"J/({coordinate.unit})")


def constrained(system: "System") -> tuple["Coordinate", ...]:
    """The coordinates that some constraint acts on."""
    found: set[Symbol] = set()
    for each in system.constraints:
        free = symbols(system.written_out(each.expression))
        by = "symbol" if isinstance(each, Constraint) else "rate"
        found |= {c.symbol for c in system.coordinates if getattr(c, by) in free}
    return tuple(c for c in system.coordinates if c.symbol in found)


def moving_part(system: "System", constraint: Any) -> Expr:
    """What is linear in the velocities in the rate of a constraint on positions, or in one on velocities."""
    expression = cases(system.written_out(constraint.expression))
    on_positions = isinstance(constraint, Constraint)
    slopes = ((c.rate, expression.diff(c.symbol if on_positions else c.rate)) for c in system.coordinates)
    return Add(*(rate * slope for rate, slope in slopes))


def reactions(system: "System") -> Iterator[str]:
    """Names that reactions have and something else has, too; reactions that there are none of."""
    taken = {symbol: role for role, symbol in declared(system)}
    acted_on = {reaction_symbol(coordinate): coordinate for coordinate in constrained(system)}
    for symbol, coordinate in acted_on.items():
        if symbol in taken:
            yield f"{taken[symbol]} {symbol} has the name of the reaction on {coordinate.symbol}; choose another name"
    for place, expression in outputs(system):
        for coordinate in system.coordinates if system.constraints else ():
            symbol = reaction_symbol(coordinate)
            if symbol in symbols(expression) and symbol not in taken.keys() | acted_on.keys():
                yield f"{place} uses {symbol}, and no constraint acts on {coordinate.symbol}"


def problems_of_constraints(system: "System") -> Iterator[str]:
    """What is wrong with the constraints of a system whose expressions are sound."""
    if system.baumgarte is not None and not system.constraints:
        yield "baumgarte is given, and there are no constraints"
    yield from _baumgarte(system)
    written = [_opened(cases(system.written_out(each.expression))) for each in system.constraints]
    pairs = list(zip(system.constraints, written, strict=True))
    found = [message for each, expression in pairs for message in _problems(system, each, expression)]
    yield from found
    if not found:
        yield from _together(system, written)
        yield from _units(system)


def _problems(system: "System", each: Any, expression: Expr) -> Iterator[str]:
    check = _of_positions if isinstance(each, Constraint) else _of_velocities
    yield from (f"constraint {each.symbol} {message}" for message in check(system, expression))


def _of_positions(system: "System", expression: Expr) -> Iterator[str]:
    free = symbols(expression)
    for velocity in sorted(free & {c.rate for c in system.coordinates}, key=str):
        yield f"depends on {velocity}; what is linear in the velocities is written as Rolling"
        return
    if not free & {c.symbol for c in system.coordinates}:
        yield f"constrains no coordinate: it says {expression} = 0"
    for state in system.states:
        if free & {state.symbol, state.rate}:
            yield f"depends on the state {state.symbol}, whose second derivative the equations would need"
    for channel in system.inputs:
        if free & {channel.symbol, channel.rate} and not _is_prescribed(channel):
            yield (
                f"depends on the input {channel.symbol}, whose second derivative the equations need: "
                f"{as_prescribed(channel)}"
            )
        elif free & {channel.rate, *accelerations(channel)}:
            found = min(free & {channel.rate, *accelerations(channel)}, key=str)
            yield f"depends on {found}; what holds rates is written as Rolling, and nothing holds accelerations"


def _of_velocities(system: "System", expression: Expr) -> Iterator[str]:
    free, velocities = symbols(expression), [c.rate for c in system.coordinates]
    if not free & set(velocities):
        on_positions = bool(free & {c.symbol for c in system.coordinates})
        yield f"depends on no velocity{'; write it as Constraint' if on_positions else ''}"
    for velocity in velocities:
        slope = expression.diff(velocity)
        if symbols(slope) & set(velocities):  # in all its length only where it may cancel
            slope = expand(slope)
        if found := symbols(slope) & set(velocities):
            yield f"is not linear in the velocities: the factor of {velocity} depends on {min(map(str, found))}"
            return
    for channel in system.inputs:
        if channel.rate in free and not _is_prescribed(channel):
            yield (
                f"depends on {channel.rate}, the rate of an input, so the equations need its second derivative: "
                f"{as_prescribed(channel)}"
            )
        elif free & set(accelerations(channel)):
            yield f"depends on {next(accelerations(channel))}, whose derivative the equations would need"


def _is_prescribed(channel: Any) -> bool:
    return any(True for _ in accelerations(channel))


def _together(system: "System", written: Sequence[Expr]) -> Iterator[str]:
    moving = {c.symbol for c in system.coordinates} | {c.rate for c in system.coordinates} | {t}
    opened = [_opened(expression) for expression in written]
    kinds = [
        (type(each), symbols(expression) & moving) for each, expression in zip(system.constraints, opened, strict=True)
    ]
    for j, (each, expression) in enumerate(zip(system.constraints, opened, strict=True)):
        for k, (other, before) in enumerate(zip(system.constraints[:j], opened[:j], strict=True)):
            for sign in (1, -1) if kinds[j] == kinds[k] else ():  # else something that moves is left of either
                rest = _opened(expression - sign * before)
                if rest == 0:
                    yield f"constraints {other.symbol} and {each.symbol} say the same; leave one of them out"
                elif not symbols(rest) & moving:
                    yield f"constraints {other.symbol} and {each.symbol} contradict each other: they differ by {rest}"


def _baumgarte(system: "System") -> Iterator[str]:
    given = system.baumgarte
    if given is None:
        return
    if len(given) != 2:
        yield f"baumgarte has {len(given)} entries, expected two, alpha and beta of f'' + 2 alpha f' + beta^2 f = 0"
        return
    known = {p.symbol for p in system.parameters}
    for name, value in zip(("alpha", "beta"), given, strict=True):
        for symbol in sorted(symbols(system.written_out(value)) - known, key=str):
            yield f"baumgarte: {name} depends on {symbol}; it may depend on parameters alone"


def _units(system: "System") -> Iterator[str]:
    """Multipliers whose unit cannot be that of a force: told only where the dimension of the expression is certain."""
    dimensions = Dimensions(system)
    for each in system.constraints:
        own, given = dimensions.of(each.expression), dimension_of_unit(each.unit)
        effort = dimension_of_unit("J" if isinstance(each, Constraint) else "W")
        wanted: Dimension | None = product(((effort, Fraction(1)), (own, Fraction(-1))))
        if own is not None and wanted is not None and wanted != given:
            yield (
                f"the multiplier {each.symbol} is in {each.unit}, expected {said(wanted)}: what it multiplies is in "
                f"{said(own)}"
            )


def _opened(expression: Expr) -> Expr:
    """An expression opened, so that what cancels is gone; a long one as it is."""
    return expand(expression) if expression.count_ops() <= _LONG else expression
