"""Long straight lines in parts: what LLVM takes for a function grows faster than the function.

Calls stay where the function is. What stands between them, where it is long, becomes a table, see `straight_tables`.
"""

import ast
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

#: Operations of a function that is not taken apart, and of what stands between two calls.
WHOLE, SHORT = 2000, 200
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
        assigns = isinstance(statement, ast.Assign)
        nodes = [*expressions(statement.targets[0]), *expressions(statement.value)] if assigns else ast.walk(statement)  # type: ignore[attr-defined]
        apart = assigns and all(_is_plain(node, names) for node in nodes)
        if not found or found[-1].apart != apart:
            found.append(Run(apart))
        last = found[-1]
        last.statements.append(statement)
        for node in nodes:
            if isinstance(node, ast.Name):
                (last.sets if isinstance(node.ctx, ast.Store) else last.reads).add(node.id)
            elif isinstance(node, ast.BinOp | ast.Call | ast.Subscript):
                last.length += 1
    return found


def room(value: ast.expr) -> int:
    """How many numbers an array of a function's own has, `[0.0] * 9`; 0 of all else."""
    if not (isinstance(value, ast.BinOp) and isinstance(value.op, ast.Mult) and isinstance(value.left, ast.List)):
        return 0
    one, length = value.left.elts, value.right
    zero = len(one) == 1 and isinstance(one[0], ast.Constant) and one[0].value == 0.0
    return length.value if zero and isinstance(length, ast.Constant) and type(length.value) is int else 0


def expressions(node: ast.AST) -> list[Any]:
    """All expressions within one, itself too; `ast.walk` takes four times as long."""
    found = [node]
    for each in found:
        kind = type(each)
        if kind is ast.BinOp:
            found += (each.left, each.right)  # type: ignore[attr-defined]
        elif kind is ast.Subscript:
            found += (each.value, each.slice)  # type: ignore[attr-defined]
        elif kind is not ast.Name and kind is not ast.Constant:
            found += (part for part in ast.iter_child_nodes(each) if isinstance(part, ast.expr))
    return found


def _is_plain(node: ast.AST, names: Mapping[str, Any]) -> bool:
    """Whether a node calls nothing, or a plain function of `math`: what may fail has to tell the whole function."""
    if isinstance(node, ast.BinOp):
        return not isinstance(node.op, ast.Pow) and not isinstance(node.left, ast.List)
    if not isinstance(node, ast.Call):
        return True
    return names.get("math") is math and isinstance(node.func, ast.Attribute) and node.func.attr in _PLAIN
