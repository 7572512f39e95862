"""The instructions of straight-line Python: assignments of floats, stores, calls, and choices between two values."""

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from itertools import chain
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing import signature

from qddot.runner.machine.expressions import Expressions
from qddot.runner.machine.straight_parts import SHORT, WHOLE, Run, expressions, room, runs
from qddot.runner.machine.straight_tables import Loop, Table, tables
from qddot.runner.machine.text import StrayError
from qddot.runner.machine.values import DOUBLE, FLOAT_ARITHMETIC, RELATIONS, WHOLE_ARITHMETIC, WORD, Typed

_PLACES = types.CPointer(types.float64)


def check(function: ast.FunctionDef, names: Mapping[str, Any]) -> None:
    """StrayError where a function holds what `StraightCode` has no instructions for, or what is not in `names`."""
    known = {argument.arg for argument in function.args.args}
    for statement in function.body:
        inner = statement.body if isinstance(statement, ast.For) and _is_counted(statement) else [statement]
        if not all(_is_simple(each) for each in inner):
            raise StrayError
        within = [statement] if inner == [statement] else [statement, *inner]
        nodes = [node for each in within for node in _nodes(each)]
        stored = [node for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
        own = {node.id for node in stored}
        before = known | own if isinstance(statement, ast.For) else known
        if not all(_is_possible(node, before, names) for node in nodes if node not in stored):
            raise StrayError
        known |= own


def _nodes(statement: Any) -> list[Any]:
    """All expressions of a statement; of an array of its own the name alone."""
    return (
        list(statement.targets)
        if isinstance(statement, ast.Assign) and room(statement.value)
        else expressions(statement)[1:]
    )


def _is_counted(loop: ast.For) -> bool:
    """Whether it is `for name in range(number)`."""
    count = loop.iter.args if isinstance(loop.iter, ast.Call) and isinstance(loop.iter.func, ast.Name) else []
    return len(count) == 1 and isinstance(count[0], ast.Constant) and isinstance(loop.target, ast.Name)


def _is_simple(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Pass | ast.Expr) or (
        isinstance(statement, ast.Assign) and len(statement.targets) == 1
    )


def _is_possible(node: ast.expr, known: set[str], names: Mapping[str, Any]) -> bool:
    if isinstance(node, ast.Name):
        return node.id in known or node.id in names
    if isinstance(node, ast.Call):
        return not node.keywords and (isinstance(node.func, ast.Attribute) or _is_global(node.func, known, names))
    if isinstance(node, ast.Attribute):
        return _is_global(node.value, known, names) and hasattr(names[node.value.id], node.attr)  # type: ignore[attr-defined]
    return type(node) in _POSSIBLE and _POSSIBLE[type(node)](node)


def _is_global(node: ast.expr, known: set[str], names: Mapping[str, Any]) -> bool:
    return isinstance(node, ast.Name) and node.id in names and node.id not in known


def _is_arithmetic(node: ast.BinOp) -> bool:
    whole = isinstance(node.right, ast.Constant) and type(node.right.value) is int
    return type(node.op) in FLOAT_ARITHMETIC or (isinstance(node.op, ast.Pow) and whole)


def _is_index(node: ast.expr) -> bool:
    """Whether it can be a place in an array: sums and products of whole numbers."""
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    inner = [each for part in parts for each in expressions(part) if isinstance(each, ast.BinOp)]
    return not isinstance(node, ast.Slice) and all(type(each.op) in WHOLE_ARITHMETIC for each in inner)


#: Expressions that there are instructions for, where they are as the function says.
_POSSIBLE: dict[type, Callable[[Any], bool]] = {
    ast.Constant: lambda node: isinstance(node.value, bool | int | float | str),
    ast.BinOp: _is_arithmetic,
    ast.UnaryOp: lambda node: isinstance(node.op, ast.USub | ast.Not),
    ast.Compare: lambda node: len(node.ops) == 1 and type(node.ops[0]) in RELATIONS,
    ast.Subscript: lambda node: isinstance(node.value, ast.Name) and _is_index(node.slice),
    **dict.fromkeys((ast.Tuple, ast.BoolOp, ast.IfExp), lambda node: True),
}


class StraightCode(Expressions):
    """Instructions at the end of a block.

    names: what global names mean. whole: however many statements there are, they stay in one function.
    """

    def __init__(self, context: Any, builder: Any, names: Mapping[str, Any], *, whole: bool = False) -> None:
        super().__init__(context, builder, names)
        self._whole = whole
        self._values: dict[str, Typed] = {}
        self._items: dict[str, tuple[Any, Any]] = {}  # where an array's items begin, and how long its rows are
        self._frame: Any = None
        self._kept: Mapping[str, int] = {}

    def local(self, name: str) -> Typed | None:
        """The value of a name of the function's own, None where it is none."""
        if name in self._kept:
            return types.float64, self._builder.load(self._builder.gep(self._frame, [WORD(self._kept[name])]))
        return self._values.get(name)

    def holds(self, name: str) -> bool:
        """Whether a name is one of the function's own."""
        return name in self._kept or name in self._values

    def name(self, name: str, value: Typed) -> None:
        """Let a name mean a value."""
        if name in self._kept:
            self._builder.store(self.cast(value), self._builder.gep(self._frame, [WORD(self._kept[name])]))
            return
        self._values[name] = value
        kind, found = value
        if isinstance(kind, types.Array):
            array = self._context.data_model_manager[kind]
            shape = array.get(self._builder, found, "shape")
            self._items[name] = (
                array.get(self._builder, found, "data"),
                self._builder.extract_value(shape, kind.ndim - 1),
            )

    def body(self, statements: Sequence[ast.stmt]) -> None:
        """Instructions of a function's statements."""
        found = [] if self._whole else runs(statements, self._names)
        if sum(run.length for run in found) <= WHOLE:
            self.run(statements)
            return
        made, self._kept, length = tables(found, lambda node: float(self.number(node).constant), SHORT)
        self._frame = cgutils.alloca_once(self._builder, DOUBLE, size=WORD(length))
        for name in self._kept.keys() & self._values.keys():
            self.name(name, self._values[name])
        for k, run in enumerate(found):
            if k in made:
                self._apart(f"{self._builder.function.name}.part_{k}", run, made[k])
            else:
                self.run(run.statements)

    def _apart(self, name: str, run: Run, table: Table) -> None:
        """A table as a function of its own, and its call."""
        read = run.reads | run.sets
        items = {each: self._items[each] for each in sorted(read & self._items.keys())}
        values = {each: self._values[each] for each in sorted((read & self._values.keys()) - items.keys())}
        given = [self._frame, *chain.from_iterable(items.values()), *(value for _, value in values.values())]
        kind = ir.FunctionType(ir.VoidType(), [each.type for each in given])
        function = ir.Function(self._builder.module, kind, name)
        function.linkage = "internal"
        function.attributes.add("noinline")
        function.attributes.add("minsize")  # unrolled loops take twice the time to compile, and as much to run
        function.attributes.add("nounwind")
        for argument in function.args:
            if isinstance(argument.type, ir.PointerType):
                argument.add_attribute("noalias")
        inner = StraightCode(self._context, ir.IRBuilder(function.append_basic_block("entry")), self._names)
        arguments = iter(function.args[1:])
        inner._items = {each: (next(arguments), next(arguments)) for each in items}
        inner._values = {each: (self._values[each][0], None) for each in items}
        inner._values |= {each: (kind, next(arguments)) for each, (kind, _) in values.items()}
        Loop(inner, inner._builder, table, function.args[0]).emit()
        inner._builder.ret_void()
        self._builder.call(function, given)

    def run(self, body: Sequence[ast.stmt]) -> None:
        """Instructions of statements."""
        for statement in body:
            if isinstance(statement, ast.For):
                self._repeat(statement)
            elif isinstance(statement, ast.Assign):
                self._assign(statement.targets[0], statement.value)
            elif isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
                self.called(statement.value)

    def _repeat(self, loop: Any) -> None:
        count = loop.iter.args[0].value
        if self._whole:  # a loop within one over lanes would keep that from becoming vectors
            for turn in range(count):
                self.name(loop.target.id, (types.intp, WORD(turn)))
                self.run(loop.body)
            return
        with cgutils.for_range(self._builder, WORD(count)) as turn:
            self.name(loop.target.id, (types.intp, turn.index))
            self.run(loop.body)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Name) and (length := room(value)):
            self.name(target.id, (_PLACES, cgutils.alloca_once(self._builder, DOUBLE, size=WORD(length))))
            return
        if not isinstance(target, ast.Tuple):
            self.store(target, self.typed(value))
            return
        if isinstance(value, ast.Tuple):
            found = [self.typed(part) for part in value.elts]
        else:
            together = self.typed(value)
            found = [self.part(together, k) for k in range(len(target.elts))]
        for part, each in zip(target.elts, found, strict=True):
            self.store(part, each)

    def store(self, target: Any, value: Typed) -> None:
        """A value goes into an item of an array, or is named."""
        if isinstance(target, ast.Name):
            self.name(target.id, value)
            return
        kind, base = self._values[target.value.id]
        number = self.cast(value)
        if (place := self._place(target)) is not None:
            self._builder.store(number, place)
            return
        setter = self._context.get_function(operator.setitem, signature(types.none, kind, types.intp, types.float64))
        setter(self._builder, (base, self._where(target.slice), number))

    def item(self, node: Any) -> Typed:
        """An item of an array, or of what has items."""
        if (place := self._place(node)) is not None:
            return types.float64, self._builder.load(place)
        kind, base = self._values[node.value.id]
        getter = self._context.get_function(operator.getitem, signature(types.float64, kind, types.intp))
        return types.float64, getter(self._builder, (base, self._where(node.slice)))

    def _place(self, node: Any) -> Any:
        """Where an item stands; None where its row knows alone."""
        name = node.value.id
        kind, base = self._values[name]
        if isinstance(kind, types.CPointer):
            return self._builder.gep(base, [self._where(node.slice)])
        if name not in self._items:
            return None
        data, width = self._items[name]
        if kind.ndim == 1:
            return self._builder.gep(data, [self._where(node.slice)])
        row, column = map(self._where, node.slice.elts)
        return self._builder.gep(data, [self._builder.add(self._builder.mul(row, width), column)])

    def _where(self, node: ast.expr) -> Any:
        """An index, a whole number."""
        return self.typed(node)[1]

    def junction(self, node: ast.BoolOp, last: Any = None) -> Typed:
        """Of truths, all of which are computed: what stands in a loop over lanes is to become vectors."""
        found = [self.true(part) for part in node.values]
        return types.boolean, reduce(self._builder.and_ if isinstance(node.op, ast.And) else self._builder.or_, found)
