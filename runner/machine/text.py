"""The text of a compiled function as a tree, where its file still holds what Python runs."""

import ast
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any


class StrayError(Exception):
    """What there are no instructions for."""


@cache
def parsed(code: CodeType) -> ast.FunctionDef:
    """The text of a function as a tree; StrayError where its file does not hold it, or not any more."""
    whole = _lines(code.co_filename)
    lines = whole[code.co_firstlineno - 1 :]
    first = next((k for k, line in enumerate(lines) if line.lstrip().startswith("def ")), len(lines))
    margin = _margin(lines[first]) if first < len(lines) else 0
    last = next(
        (k for k in range(first + 1, len(lines)) if lines[k].strip() and _margin(lines[k]) <= margin), len(lines)
    )
    own = [line[margin:] for line in lines[first:last]]
    imports = [line for line in whole if line.startswith("import ")]  # Python compiles calls of these otherwise
    text = "\n".join([*imports, *_within(own, code.co_freevars)])
    try:
        module = ast.parse(text)
        compiled: CodeType | None = compile(text, code.co_filename, "exec")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise StrayError(error) from None
    node: Any = module.body[-1] if module.body else None
    if code.co_freevars and node is not None:
        compiled, node = _code_in(compiled), node.body[-1]
    found = _code_in(compiled)
    if found is None or _meaning(found) != _meaning(code) or not isinstance(node, ast.FunctionDef):
        raise StrayError("its file holds another text")
    return node


def _lines(file: str) -> list[str]:
    try:
        return Path(file).read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise StrayError(error) from None


def _within(lines: list[str], names: tuple[str, ...]) -> list[str]:
    """The lines of a function that has these names from one around it."""
    return [f"def around({', '.join(names)}):", *(f" {line}" for line in lines)] if names else lines


def _margin(line: str) -> int:
    return len(line) - len(line.lstrip())


def _code_in(code: CodeType | None) -> CodeType | None:
    """The code of the one function in another."""
    return next((each for each in code.co_consts if isinstance(each, CodeType)), None) if code is not None else None


def _meaning(code: CodeType) -> tuple[Any, ...]:
    return code.co_code, code.co_consts, code.co_names, code.co_varnames
