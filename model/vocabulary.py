"""What an expression of a model may hold: the nodes that derivation, lowering and printing all know.

All else is refused by name, with what to write instead.
"""

import math
from collections.abc import Iterator
from typing import Any

import sympy
from sympy import Add, Basic, Expr, Integer, Mul, Number, Piecewise, Pow, Rational, Symbol, postorder_traversal
from sympy.core.function import AppliedUndef
from sympy.core.relational import Equality, GreaterThan, LessThan, StrictGreaterThan, StrictLessThan, Unequality
from sympy.functions.elementary.piecewise import ExprCondPair
from sympy.logic.boolalg import BooleanFalse, BooleanTrue

from qddot.model.kinks import KINKED, cases, unbounded
from qddot.model.naming import t
from qddot.model.table import Value

#: Functions that have a derivative wherever they have a value.
SMOOTH = (
    *(sympy.sin, sympy.cos, sympy.tan, sympy.asin, sympy.acos, sympy.atan, sympy.atan2, sympy.sinh, sympy.cosh),
    *(sympy.tanh, sympy.asinh, sympy.acosh, sympy.atanh, sympy.exp, sympy.log, sympy.erf),
)
_CONDITIONS = (Equality, Unequality, GreaterThan, LessThan, StrictGreaterThan, StrictLessThan, ExprCondPair)
_JUNCTIONS = (sympy.And, sympy.Or, sympy.Not, sympy.ITE, BooleanTrue, BooleanFalse)
_CONSTANTS = (type(sympy.pi), type(sympy.E))
#: Kinds of which every node may stand in a model, whatever it is made of: most nodes are one of these.
_PLAIN = frozenset((Symbol, Add, Mul))
#: Kinds that may be complex where all that they hold is real.
_COMPLEX_AT_TIMES = (Pow, *SMOOTH)
_ALLOWED = frozenset((Symbol, Add, Mul, Pow, Piecewise, *SMOOTH, *KINKED, *_CONDITIONS, *_JUNCTIONS, *_CONSTANTS))

#: The greatest whole number that may stand in an exponent, and how deep kinks may stand in conditions of kinks.
_LARGEST_EXPONENT, _DEEPEST = 2**31 - 1, 3
#: The most characters of a term that a message shows.
_LONGEST = 80

_COMPLEX = "it is complex, and a model is real"
_NO_NUMBERS = {type(sympy.zoo): "something is divided by zero", type(sympy.I): _COMPLEX}
_TIME = "write plain symbols for coordinates and velocities, not functions of time"
_JUMPS = "it jumps; write its pieces as a Piecewise, or give it as an input"
_UNDONE = "write it out: .doit() does, where SymPy can"
_NOT_REAL = "all symbols are real here; declare them so, Symbol('x', real=True), and SymPy leaves it out"
_NO_FORM = f"there are {', '.join(sorted(each.__name__ for each in (*SMOOTH, *KINKED, Piecewise)))}"
_INSTEAD = {
    **dict.fromkeys(("Sum", "Product", "Integral", "Derivative", "Limit", "Subs", "UnevaluatedExpr"), _UNDONE),
    **dict.fromkeys(("re", "im", "conjugate", "adjoint", "transpose", "arg", "exp_polar", "polar_lift"), _NOT_REAL),
    **dict.fromkeys(("floor", "ceiling", "frac", "Mod", "LeviCivita", "KroneckerDelta"), _JUMPS),
    **{"DiracDelta": "an impulse is no force; give it as an input", "Xor": "write it with And, Or and Not"},
    **{"sec": "write 1/cos", "csc": "write 1/sin", "cot": "write cos/sin", "acot": "write atan(1/x)"},
    **{"sech": "write 1/cosh", "csch": "write 1/sinh", "coth": "write cosh/sinh", "acoth": "write atanh(1/x)"},
    **{"asec": "write acos(1/x)", "acsc": "write asin(1/x)", "asech": "write acosh(1/x)", "acsch": "write asinh(1/x)"},
    **{"erfc": "write 1 - erf", "sinc": "write Piecewise((sin(x)/x, Ne(x, 0)), (1, True))"},
    **dict.fromkeys(("MatrixElement", "Indexed"), "write a plain Symbol, such as Symbol('q_1')"),
    **dict.fromkeys(("ImmutableDenseMatrix", "ImmutableSparseMatrix"), "take its entry, [0, 0]"),
    **{"MatrixSymbol": "write its entries as Symbols", "Order": "remove it: .removeO()"},
}


