"""The wall behind the templates: a module is parsed, and its names and numbers checked, before it replaces anything.

What fails here should have been refused where the model was checked; it stops what nobody thought of.
"""

import ast
import builtins
import re
from collections import Counter
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

from qddot.model.system import ModelError

_INTEGERS = 2**63
#: Where a function begins, and what it is called.
_DECORATED = re.compile(r"^(?=@)", re.MULTILINE)
_FUNCTION = re.compile(r"^def (\w+)\(", re.MULTILINE)


def check_module(text: str) -> None:
    """Raise ModelError, with the line in question, where a generated module could not be compiled or used.

    It is read function by function: Python's tree of a text takes a hundred times the room that the text takes.
    """
    known = set(_FUNCTION.findall(text))
    for part in _DECORATED.split(text):
        try:
            tree = ast.parse(part)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            line = _line(part, getattr(error, "lineno", None) or 0)
            raise ModelError(f"what it gives is no Python: {line}{error.args[0]}") from error
        known |= {*_imported(tree.body), *_defined(tree.body)}
        for statement in tree.body:
            _check(statement, known, part)


def _check(statement: ast.stmt, known: Set[str], text: str) -> None:
    found = _found(statement.body if isinstance(statement, ast.FunctionDef) else [statement])
    for constant in found.constants:
        if not _is_sound(constant.value):
            raise ModelError(f"{_line(text, constant.lineno)}a number that no double or integer of 64 bits holds")
    if isinstance(statement, ast.FunctionDef):
        _check_kernel(statement, found, known, text)


@dataclass
class _Found:
    """What stands in statements: names that are set and read, constants, and calls."""

    stored: list[ast.Name]
    read: list[ast.Name]
    constants: list[ast.Constant]
    calls: list[ast.Call]


def _check_kernel(function: ast.FunctionDef, found: _Found, known: Set[str], text: str) -> None:
    """Each name means one thing: an argument, a local that is assigned once, or what the module or Python has."""
    own = Counter(argument.arg for argument in function.args.args) + Counter(node.id for node in found.stored)
    stored, read = _first_lines(found.stored), _first_lines(found.read)
    used = {*_called(found.calls), *(name for name, line in read.items() if line <= stored.get(name, -inf))}
    for name, times in own.items():
        if times > 1 or name in used:
            raise ModelError(f"{name} is a name that the generated function {function.name} needs itself; rename it")
    for name, line in read.items():
        if name not in own and name not in known and not hasattr(builtins, name):
            raise ModelError(f"{_line(text, line)}{name} is no number, and no name that {function.name} knows")


def _first_lines(nodes: Sequence[ast.Name]) -> dict[str, int]:
    """The first line of each name."""
    first: dict[str, int] = {}
    for node in nodes:
        if node.lineno < first.get(node.id, inf):
            first[node.id] = node.lineno
    return first


def _found(statements: Sequence[ast.stmt]) -> _Found:
    """What stands in statements, in some order: `ast.walk` takes five times as long."""
    found, stack = _Found([], [], [], []), list[Any](statements)
    while stack:
        node = stack.pop()
        kind = type(node)
        if kind is ast.Name:
            (found.read if type(node.ctx) is ast.Load else found.stored).append(node)
        elif kind is ast.Constant:
            found.constants.append(node)
        elif kind is ast.BinOp:
            stack += (node.left, node.right)
        elif kind is ast.Subscript:
            stack += (node.value, node.slice)
        elif kind is ast.Assign:
            stack += (*node.targets, node.value)
        else:
            if kind is ast.Call:
                found.calls.append(node)
            stack += ast.iter_child_nodes(node)
    return found


def _called(calls: Sequence[ast.Call]) -> Iterator[str]:
    """Functions that are called, and the modules whose functions are."""
    homes = (call.func.value if isinstance(call.func, ast.Attribute) else call.func for call in calls)
    return (home.id for home in homes if isinstance(home, ast.Name))


def _imported(module: list[ast.stmt]) -> Iterator[str]:
    imports = (each for each in module if isinstance(each, ast.Import | ast.ImportFrom))
    return (alias.asname or alias.name.partition(".")[0] for each in imports for alias in each.names)


def _defined(module: list[ast.stmt]) -> Iterator[str]:
    targets = (target for each in module if isinstance(each, ast.Assign) for target in each.targets)
    return (target.id for target in targets if isinstance(target, ast.Name))


def _is_sound(value: object) -> bool:
    if isinstance(value, float):
        return isfinite(value)
    return abs(value) < _INTEGERS if isinstance(value, int) else not isinstance(value, complex)


def _line(text: str, number: int) -> str:
    """The line of the text, to stand in front of what is wrong with it."""
    lines = text.splitlines()
    line = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    return f"`{line if len(line) <= 100 else line[:97] + '...'}`: " if line else ""
