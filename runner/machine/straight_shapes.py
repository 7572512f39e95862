"""Statements by their shapes: which do the same with other operands, and in which order they can be done.

Every statement becomes steps. A step is an expression of a shape, its operands places in a frame of numbers or indices
of items of arrays, and its value goes to a place or into an array. A shape that occurs often is a step as it stands; of
others the parts are steps, and of these again, down to a sum or product of two; long sums are a step of their own kind.
So there are few shapes, however many statements there are.
"""

import ast
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from qddot.runner.machine.straight_parts import Run

#: Times that a shape occurs that is not taken apart, and operands that it has at most.
OFTEN, MOST = 8, 16
#: Terms of a sum that is no step of its own kind.
FEW = 3
#: What stands for a value: a name, a number as its text in base 16, or the count of a step.
Value = tuple[str, Any]
_LEAF, _LONG = 0, -1


@dataclass(frozen=True)
class Shape:
    """An expression whose names are the numbers of its operands, and where its value goes, an item of an array or None.

    indices: of each operand whether it is an index. expression: None of a long sum, whose operands are how many values
    are added and subtracted, and these.
    """

    expression: ast.expr | None
    target: ast.Subscript | None
    indices: tuple[bool, ...]


@dataclass(frozen=True)
class Step:
    """shape: its place among the shapes. value: what it makes, None where that goes into an array. level: steps of one
    level do not need each other, only those of lower ones."""

    shape: int
    operands: Sequence[Any]
    value: Value | None
    level: int


@dataclass
class Steps:
    """The steps of a run, and their shapes. outside: names that others set."""

    shapes: list[Shape] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)
    outside: dict[str, None] = field(default_factory=dict)
    numbers: dict[str, None] = field(default_factory=dict)


def steps_of(run: Run, number: Callable[[ast.expr], float]) -> Steps | None:
    """The steps of a run; number: what a constant is. None where its order matters: of items that it reads and writes,
    and names that it sets twice."""
    pairs = [pair for statement in run.statements for pair in _pairs(statement)]
    names = [target.id for target, _ in pairs if isinstance(target, ast.Name)]
    written = {target.value.id for target, _ in pairs if not isinstance(target, ast.Name)}
    making = _Making(number)
    for _, value in pairs:
        making.survey(value)
    if written & making.read or len(set(names)) < len(names):
        return None
    for target, value in pairs:
        making.statement(target, value)
    return making.found


def _pairs(statement: Any) -> Iterator[tuple[Any, Any]]:
    target, value = statement.targets[0], statement.value
    if isinstance(target, ast.Tuple):
        yield from zip(target.elts, value.elts, strict=True)
    else:
        yield target, value


class _Making:
    """One pass over the statements. ids, counts: of each expression its shape, and how often that occurs.

    read: the arrays whose items are.
    """

    def __init__(self, number: Callable[[ast.expr], float]) -> None:
        self.found = Steps()
        self._number = number
        self._known: dict[Any, int] = {}
        self._ids: dict[int, int] = {}
        self._sizes: list[int] = [1]
        self._counts: Counter[int] = Counter()
        self._places: dict[Any, int] = {}
        self._levels: dict[Value, int] = {}
        self.read: set[str] = set()

    def survey(self, node: Any) -> int:
        """The shape of an expression, each of its parts counted."""
        if _is_leaf(node):
            return _LEAF
        if (terms := _terms(node)) is not None:
            for term, _ in terms:
                self.survey(term)
            self._ids[id(node)] = _LONG
            return _LONG
        if isinstance(node, ast.Subscript):
            array: Any = node.value
            parts, head = [_LEAF], f"item of {array.id}"
            self.read.add(array.id)
        else:
            parts, head = [self.survey(part) for part in _parts(node)], _head(node)
        if _LONG in parts:
            self._ids[id(node)] = _LONG
            return _LONG
        key = (head, *parts)
        if key not in self._known:
            self._known[key] = len(self._sizes)
            self._sizes.append(sum(self._sizes[part] for part in parts))
        found = self._ids[id(node)] = self._known[key]
        self._counts[found] += 1
        return found

    def statement(self, target: Any, value: Any) -> None:
        """The steps of a statement."""
        if isinstance(target, ast.Name):
            self._cut(value, ("name", target.id))
            return
        operands: list[Any] = []
        place, item = self._item(target, operands)
        key, expression = self._tile(value, operands, root=True)
        self._step((place, key), operands, expression, item)

    def _cut(self, node: Any, name: Value | None = None) -> Value:
        """An expression as a step of its own: its value, which may have a name."""
        terms = _terms(node) if self._ids.get(id(node)) == _LONG else None
        if terms is not None:
            added, taken = ([self._operand(term) for term, sign in terms if sign is each] for each in (True, False))
            return self._step("sum", [len(added), len(taken), *added, *taken], name=name)
        operands: list[Any] = []
        key, expression = self._tile(node, operands, root=True)
        return self._step(key, operands, expression, name=name)

    def _operand(self, node: Any) -> Value:
        """The value of an expression: of a leaf itself, else of a step."""
        if not _is_leaf(node):
            return self._cut(node)
        if isinstance(node, ast.Name):
            if ("name", node.id) not in self._levels:
                self.found.outside[node.id] = None
            return "name", node.id
        text = self._number(node).hex()
        self.found.numbers[text] = None
        return "number", text

    def _step(
        self, key: Any, operands: list[Any], expression: Any = None, target: Any = None, name: Value | None = None
    ) -> Value:
        """Add a step, and its shape where that is new; gives its value."""
        if key not in self._places:
            self._places[key] = len(self.found.shapes)
            indices = tuple(isinstance(each, int) for each in operands)
            self.found.shapes.append(Shape(expression, target, indices))
        value = name or ("step", len(self.found.steps))
        level = 1 + max((self._levels.get(each, 0) for each in operands if isinstance(each, tuple)), default=0)
        self._levels[value] = level
        self.found.steps.append(Step(self._places[key], operands, value if target is None else None, level))
        return value

    def _item(self, node: Any, operands: list[Any]) -> tuple[Any, ast.Subscript]:
        """An item of an array: what it is an item of, and its expression."""
        parts: list[Any] = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        first = len(operands)
        operands += [part.value for part in parts]
        names: list[ast.expr] = [ast.Name(str(first + k)) for k in range(len(parts))]
        where = ast.Tuple(names) if len(names) > 1 else names[0]
        return f"item of {node.value.id}", ast.Subscript(ast.Name(node.value.id), where)

    def _tile(self, node: Any, operands: list[Any], *, root: bool = False, whole: bool = False) -> tuple[Any, ast.expr]:
        """The key and expression of what is taken as one step, from the root of a step on; operands are appended."""
        if isinstance(node, ast.Subscript):
            return self._item(node, operands)
        shape = self._ids.get(id(node), _LEAF)
        often = shape > _LEAF and self._counts[shape] >= OFTEN and self._sizes[shape] <= MOST
        cuttable = isinstance(node, ast.BinOp | ast.Call) or _is_negative(node)
        long = shape == _LONG and _terms(node) is not None
        if shape == _LEAF or long or (cuttable and not (root or whole)):
            operands.append(self._operand(node))
            return "", ast.Name(str(len(operands) - 1))
        whole = whole or often or not cuttable
        found = [
            self._tile(part, operands, whole=whole, root=root and not whole and _goes_with(node, part))
            for part in _parts(node)
        ]
        return (_head(node), *(key for key, _ in found)), _with(node, [each for _, each in found])


