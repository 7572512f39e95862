"""The wall behind the templates: a module is parsed, and its names and numbers checked, before it replaces anything.

What fails here should have been refused where the model was checked; it stops what nobody thought of.
"""

import ast
import builtins
from collections import Counter
from collections.abc import Iterator
from math import inf, isfinite

from qddot.model.system import ModelError

_INTEGERS = 2**63


def check_module(text: str) -> None:
    """Raise ModelError, with the line in question, where a generated module could not be compiled or used."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = _line(text, getattr(error, "lineno", None) or 0)
        raise ModelError(f"what it gives is no Python: {line}{error.args[0]}") from error
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and not _is_sound(node.value):
            raise ModelError(f"{_line(text, node.lineno)}a number that no double or integer of 64 bits holds")
    for statement in tree.body:
        if isinstance(statement, ast.FunctionDef):
            _check_kernel(statement, tree.body, text)


def _check_kernel(function: ast.FunctionDef, module: list[ast.stmt], text: str) -> None:
    """Each name means one thing: an argument, a local that is assigned once, or what the module or Python has."""
    stored, read = _lines(function, ast.Store), _lines(function, ast.Load)
    own = Counter(argument.arg for argument in function.args.args) + Counter(name for name, _ in stored)
    first = {name: line for name, line in reversed(stored)}
    used = set(_called(function))
    used |= {name for name, line in read if line <= first.get(name, -inf)}
    for name, times in own.items():
        if times > 1 or name in used:
            raise ModelError(f"{name} is a name that the generated function {function.name} needs itself; rename it")
    known = {*own, *_imported(module), *_defined(module)}
    for name, line in read:
        if name not in known and not hasattr(builtins, name):
            raise ModelError(f"{_line(text, line)}{name} is no number, and no name that {function.name} knows")


def _lines(function: ast.FunctionDef, context: type[ast.expr_context]) -> list[tuple[str, int]]:
    """Names that are stored or loaded, each with its line, from top to bottom."""
    nodes = (node for part in function.body for node in ast.walk(part) if isinstance(node, ast.Name))
    found = [(node.id, node.lineno) for node in nodes if isinstance(node.ctx, context)]
    return sorted(found, key=lambda pair: pair[1])


def _called(function: ast.FunctionDef) -> Iterator[str]:
    """Functions that are called, and the modules whose functions are."""
    nodes = (node for part in function.body for node in ast.walk(part))
    calls = (node.func for node in nodes if isinstance(node, ast.Call))
    homes = (called.value if isinstance(called, ast.Attribute) else called for called in calls)
    return (home.id for home in homes if isinstance(home, ast.Name))


def _imported(module: list[ast.stmt]) -> Iterator[str]:
    imports = (each for each in module if isinstance(each, ast.Import | ast.ImportFrom))
    return (alias.asname or alias.name.partition(".")[0] for each in imports for alias in each.names)


def _defined(module: list[ast.stmt]) -> Iterator[str]:
    yield from (each.name for each in module if isinstance(each, ast.FunctionDef))
    targets = (target for each in module if isinstance(each, ast.Assign) for target in each.targets)
    yield from (target.id for target in targets if isinstance(target, ast.Name))


def _is_sound(value: object) -> bool:
    if isinstance(value, float):
        return isfinite(value)
    return abs(value) < _INTEGERS if isinstance(value, int) else not isinstance(value, complex)


def _line(text: str, number: int) -> str:
    """The line of the text, to stand in front of what is wrong with it."""
    lines = text.splitlines()
    line = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    return f"`{line if len(line) <= 100 else line[:97] + '...'}`: " if line else ""
