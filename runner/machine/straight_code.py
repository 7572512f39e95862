"""The instructions of straight-line Python: assignments of floats, stores, calls, and choices between two values."""

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing import signature
from numba.np.arrayobj import make_array

from qddot.runner.machine.straight_parts import SHORT, WHOLE, Run, expressions, room, runs
from qddot.runner.machine.straight_tables import Loop, Table, tables

#: The numba type of a value, and the value.
Typed = tuple[Any, Any]

_DOUBLE, _WORD, _BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
_PLACES = types.CPointer(types.float64)
_ARITHMETIC: dict[type, str] = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_WHOLE_ARITHMETIC: dict[type, str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
_RELATIONS: dict[type, str] = {
    **{ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="},
    **{ast.Eq: "==", ast.NotEq: "!="},
}


class StrayError(Exception):
    """What is no straight line."""


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
    return type(node.op) in _ARITHMETIC or (isinstance(node.op, ast.Pow) and whole)


def _is_index(node: ast.expr) -> bool:
    """Whether it can be a place in an array: sums and products of whole numbers."""
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    inner = [each for part in parts for each in expressions(part) if isinstance(each, ast.BinOp)]
    return not isinstance(node, ast.Slice) and all(type(each.op) in _WHOLE_ARITHMETIC for each in inner)


#: Expressions that there are instructions for, where they are as the function says.
_POSSIBLE: dict[type, Callable[[Any], bool]] = {
    ast.Constant: lambda node: isinstance(node.value, bool | int | float | str),
    ast.BinOp: _is_arithmetic,
    ast.UnaryOp: lambda node: isinstance(node.op, ast.USub | ast.Not),
    ast.Compare: lambda node: len(node.ops) == 1 and type(node.ops[0]) in _RELATIONS,
    ast.Subscript: lambda node: isinstance(node.value, ast.Name) and _is_index(node.slice),
    **dict.fromkeys((ast.Tuple, ast.BoolOp, ast.IfExp), lambda node: True),
}


class StraightCode:
    """Instructions at the end of a block.

    names: what global names mean. whole: however many statements there are, they stay in one function.
    """

    def __init__(self, context: Any, builder: Any, names: Mapping[str, Any], *, whole: bool = False) -> None:
        self._context = context
        self._builder = builder
        self._names = names
        self._whole = whole
        self._values: dict[str, Typed] = {}
        self._items: dict[str, tuple[Any, Any]] = {}  # where an array's items begin, and how long its rows are
        self._frame: Any = None
        self._kept: Mapping[str, int] = {}

    def name(self, name: str, value: Typed) -> None:
        """Let a name mean a value."""
        if name in self._kept:
            self._builder.store(self._cast(value), self._builder.gep(self._frame, [_WORD(self._kept[name])]))
            return
        self._values[name] = value
        kind, found = value
        if isinstance(kind, types.Array):
            array = make_array(kind)(self._context, self._builder, found)
            self._items[name] = array.data, self._builder.extract_value(array.shape, kind.ndim - 1)

    def body(self, statements: Sequence[ast.stmt]) -> None:
        """Instructions of a function's statements."""
        found = [] if self._whole else runs(statements, self._names)
        if sum(run.length for run in found) <= WHOLE:
            self.run(statements)
            return
        made, self._kept, length = tables(found, lambda node: float(self._typed(node)[1].constant), SHORT)
        self._frame = cgutils.alloca_once(self._builder, _DOUBLE, size=_WORD(length))
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
                self._call(statement.value)

    def _repeat(self, loop: Any) -> None:
        count = loop.iter.args[0].value
        if self._whole:  # a loop within one over lanes would keep that from becoming vectors
            for turn in range(count):
                self.name(loop.target.id, (types.intp, _WORD(turn)))
                self.run(loop.body)
            return
        with cgutils.for_range(self._builder, _WORD(count)) as turn:
            self.name(loop.target.id, (types.intp, turn.index))
            self.run(loop.body)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Name) and (length := room(value)):
            self.name(target.id, (_PLACES, cgutils.alloca_once(self._builder, _DOUBLE, size=_WORD(length))))
            return
        if not isinstance(target, ast.Tuple):
            self.store(target, self._typed(value))
            return
        if isinstance(value, ast.Tuple):
            found = [self._typed(part) for part in value.elts]
        else:
            kinds, together = self._typed(value)
            found = [(kind, self._builder.extract_value(together, k)) for k, kind in enumerate(kinds)]
        for part, each in zip(target.elts, found, strict=True):
            self.store(part, each)

    def store(self, target: Any, value: Typed) -> None:
        """A value goes into an item of an array, or is named."""
        if isinstance(target, ast.Name):
            self.name(target.id, value)
            return
        kind, base = self._values[target.value.id]
        number = self._cast(value)
        if (place := self._place(target)) is not None:
            self._builder.store(number, place)
            return
        setter = self._context.get_function(operator.setitem, signature(types.none, kind, types.intp, types.float64))
        setter(self._builder, (base, self._index(target.slice), number))

    def _load(self, node: Any) -> Typed:
        if (place := self._place(node)) is not None:
            return types.float64, self._builder.load(place)
        kind, base = self._values[node.value.id]
        getter = self._context.get_function(operator.getitem, signature(types.float64, kind, types.intp))
        return types.float64, getter(self._builder, (base, self._index(node.slice)))

    def _place(self, node: Any) -> Any:
        """Where an item stands; None where its row knows alone."""
        name = node.value.id
        kind, base = self._values[name]
        if isinstance(kind, types.CPointer):
            return self._builder.gep(base, [self._index(node.slice)])
        if name not in self._items:
            return None
        data, width = self._items[name]
        if kind.ndim == 1:
            return self._builder.gep(data, [self._index(node.slice)])
        row, column = map(self._index, node.slice.elts)
        return self._builder.gep(data, [self._builder.add(self._builder.mul(row, width), column)])

    def _index(self, node: Any) -> Any:
        """A whole number: one, or what counts the turns of a loop, or sums and products of these."""
        if isinstance(node, ast.Constant):
            return _WORD(node.value)
        if isinstance(node, ast.BinOp):
            operation = _WHOLE_ARITHMETIC[type(node.op)]
            return getattr(self._builder, operation)(self._index(node.left), self._index(node.right))
        return self._typed(node)[1]

    def number(self, node: ast.expr) -> Any:
        """The value of an expression as a float64."""
        return self._cast(self._typed(node))

    def _cast(self, value: Typed, kind: Any = types.float64) -> Any:
        return value[1] if value[0] == kind else self._context.cast(self._builder, value[1], value[0], kind)

    def _typed(self, node: Any) -> Typed:
        """The value of an expression."""
        return _FORMS[type(node)](self, node)

    def _named(self, node: ast.Name) -> Typed:
        if node.id in self._kept:
            return types.float64, self._builder.load(self._builder.gep(self._frame, [_WORD(self._kept[node.id])]))
        return self._values[node.id] if node.id in self._values else self._constant(self._names[node.id])

    def _opposite(self, node: ast.UnaryOp) -> Typed:
        if isinstance(node.op, ast.Not):
            return types.boolean, self._builder.not_(self._typed(node.operand)[1])
        return types.float64, self._builder.fneg(self.number(node.operand))

    def _compared(self, node: ast.Compare) -> Typed:
        left, right, relation = self.number(node.left), self.number(node.comparators[0]), type(node.ops[0])
        compare = self._builder.fcmp_unordered if relation is ast.NotEq else self._builder.fcmp_ordered
        return types.boolean, compare(_RELATIONS[relation], left, right)

    def _constant(self, value: Any) -> Typed:
        if isinstance(value, bool):
            return types.boolean, _BIT(value)
        if isinstance(value, int):
            return types.literal(value), self._context.get_constant(types.intp, value)
        if isinstance(value, str):  # for what reads it when it is compiled
            return types.literal(value), self._context.get_dummy_value()
        return types.float64, _DOUBLE(value)

    def _arithmetic(self, node: ast.BinOp) -> Typed:
        """Sums and products from the left, which may be of thousands."""
        line: list[ast.BinOp] = []
        first: ast.expr = node
        while isinstance(first, ast.BinOp):
            line.append(first)
            first = first.left
        value = self.number(first)
        for each in reversed(line):
            if isinstance(each.op, ast.Pow):
                whole = types.int64, _WORD(each.right.value)  # type: ignore[attr-defined]
                value = self._cast(self._called(operator.pow, [(types.float64, value), whole]))
            else:
                value = getattr(self._builder, _ARITHMETIC[type(each.op)])(value, self.number(each.right))
        return types.float64, value

    def _junction(self, node: ast.BoolOp) -> Typed:
        found = [self._typed(part)[1] for part in node.values]
        join = self._builder.and_ if isinstance(node.op, ast.And) else self._builder.or_
        value = found[0]
        for each in found[1:]:
            value = join(value, each)
        return types.boolean, value

    def _choice(self, node: ast.IfExp) -> Typed:
        """One of two values, of which the other is not computed."""
        with self._builder.if_else(self._typed(node.test)[1]) as (then, otherwise):
            with then:
                one, first = self.number(node.body), self._builder.block
            with otherwise:
                other, second = self.number(node.orelse), self._builder.block
        value = self._builder.phi(_DOUBLE)
        value.add_incoming(one, first)
        value.add_incoming(other, second)
        return types.float64, value

    def _call(self, node: ast.Call) -> Typed:
        return self._called(self._object(node.func), [self._typed(part) for part in node.args])

    def _called(self, function: Any, arguments: Sequence[Typed]) -> Typed:
        """A call of what compiled code can call."""
        typing = self._context.typing_context
        kind = typing.resolve_value_type(function)
        found = typing.resolve_function_type(kind, tuple(each for each, _ in arguments), {})
        code = self._context.get_function(kind, found)
        self._context.add_linking_libs(getattr(code, "libs", ()))
        values = [self._cast(each, wanted) for each, wanted in zip(arguments, found.args, strict=True)]
        return found.return_type, code(self._builder, values)

    def _object(self, node: Any) -> Any:
        """What a name or an attribute of a module means."""
        if isinstance(node, ast.Name):
            return self._names[node.id]
        return getattr(self._object(node.value), node.attr)


_FORMS: dict[type, Callable[[StraightCode, Any], Typed]] = {
    ast.Name: StraightCode._named,
    ast.Constant: lambda code, node: code._constant(node.value),
    ast.Attribute: lambda code, node: code._constant(code._object(node)),
    ast.BinOp: StraightCode._arithmetic,
    ast.UnaryOp: StraightCode._opposite,
    ast.Subscript: StraightCode._load,
    ast.Call: StraightCode._call,
    ast.Compare: StraightCode._compared,
    ast.BoolOp: StraightCode._junction,
    ast.IfExp: StraightCode._choice,
}
