"""Straight-line functions: assignments of floats, stores into arrays and calls, all types known beforehand.

A generated kernel is one, of up to thousands of lines. Numba infers the types anyway, in a time that grows faster than
the text: the Jacobian of a pendulum of 16 links, written out, takes 80 s with it and 8 s without. What comes of it is
the same code, so that a kernel gives the same numbers either way.
"""

import builtins
from collections.abc import Callable, Mapping
from functools import partial
from types import FunctionType
from typing import Any

from qddot.runner.machine.lowering import STRAIGHT
from qddot.runner.machine.straight_code import StraightCode, check
from qddot.runner.machine.text import parsed
from qddot.runner.machine.values import Typed


def straight(function: FunctionType, space: Mapping[str, Any] | None = None, *, whole: bool = False) -> FunctionType:
    """The same function, to be compiled by `inner`'s compilers: as a straight line, where it is one.

    Its arguments are float64, arrays of them that do not overlap, or whatever has items that are read and written one
    by one. space: what its global names mean, in place of its own. whole: it is not taken apart, however long it is.
    The text is not read before it is compiled.
    """
    names = {**function.__globals__, **(space or {})}
    made = FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)
    vars(made)[STRAIGHT] = partial(_instructions, function, {**vars(builtins), **names}, whole)
    return made


def _instructions(function: FunctionType, names: Mapping[str, Any], whole: bool) -> Callable[..., None]:
    """What emits the body of a function at the end of a block: (context, builder, typed arguments by name).

    StrayError where its text is no straight line. names: what its global ones mean.
    """
    node = parsed(function.__code__)
    check(node, names)

    def emit(context: Any, builder: Any, arguments: Mapping[str, Typed]) -> None:
        code = StraightCode(context, builder, names, whole=whole)
        for name, value in arguments.items():
            code.name(name, value)
        code.body(node.body)
        context.call_conv.return_value(builder, context.get_dummy_value())

    return emit
