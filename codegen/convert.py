"""SymPy expressions of a model as SymEngine expressions that can be differentiated and printed."""

from typing import Any

import symengine as se
from sympy import Symbol

from qddot.model.kinks import cases
from qddot.model.vocabulary import SMOOTH

#: Functions by their names in SymEngine, and in `math`.
MATH_NAMES = {each.__name__: each.__name__ for each in SMOOTH}


def convert(expression: Any) -> Any:
    """Give the SymEngine form of a checked expression; jumps and kinks become piecewise, which has a derivative."""
    return se.sympify(cases(expression))


def symbol(name: Symbol | str) -> Any:
    """The SymEngine symbol of that name; assumptions are SymPy's affair."""
    return se.Symbol(str(name))
