"""Kinks and jumps as cases: Abs, sign, Max, Min and Heaviside as Piecewise, which is differentiated by branches."""

from typing import Any

from sympy import ITE, Abs, And, Basic, Expr, Heaviside, Max, Min, Not, Or, Piecewise, Rational, false, oo, sign, true
from sympy.core.relational import GreaterThan, LessThan, StrictGreaterThan, StrictLessThan

#: Functions that are written as cases.
KINKED = (Abs, sign, Max, Min, Heaviside)
_INEQUALITIES = (GreaterThan, LessThan, StrictGreaterThan, StrictLessThan)


def cases(expression: Any) -> Any:
    """The same expression, each kink a Piecewise and each condition made of comparisons, And, Or and Not alone.

    SymPy moves a Piecewise out of a comparison, which leaves an ITE (if, then, else) of comparisons.
    """
    if not isinstance(expression, Expr) or not expression.has(Piecewise, *KINKED):
        return expression
    expression = unbounded(expression)
    return expression.replace(lambda node: isinstance(node, KINKED), _cases).replace(ITE, _junctions)


def unbounded(expression: Any) -> Any:
    """The same expression without comparisons with infinity, as Interval(0, oo).contains(x) has them: all are known."""
    if not isinstance(expression, Basic) or not expression.has(oo, -oo):
        return expression
    return expression.replace(lambda node: isinstance(node, _INEQUALITIES) and _known(node) is not None, _known)


def _known(node: Any) -> Any:
    """Whether a comparison with infinity holds; None for another."""
    small, large = node.lts, node.gts
    if oo in (small, large):
        return true if large == oo else false
    return (true if small == -oo else false) if -oo in (small, large) else None


def _cases(node: Any) -> Expr:
    if isinstance(node, Max | Min):
        return _extreme(node)
    x = node.args[0]
    if isinstance(node, Abs):
        return Piecewise((x, x >= 0), (-x, True))
    if isinstance(node, sign):
        return Piecewise((1, x > 0), (-1, x < 0), (0, True))
    at_zero = node.args[1] if len(node.args) > 1 else Rational(1, 2)
    return Piecewise((0, x < 0), (1, x > 0), (at_zero, True))


def _extreme(node: Any) -> Expr:
    """The first argument that no later one exceeds; those before it were exceeded, by it or by a later one."""
    arguments, largest = node.args, isinstance(node, Max)
    branches = []
    for i, first in enumerate(arguments[:-1]):
        beyond = (first >= later if largest else first <= later for later in arguments[i + 1 :])
        branches.append((first, And(*beyond)))
    return Piecewise(*branches, (arguments[-1], true))


def _junctions(condition: Any, yes: Any, no: Any) -> Any:
    return Or(And(condition, yes), And(Not(condition), no))