def _goes_with(node: Any, part: Any) -> bool:
    """Whether a product is done together with the sum that it is a part of."""
    product = isinstance(part, ast.BinOp) and isinstance(part.op, ast.Mult)
    return product and isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)


def _is_leaf(node: Any) -> bool:
    number = isinstance(node, ast.Constant) and not isinstance(node.value, bool)
    return number or isinstance(node, ast.Name | ast.Attribute)


def _is_negative(node: ast.expr) -> bool:
    return isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)


def _terms(node: ast.expr) -> list[tuple[ast.expr, bool]] | None:
    """The terms of a long sum, and whether each is added; None of all else."""
    if not (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)):
        return None
    found: list[tuple[ast.expr, bool]] = []
    first: ast.expr = node
    while isinstance(first, ast.BinOp) and isinstance(first.op, ast.Add | ast.Sub):
        found.append((first.right, isinstance(first.op, ast.Add)))
        first = first.left
    found.append((first.operand, False) if _is_negative(first) else (first, True))  # type: ignore[attr-defined]
    return found[::-1] if len(found) > FEW else None


def _parts(node: Any) -> list[ast.expr]:
    """The expressions that one is made of."""
    return {
        ast.BinOp: lambda: [node.left, node.right],
        ast.UnaryOp: lambda: [node.operand],
        ast.Call: lambda: node.args,
        ast.Compare: lambda: [node.left, *node.comparators],
        ast.BoolOp: lambda: node.values,
        ast.IfExp: lambda: [node.test, node.body, node.orelse],
        ast.Constant: lambda: [],
    }[type(node)]()


def _with(node: Any, parts: list[ast.expr]) -> ast.expr:
    """The same of other expressions."""
    return {
        ast.BinOp: lambda: ast.BinOp(parts[0], node.op, parts[1]),
        ast.UnaryOp: lambda: ast.UnaryOp(node.op, parts[0]),
        ast.Call: lambda: ast.Call(node.func, parts, []),
        ast.Compare: lambda: ast.Compare(parts[0], node.ops, parts[1:]),
        ast.BoolOp: lambda: ast.BoolOp(node.op, parts),
        ast.IfExp: lambda: ast.IfExp(*parts),
        ast.Constant: lambda: node,
    }[type(node)]()


def _head(node: Any) -> str:
    """What an expression does with its parts."""
    return {
        ast.BinOp: lambda: type(node.op).__name__,
        ast.UnaryOp: lambda: type(node.op).__name__,
        ast.Call: lambda: node.func.attr,
        ast.Compare: lambda: type(node.ops[0]).__name__,
        ast.BoolOp: lambda: f"{type(node.op).__name__} {len(node.values)}",
        ast.IfExp: lambda: "IfExp",
        ast.Constant: lambda: str(node.value),
    }[type(node)]()