def refusals(expression: Any) -> Iterator[str]:
    """For each kind of node that an expression must not hold: the term, why, and what to write instead."""
    if not isinstance(expression, Basic):
        return
    expression = unbounded(expression)
    told: set[str] = set()
    seen: set[Basic] = set()
    waiting = [(expression, expression)]
    while waiting:
        node, around = waiting.pop()
        if node in seen:
            continue
        seen.add(node)
        reason = None if type(node) in _PLAIN else _reason(node)
        if reason is None:
            waiting += ((part, node) for part in node.args)
        elif reason not in told:
            told.add(reason)
            yield f"{_short(node if node.args else around)}: {reason}"
    if told or not expression.has(Piecewise, *KINKED):
        return
    if _depth(expression) > _DEEPEST:
        hint = "give the inner ones names, as quantities"
        yield f"{_short(expression)}: kinks stand more than {_DEEPEST} deep within each other; {hint}"
    elif reason := complex_comparison(expression):
        yield reason


def complex_comparison(expression: Expr) -> str | None:
    """Which part compares what is complex in one of its cases, as Abs(log(sign(x))) does, and why not; None without."""
    at_times = (part for part in expression.atoms(*_COMPLEX_AT_TIMES) if not _is_whole_power(part))
    if not any(part.has(Piecewise, *KINKED) for part in at_times) or _has_cases(expression):
        return None
    part = next(part for part in postorder_traversal(expression) if isinstance(part, Expr) and not _has_cases(part))
    return f"{_short(part)}: in one of its cases it compares what is complex, and a model is real"


def _is_whole_power(node: Any) -> bool:
    return isinstance(node, Pow) and isinstance(node.exp, Integer)


def _has_cases(expression: Any) -> bool:
    try:
        cases(expression)
    except TypeError:  # SymPy's: "Invalid comparison of non-real I*pi"
        return False
    return True


def _reason(node: Any) -> str | None:
    """Why a node may not stand in a model, or None."""
    kind = type(node)
    if isinstance(node, Number):
        return _number(node)
    if kind in _NO_NUMBERS:
        return _NO_NUMBERS[kind]
    if isinstance(node, sympy.NumberSymbol) and kind not in _CONSTANTS:
        return f"write its value, {float(node)!r}"
    if applied := node.atoms(AppliedUndef) if kind not in _ALLOWED else ():
        moving = any(t in function.args for function in applied)
        return _TIME if moving else "it has no formula; write one, or give it as an input"
    if kind not in _ALLOWED and not isinstance(node, Value):
        return f"{kind.__name__} has no compiled form; {_INSTEAD.get(kind.__name__, _NO_FORM)}"
    return _value(node)


def _value(node: Any) -> str | None:
    """Why a node of a kind that is allowed has no real value all the same, or None."""
    if isinstance(node, Piecewise):
        if node.args[-1].cond == True:  # noqa: E712 - SymPy's true
            return None
        return "its last branch has a condition, and it has no value elsewhere; write True instead of that condition"
    if isinstance(node, _COMPLEX_AT_TIMES) and node.is_number and node.is_extended_real is False:
        return _COMPLEX
    return _power(*node.args) if isinstance(node, Pow) else None


def _power(base: Any, exponent: Any) -> str | None:
    if isinstance(base, Number) and (base < 0) == True and not isinstance(exponent, Integer):  # noqa: E712
        return f"a negative number to a power that is no whole number: {_COMPLEX}"
    if base == 0:
        return "zero to a power has no derivative"
    if isinstance(exponent, Integer) and abs(exponent) > _LARGEST_EXPONENT:
        return f"the exponent is beyond {_LARGEST_EXPONENT}"
    return None


def _depth(node: Any) -> int:
    """How many kinks stand within each other at most."""
    return max(map(_depth, node.args), default=0) + isinstance(node, (Piecewise, *KINKED))


def _number(node: Any) -> str | None:
    if node is sympy.nan:
        return "it is no number: zero is divided by zero, or infinities are subtracted"
    if node in (sympy.oo, -sympy.oo):
        return "it is infinite"
    value = _float(node)
    if math.isinf(value):
        return "it is too large for a floating-point number, which ends at 1.8e308"
    if value == 0 and not node.is_zero:
        return "it is too small for a floating-point number, which ends at 4.9e-324"
    return None


def _float(node: Any) -> float:
    try:
        return float(node.p / node.q if isinstance(node, Rational) else node)
    except OverflowError:
        return math.inf


def _short(node: Any) -> str:
    text = " ".join(str(node).split())
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]} ..."
