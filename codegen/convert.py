"""SymPy expressions of a model as SymEngine expressions that can be differentiated and printed."""

from typing import Any

import symengine as se
from sympy import Abs, Expr, Heaviside, Max, Min, Piecewise, Rational, Symbol, sign
from sympy.core.function import Application

from model.system import ModelError

#: Functions of one argument that `math` has under the same name, apart from those named here.
MATH_NAMES = {
    **{name: name for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")},
    **{name: name for name in ("asinh", "acosh", "atanh", "log", "exp", "erf")},
    "atan2": "atan2",
}

_SUPPORTED = MATH_NAMES.keys() | {"Piecewise", "Heaviside", "sign", "Abs", "Max", "Min"}


def convert(place: str, expression: Any) -> Any:
    """Give the SymEngine form of an expression; jumps and kinks become piecewise, which has a derivative.

    Raises ModelError naming the place and a function that has no compiled form.
    """
    if not isinstance(expression, Expr):
        return se.sympify(expression)
    if functions := expression.atoms(Application):
        for function in sorted(functions, key=str):
            if type(function).__name__ not in _SUPPORTED:
                raise ModelError(
                    f"{place} uses {function}: {type(function).__name__} has no compiled form; "
                    f"there are {', '.join(sorted(_SUPPORTED))}"
                )
        expression = expression.replace(_is_kinked, _piecewise)
    if not expression.is_extended_real and expression.has(1j):
        raise ModelError(f"{place} is complex: {expression}")
    return se.sympify(expression)


def _is_kinked(node: Any) -> bool:
    return isinstance(node, Abs | sign | Max | Min | Heaviside)


def _piecewise(node: Any) -> Expr:
    if isinstance(node, Abs):
        (x,) = node.args
        return Piecewise((x, x >= 0), (-x, True))
    if isinstance(node, sign):
        (x,) = node.args
        return Piecewise((1, x > 0), (-1, x < 0), (0, True))
    if isinstance(node, Heaviside):
        x, at_zero = node.args if len(node.args) == 2 else (node.args[0], Rational(1, 2))
        return Piecewise((0, x < 0), (1, x > 0), (at_zero, True))
    first, *others = node.args
    chosen = first
    for other in others:
        condition = chosen >= other if isinstance(node, Max) else chosen <= other
        chosen = Piecewise((chosen, condition), (other, True))
    return chosen


def symbol(name: Symbol | str) -> Any:
    """The SymEngine symbol of that name; assumptions are SymPy's affair."""
    return se.Symbol(str(name))
