"""Kinetic energy as a sum of squares, T = sum m w^2 / 2 with w = sum J_i(q) v_i: the equations of d'Alembert.

Where all w are rates of positions, sum m J_i dw/dt = Q_i, and the rate of w is that of its products g(q) v_i. So
neither products J_i J_j nor Christoffel's terms are ever written down: a pendulum of n links takes 4 n sums over lower
orders, from M and f it takes 3 n^2.
"""

from collections.abc import Iterator
from typing import Any

import symengine as se

from qddot.codegen.calculus import dot
from qddot.codegen.lagrange import Equations
from qddot.codegen.nodes import operands, symbols_of
from qddot.codegen.printer import Printer
from qddot.codegen.rewrite import ONE, ZERO, is_number

#: (i, g): a product g v_i; g is 1, or a sine or cosine of something linear in the coordinates.
Place = tuple[int, Any]


def squares(equations: Equations) -> dict[Place, dict[Place, Any]] | None:
    """K of T = 1/2 sum K[i, g][j, h] (g v_i) (h v_j), constant; None where T has another form."""
    q, v = set(equations.coordinates), set(equations.velocities)
    if equations.definitions.base_symbols(equations.potential) & v:
        return None
    weights: dict[Place, dict[Place, list[Any]]] = {}
    try:
        for factor, speed in _terms(equations, _expanded(equations, equations.kinetic), se.Integer(1)):
            parts = list(_parts(equations, speed, q))
            for place, number in parts:
                row, share = weights.setdefault(place, {}), 2 * factor * number
                for other, other_number in parts:
                    row.setdefault(other, []).append(share * other_number)
    except _OtherFormError:
        return None
    return {place: {other: se.Add(*found) for other, found in row.items()} for place, row in weights.items()}


class _OtherFormError(Exception):
    pass


def _expanded(equations: Equations, expression: Any) -> Any:
    """An expression with the quantities that move written out."""
    definitions = equations.definitions.expressions
    for symbol, value in reversed(definitions.items()):
        if symbol in symbols_of(expression) and not equations.parameter_only(symbol):
            expression = expression.subs({symbol: value})
    return expression


def _terms(equations: Equations, expression: Any, factor: Any) -> Iterator[tuple[Any, Any]]:
    """(factor, w) of the terms factor * w^2."""
    if isinstance(expression, se.Add):
        for term in sorted(operands(expression), key=Printer({})):
            yield from _terms(equations, term, factor)
        return
    parts = operands(expression) if isinstance(expression, se.Mul) else (expression,)
    fixed = [part for part in parts if equations.parameter_only(part)]
    moving = [part for part in parts if not equations.parameter_only(part)]
    factor = factor * se.Mul(*fixed)
    if len(moving) == 1 and isinstance(moving[0], se.Add):
        yield from _terms(equations, moving[0], factor)
    elif moving and all(isinstance(part, se.Pow) and operands(part)[1] == 2 for part in moving):
        yield factor, se.Mul(*(operands(part)[0] for part in moving))
    else:
        raise _OtherFormError


def _parts(equations: Equations, speed: Any, q: set[Any]) -> Iterator[tuple[Place, Any]]:
    """((i, g), number) of the terms number * g * v_i of a speed."""
    held = symbols_of(speed)
    slopes = [se.expand(speed.diff(rate)) if rate in held else ZERO for rate in equations.velocities]
    _check_rate(equations, slopes)
    rest = speed - dot(slopes, equations.velocities)
    for i, slope in enumerate(slopes):
        for term in sorted(operands(slope) if isinstance(slope, se.Add) else (slope,), key=Printer({})):
            if term != ZERO:
                number, g = _split(equations, term)
                if g != ONE and not _is_turning(equations, g, q):
                    raise _OtherFormError
                yield (i, g), number
    if se.expand(rest) != ZERO:
        raise _OtherFormError


def _check_rate(equations: Equations, slopes: list[Any]) -> None:
    """That a speed is the rate of a position: dJ_i/dq_j = dJ_j/dq_i; a quasi-velocity's equations have more terms."""
    place = {q: i for i, q in enumerate(equations.coordinates)}
    for i, slope in enumerate(slopes):
        for q in symbols_of(slope) & place.keys():
            other = slopes[place[q]].diff(equations.coordinates[i])
            if place[q] != i and se.expand(slope.diff(q) - other) != 0:
                raise _OtherFormError


def _split(equations: Equations, term: Any) -> tuple[Any, Any]:
    parts = operands(term) if isinstance(term, se.Mul) else (term,)
    fixed = [part for part in parts if is_number(part) or equations.parameter_only(part)]
    return se.Mul(*fixed), se.Mul(*(part for part in parts if part not in fixed))


def _is_turning(equations: Equations, g: Any, q: set[Any]) -> bool:
    """Whether g is the sine or cosine of something linear in the coordinates."""
    if not isinstance(g, se.sin | se.cos):
        return False
    argument = operands(g)[0]
    slopes = [argument.diff(each) for each in symbols_of(argument) & q]
    found = equations.definitions.base_symbols(argument) - set(equations.parameters)
    return found <= q and all(equations.parameter_only(slope) for slope in slopes)
