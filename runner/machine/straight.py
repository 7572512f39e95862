"""Straight-line functions compiled without numba's analysis of types: their text is turned into LLVM's instructions.

A generated kernel is assignments of floats, stores into arrays and calls, all types known beforehand. Numba infers them
anyway, in a time that grows faster than the text: the Jacobian of a pendulum of 16 links, written out, takes 80 s with
it and 8 s without. What comes of it is the same code, so that a kernel gives the same numbers either way.
"""

import ast
import builtins
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from numba import types
from numba.core.errors import TypingError

from qddot.runner.machine.memory import intrinsic_of
from qddot.runner.machine.straight_code import StraightCode, StrayError, check


def straight(function: FunctionType, space: Mapping[str, Any] | None = None, *, whole: bool = False) -> FunctionType:
    """The same function with a body of instructions, to be jitted; numba's TypingError then where it is no such line.

    Its arguments, two, three or five, are float64, arrays of them that do not overlap, or whatever has items that are
    read and written one by one. space: what its global names mean, in place of its own. whole: it is not taken apart,
    however long it is. It lies where the function lies, so that numba keeps it in that place; the text is not read
    before it is compiled.
    """
    template = _OF_ARGUMENTS[function.__code__.co_argcount]
    code = template.__code__.replace(
        co_filename=function.__code__.co_filename,
        co_firstlineno=function.__code__.co_firstlineno,
        co_name=function.__name__,
        co_qualname=function.__qualname__,
    )
    names = {**vars(builtins), **function.__globals__, **(space or {})}
    own = {"__name__": function.__module__, "instructions": _instructions(function, names, whole=whole)}
    return FunctionType(code, own, function.__name__)


def _two(a, b):
    instructions(a, b)  # noqa: F821


def _three(a, b, c):
    instructions(a, b, c)  # noqa: F821


def _five(a, b, c, d, e):
    instructions(a, b, c, d, e)  # noqa: F821


_OF_ARGUMENTS: dict[int, Any] = {2: _two, 3: _three, 5: _five}


def _instructions(function: FunctionType, names: Mapping[str, Any], *, whole: bool) -> Any:
    """A function of compiled code that stands for the body of this one."""

    @cache
    def text() -> ast.FunctionDef:
        node = parsed(function.__code__)
        check(node, names)
        return node

    def typed(*kinds: Any) -> tuple[Any, Callable[..., Any]]:
        try:
            node = text()
        except StrayError as error:
            raise TypingError(f"{function.__name__} is no straight line: {error}") from None

        def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            code = StraightCode(context, builder, names, whole=whole)
            for argument, kind, value in zip(node.args.args, signature.args, values, strict=True):
                code.name(argument.arg, (kind, value))
            code.body(node.body)
            return context.get_dummy_value()

        return types.void(*kinds), emit

    return intrinsic_of(function.__code__.co_argcount, typed)


@cache
def parsed(code: CodeType) -> ast.FunctionDef:
    """The text of a function as a tree; StrayError where its file does not hold it, or not any more."""
    try:
        whole = Path(code.co_filename).read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise StrayError(error) from None
    lines = whole[code.co_firstlineno - 1 :]
    first = next((k for k, line in enumerate(lines) if line.startswith("def ")), len(lines))
    last = next((k for k in range(first + 1, len(lines)) if lines[k][:1].strip()), len(lines))
    imports = [line for line in whole if line == "import math"]  # Python compiles calls of what is imported otherwise
    text = "\n".join([*imports, *lines[first:last]])
    try:
        module, compiled = ast.parse(text), compile(text, code.co_filename, "exec")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise StrayError(error) from None
    own = next((each for each in compiled.co_consts if isinstance(each, CodeType)), None)
    node = module.body[-1] if module.body else None
    if own is None or _meaning(own) != _meaning(code) or not isinstance(node, ast.FunctionDef):
        raise StrayError("its file holds another text")
    return node


def _meaning(code: CodeType) -> tuple[Any, ...]:
    return code.co_code, code.co_consts, code.co_names, code.co_varnames
