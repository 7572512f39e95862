"""SymPy expressions of a model as SymEngine expressions that can be differentiated and printed."""

from typing import Any

import symengine as se
from sympy import Basic, Float, Function, Integer, Symbol

from qddot.model.kinks import cases
from qddot.model.table import ORDERS, Value
from qddot.model.vocabulary import SMOOTH

#: What a derivative of a table has behind its name, in expressions.
_PRIME = "'"
#: Functions by their names in SymEngine, and in `math`.
MATH_NAMES = {each.__name__: each.__name__ for each in SMOOTH}


def convert(expression: Any) -> Any:
    """Give the SymEngine form of a checked expression; jumps and kinks become piecewise, which has a derivative.

    The n-th derivative of a table is a function of its name with n primes: `calculus` differentiates it.
    """
    written = cases(expression)
    if isinstance(written, Basic) and written.has(Value):
        written = written.replace(lambda node: isinstance(node, Value), _primed)
    zeros = written.atoms(Float) if isinstance(written, Basic) else ()
    return se.sympify(written.xreplace({each: Integer(0) for each in zeros if each.is_zero}) if zeros else written)


def _primed(value: Value) -> Any:
    return Function(f"{value.table.name}{value.order * _PRIME}")(*value.args)


def looked_up(value: Any) -> tuple[str, int]:
    """The name of the table of which it is a value, or the derivative of this order."""
    primed = value.get_name()
    name = primed.rstrip(_PRIME)
    return name, len(primed) - len(name)


def slope(value: Any) -> Any:
    """The derivative of a table's value by its argument."""
    return se.Function(value.get_name() + _PRIME)(*value.args)


def function_name(value: Any) -> str:
    """The name that the function of a table's value has in a generated module."""
    name, order = looked_up(value)
    return f"{name}{ORDERS[order]}"


def symbol(name: Symbol | str) -> Any:
    """The SymEngine symbol of that name; assumptions are SymPy's affair."""
    return se.Symbol(str(name))
