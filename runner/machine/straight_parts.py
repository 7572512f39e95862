"""Long straight lines in parts: LLVM's schedulers take a time that grows with the square of what stands in one line.

Calls stay where the function is. What one part assigns and another reads is kept in a frame on the stack.
"""

import ast
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

#: Operations of a function that is not taken apart, and after which a part ends.
WHOLE, PART = 2000, 400
#: Functions of `math` that are one instruction or one call.
_PLAIN = frozenset(("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt"))


@dataclass
class Run:
    """Statements one after the other, whether they are a part, and the names that they read and set."""

    apart: bool
    statements: list[ast.stmt] = field(default_factory=list)
    reads: set[str] = field(default_factory=set)
    sets: set[str] = field(default_factory=set)
    length: int = 0


def runs(body: Sequence[ast.stmt], names: Mapping[str, Any]) -> list[Run]:
    """A function's statements in parts, and what stands between them; names: what global names mean."""
    found: list[Run] = []
    for statement in body:
        nodes = list(ast.walk(statement))
        apart = isinstance(statement, ast.Assign) and all(_is_plain(node, names) for node in nodes)
        if not found or found[-1].apart != apart or (apart and found[-1].length >= PART):
            found.append(Run(apart))
        last = found[-1]
        last.statements.append(statement)
        last.length += sum(isinstance(node, ast.BinOp | ast.Call | ast.Subscript) for node in nodes)
        for node in (node for node in nodes if isinstance(node, ast.Name)):
            (last.sets if isinstance(node.ctx, ast.Store) else last.reads).add(node.id)
    return found


def _is_plain(node: ast.AST, names: Mapping[str, Any]) -> bool:
    """Whether a node calls nothing, or a plain function of `math`: what may fail has to tell the whole function."""
    if isinstance(node, ast.Pow):
        return False
    if not isinstance(node, ast.Call):
        return True
    return names.get("math") is math and isinstance(node.func, ast.Attribute) and node.func.attr in _PLAIN


def frame(found: Sequence[Run]) -> dict[str, int]:
    """Names that a part sets and another run reads -> their places."""
    homes = {name: run for run in found if run.apart for name in run.sets}
    kept = (name for run in found for name in sorted(run.reads) if homes.get(name, run) is not run)
    return {name: place for place, name in enumerate(dict.fromkeys(kept))}
