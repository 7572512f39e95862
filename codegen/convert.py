"""SymPy expressions of a model as SymEngine expressions that can be differentiated and printed."""

from collections.abc import Sequence
from typing import Any

import symengine as se
from sympy import Add, Float, Function, Integer, Mul, Pow, Symbol, sympify

from qddot.codegen.nodes import remembered
from qddot.codegen.symbols import named, with_symbols
from qddot.model.kinks import cases
from qddot.model.nodes import atoms
from qddot.model.table import HELD, Value, ending
from qddot.model.vocabulary import SMOOTH

#: What a derivative of a table has behind its name, in expressions: one by the first argument, one by the second.
_PRIMES = ("'", '"')
#: What the name of a value has behind it whose pieces are held by modes.
_HELD = "|"
#: Functions by their names in SymEngine, and in `math`.
MATH_NAMES = {each.__name__: each.__name__ for each in SMOOTH}
#: What makes a node of SymEngine of converted parts.
_BUILT_BY = {Add: se.Add, Mul: se.Mul, Pow: se.Pow, **{each: getattr(se, each.__name__) for each in SMOOTH}}


def convert(expression: Any) -> Any:
    """Give the SymEngine form of a checked expression; jumps and kinks become piecewise, which has a derivative.

    The n-th derivative of a table is a function of its name with n primes, of two kinds where it has two arguments:
    `calculus` differentiates it.
    """
    return _made(sympify(cases(expression)))


@remembered
def _made(node: Any) -> Any:
    """The SymEngine form of a node; what expressions share is made once."""
    if isinstance(node, Symbol):
        return symbol(node)
    if isinstance(node, Float) and not node:
        return se.Integer(0)
    if not node.args:
        return se.sympify(node)
    build = se.Function(_name_of(node)) if isinstance(node, Value) else _BUILT_BY.get(type(node))
    return build(*map(_made, node.args)) if build else _walked(node)


def _walked(node: Any) -> Any:
    """The SymEngine form of a node that SymEngine takes apart itself: conditions and choices among them."""
    if atoms(node, Value):
        node = node.replace(lambda part: isinstance(part, Value), lambda part: Function(_name_of(part))(*part.args))
    zeros = [each for each in atoms(node, Float) if not each]
    return with_symbols(se.sympify(node.xreplace(dict.fromkeys(zeros, Integer(0))) if zeros else node))


def _name_of(value: Value) -> str:
    return primed(value.table.name, value.orders)


def primed(table: str, orders: Sequence[int]) -> str:
    """The name that a derivative of a table has in expressions; orders: by each of its arguments."""
    return table + "".join(order * prime for order, prime in zip(orders, _PRIMES, strict=False))


def held(value: Any, modes: Sequence[Any]) -> Any:
    """The same value of a table with the modes that hold its pieces, one for each argument."""
    table, orders = looked_up(value)
    return se.Function(primed(f"{table}{_HELD}", orders))(*value.args, *modes)


def is_held(value: Any) -> bool:
    """Whether modes hold the pieces of a table's value: they are the second half of its arguments."""
    return _HELD in value.get_name()


def looked_up(value: Any) -> tuple[str, tuple[int, ...]]:
    """The name of the table of which it is a value, or the derivative of these orders by its arguments."""
    name = value.get_name()
    orders = tuple(name.count(prime) for prime in _PRIMES[: len(arguments(value))])
    return name.rstrip("".join(_PRIMES)).removesuffix(_HELD), orders


def arguments(value: Any) -> tuple[Any, ...]:
    """What a table is looked up at, without modes."""
    given: tuple[Any, ...] = value.args
    return given[: len(given) // 2] if is_held(value) else given


def free(value: Any) -> Any:
    """The value of a table without the modes that hold it."""
    return se.Function(primed(*looked_up(value)))(*arguments(value))


def slope(value: Any, argument: int) -> Any:
    """The derivative of a table's value by an argument, counted from 0; held as the value is."""
    table, orders = looked_up(value)
    higher = [order + (k == argument) for k, order in enumerate(orders)]
    return se.Function(primed(f"{table}{_HELD if is_held(value) else ''}", higher))(*value.args)


def function_name(value: Any) -> str:
    """The name that the function of a table's value has in a generated module."""
    name, orders = looked_up(value)
    return f"{name}{ending(orders)}{HELD if is_held(value) else ''}"


def symbol(name: Symbol | str) -> Any:
    """The SymEngine symbol of that name; assumptions are SymPy's affair."""
    return named(name if isinstance(name, str) else name.name)
