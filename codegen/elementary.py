"""Elementary functions as text for loops over lanes: all of them, or those that a kernel calls."""

import ast
from functools import cache

from codegen.environment import environment

#: Name of the file in generated/ that holds all of them, for the runner's own loops over lanes.
FILE = "_elementary.py"


def module() -> str:
    """The text of a module with all functions, before the formatter."""
    return environment("python").get_template("elementary.py.jinja").render()


def names() -> tuple[str, ...]:
    """The names of all functions."""
    return tuple(_functions())


def definitions(lines: tuple[str, ...]) -> tuple[str, ...] | None:
    """The functions that these lines of a kernel call, those they need first; None where there is no such function."""
    known = _functions()
    wanted = {name for line in lines for name in _calls(line)}
    needed: set[str] = set()
    while wanted - needed:
        name = min(wanted - needed)
        if name not in known:
            return None
        needed.add(name)
        wanted |= _calls(known[name]) - {name}
    return tuple(text for name, text in known.items() if name in needed)


def _calls(text: str) -> set[str]:
    nodes = ast.walk(ast.parse(text))
    return {node.id for node in nodes if isinstance(node, ast.Name) and node.id.startswith("lane_")}


@cache
def _functions() -> dict[str, str]:
    """Name -> text of each function with its decorator, in the order of the file."""
    text = module()
    lines = text.splitlines()
    found = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
    return {node.name: "\n".join(lines[node.decorator_list[0].lineno - 1 : node.end_lineno]) for node in found}
