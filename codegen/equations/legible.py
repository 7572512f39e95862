"""The shortest way to write a derived expression: as it came, brackets opened, or angle sums and factors gathered."""

from collections.abc import Set
from typing import Any

import symengine as se

from qddot.codegen.identities import gathered, polynomial, spread, total, with_angle_sums, without_squares
from qddot.codegen.rewrite import MINUS_ONE, factors
from qddot.codegen.rules import flatten

#: An expression that would open to more terms than this stays closed.
_MANY = 2000


def legible(expression: Any, fixed: Set[Any]) -> Any:
    """The same value with the least to read; `fixed`, the symbols that are constant in a run, are gathered in front."""
    flat = flatten(expression)
    if all(map(_is_plain, _parts(flat))):
        return min((flat, *gathered(polynomial(flat), fixed)), key=_weight)
    if spread(flat) > _MANY:
        return flat
    opened = with_angle_sums(without_squares(polynomial(se.expand(flat))))
    return min((flat, _distributed(flat), total(opened), *gathered(opened, fixed)), key=_weight)


def _is_plain(term: Any) -> bool:
    """Whether a term is a product of symbols and their powers, with nothing to open in it."""
    return not any(part.args and not (isinstance(part, se.Pow) and part.args[0].is_Symbol) for part in factors(term))


def _weight(expression: Any, depth: int | None = None) -> int:
    """What there is to read: operations; a function counts three, a bracket within a bracket six more.

    depth: in how many sums the expression stands; a product by itself is read as a sum of one term.
    """
    if depth is None:
        depth = 0 if isinstance(expression, se.Add) else 1
    arguments = expression.args
    if not arguments:
        return 0
    inside = sum(_weight(part, depth + isinstance(expression, se.Add)) for part in arguments)
    if isinstance(expression, se.Add):
        return inside + len(arguments) - 1 + (6 if depth > 1 else 0)
    if isinstance(expression, se.Mul):
        return inside + len(arguments) - 1 - (arguments[0] == MINUS_ONE)
    return inside + (1 if isinstance(expression, se.Pow) else 3)


def _parts(expression: Any) -> tuple[Any, ...]:
    return expression.args if isinstance(expression, se.Add) else (expression,)


def _distributed(expression: Any) -> Any:
    """The outermost bracket of a product opened: c*(x**2 + (y - x)**2) -> c*x**2 + c*(y - x)**2."""
    found = []
    for term in _parts(expression):
        bracket = next((part for part in term.args if isinstance(part, se.Add) and isinstance(term, se.Mul)), None)
        found += [term / bracket * part for part in bracket.args] if bracket is not None else [term]
    return se.Add(*found)
