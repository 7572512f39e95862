"""LLVM's instructions of the statements of a function: assignments, branches, loops; a place in memory for each name.

A name has one type throughout. Where a later assignment needs a wider one (an integer first, a float then), or a result
turns out to be one, all is emitted once more with that.
"""

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner.machine.expressions import Expressions
from qddot.runner.machine.text import StrayError
from qddot.runner.machine.values import WORD, Typed, is_whole


class WiderError(Exception):
    """A type was not the one that it has to be; what `Kinds` holds is, now."""


@dataclass
class Kinds:
    """Types found so far: of names, and of the result, None where it is not known."""

    result: Any
    names: dict[str, Any] = field(default_factory=dict)


@dataclass
class _Turn:
    """Where a loop goes on; end: made when something leaves the loop."""

    onward: Any
    end: Any = None


class Structured(Expressions):
    """Instructions of a function's statements.

    arguments: by name; kinds: see there; settle: what is told the type of the result when it is known.
    """

    def __init__(
        self,
        context: Any,
        builder: Any,
        names: Mapping[str, Any],
        arguments: Mapping[str, Typed],
        kinds: Kinds,
        settle: Callable[[Any], None],
    ) -> None:
        super().__init__(context, builder, names)
        self._kinds, self._settle = kinds, settle
        self._given = dict(arguments)
        self._places: dict[str, Any] = {}
        self._own: set[str] = set()  # names that the function gives values to
        self._turns: list[_Turn] = []

    def function(self, node: ast.FunctionDef) -> None:
        """Instructions of all of it."""
        named = [each for each in ast.walk(node) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)]
        self._own = {each.id for each in named}
        for name in sorted(self._own & self._given.keys()):
            self.name(name, self._given.pop(name))
        self.run(node.body)
        if not self._ended():
            self._return(types.none, self._context.get_dummy_value())

    def local(self, name: str) -> Typed | None:
        """The value of a name of the function's own, None where it is none."""
        if name in self._places:
            return self._kinds.names[name], self._builder.load(self._places[name])
        if name in self._own:
            raise StrayError(f"{name} before it has a value")
        return self._given.get(name)

    def holds(self, name: str) -> bool:
        """Whether a name is one of the function's own."""
        return name in self._own or name in self._given

    def name(self, name: str, value: Typed) -> None:
        """Let a name mean a value."""
        if name == "_":  # what nobody reads
            return
        kind = types.unliteral(value[0])
        known = self._kinds.names.setdefault(name, kind)
        if known != kind and (wider := self.unified(known, kind)) != known:
            self._kinds.names[name] = wider
            raise WiderError
        if name not in self._places:
            self._places[name] = cgutils.alloca_once(self._builder, self._context.get_value_type(known))
        self._builder.store(self.cast((kind, value[1]), known), self._places[name])

    def run(self, body: Sequence[ast.stmt]) -> None:
        """Instructions of statements, as far as they are reached."""
        for statement in body:
            if self._ended():
                return
            form = _FORMS.get(type(statement))
            if form is None:
                raise StrayError(type(statement).__name__)
            form(self, statement)

    def _ended(self) -> bool:
        return self._builder.block.is_terminated

    def _assign(self, statement: ast.Assign) -> None:
        target = statement.targets[0]
        if isinstance(statement.value, ast.Tuple) and isinstance(target, ast.Tuple) and len(statement.targets) == 1:
            values = [self.typed(each) for each in statement.value.elts]
            if len(values) != len(target.elts):
                raise StrayError(f"{len(target.elts)} names for {len(values)} values")
            for part, each in zip(target.elts, values, strict=True):
                self._store(part, each)
            return
        value = self.typed(statement.value)
        for target in statement.targets:
            self._store(target, value)

    def _store(self, target: ast.expr, value: Typed) -> None:
        """A value gets a name, or goes into an item or a field, or its parts do."""
        if isinstance(target, ast.Name):
            self.name(target.id, value)
        elif isinstance(target, ast.Tuple) and isinstance(value[0], types.BaseTuple):
            if len(target.elts) != len(value[0]):
                raise StrayError(f"{len(target.elts)} names for {value[0]}")
            for k, part in enumerate(target.elts):
                self._store(part, self.part(value, k))
        elif isinstance(target, ast.Subscript):
            self._into(self.typed(target.value), self.indices(target.slice), value)
        elif isinstance(target, ast.Attribute):
            self._onto(self.typed(target.value), target.attr, value)
        else:
            raise StrayError(f"an assignment to {type(target).__name__}")

    def _into(self, base: Typed, where: Sequence[Typed], value: Typed) -> None:
        place = self.place(base, where)
        if place is None:
            raise StrayError(f"an item of {base[0]}")
        self.stored(base[0].dtype, value, place)

    def _onto(self, base: Typed, name: str, value: Typed) -> None:
        kind, where = base
        if isinstance(kind, types.Record):
            field = kind.typeof(name)
            data = self._context.get_data_type(field)
            self.stored(field, value, cgutils.get_record_member(self._builder, where, kind.offset(name), data))
            return
        found = self._context.typing_context.resolve_setattr(kind, name, types.unliteral(value[0]))
        if found is None:
            raise StrayError(f"field {name} of {kind}")
        self._context.get_setattr(name, found)(self._builder, (where, self.cast(value, found.args[1])))

    def _augment(self, statement: ast.AugAssign) -> None:
        target, operation = statement.target, type(statement.op)
        if isinstance(target, ast.Name):
            before = self.named(target)
            self.name(target.id, self.combined(operation, before, self.typed(statement.value)))
        elif isinstance(target, ast.Attribute):
            base = self.typed(target.value)
            added = self.combined(operation, self.field(base, target.attr), self.typed(statement.value))
            self._onto(base, target.attr, added)
        else:
            base, where = self.typed(target.value), self.indices(target.slice)
            place = self.place(base, where)
            if place is None:
                raise StrayError(f"an item of {base[0]}")
            before = self.loaded(base[0].dtype, place)
            self.stored(base[0].dtype, self.combined(operation, before, self.typed(statement.value)), place)

    def _expression(self, statement: ast.Expr) -> None:
        if not isinstance(statement.value, ast.Constant):
            self.typed(statement.value)

    def _branch(self, statement: ast.If) -> None:
        then, other = (self._builder.append_basic_block(name) for name in ("if", "else"))
        self._builder.cbranch(self.true(statement.test), then, other)
        ends = []
        for block, body in ((then, statement.body), (other, statement.orelse)):
            self._builder.position_at_end(block)
            self.run(body)
            if not self._ended():
                ends.append(self._builder.block)
        if ends:
            after = self._builder.append_basic_block("after")
            for block in ends:
                self._builder.position_at_end(block)
                self._builder.branch(after)
            self._builder.position_at_end(after)

    def _while(self, statement: ast.While) -> None:
        head = self._builder.append_basic_block("while")
        self._builder.branch(head)
        self._builder.position_at_end(head)
        turn = _Turn(head)
        if not (isinstance(statement.test, ast.Constant) and statement.test.value):
            body, turn.end = (self._builder.append_basic_block(name) for name in ("turn", "end"))
            self._builder.cbranch(self.true(statement.test), body, turn.end)
            self._builder.position_at_end(body)
        self._repeat(turn, statement)

    def _repeat(self, turn: _Turn, statement: ast.While | ast.For) -> None:
        """The body of a loop, then what comes after it."""
        if statement.orelse:
            raise StrayError("else of a loop")
        self._turns.append(turn)
        self.run(statement.body)
        if not self._ended():
            self._builder.branch(turn.onward)
        self._turns.pop()
        if turn.end is not None:
            self._builder.position_at_end(turn.end)

    def _for(self, statement: ast.For) -> None:
        if isinstance(statement.iter, ast.Tuple):
            self._for_each(statement, [self.typed(each) for each in statement.iter.elts])
            return
        if not isinstance(statement.iter, ast.Call) or self._known(statement.iter.func) is not range:
            raise StrayError("a loop over no range")
        found = [self.typed(each) for each in statement.iter.args]
        if not all(is_whole(kind) for kind, _ in found):
            raise StrayError("a range of no integers")
        values = [value for _, value in found]
        first, step = [WORD(0)] * (len(values) == 1), [WORD(1)] * (len(values) < 3)
        self._count(statement, *first, *values, *step)

    def _count(self, statement: ast.For, start: Any, stop: Any, step: Any) -> None:
        before = self._builder.block
        head, body, onward, end = (self._builder.append_basic_block(name) for name in ("for", "turn", "next", "end"))
        self._builder.branch(head)
        self._builder.position_at_end(head)
        value = self._builder.phi(WORD)
        value.add_incoming(start, before)
        self._builder.cbranch(self._goes_on(value, stop, step), body, end)
        self._builder.position_at_end(onward)
        value.add_incoming(self._builder.add(value, step, flags=["nsw"]), onward)
        self._builder.branch(head)
        self._builder.position_at_end(body)
        self._store(statement.target, (types.int64, value))
        self._repeat(_Turn(onward, end), statement)

    def _goes_on(self, value: Any, stop: Any, step: Any) -> Any:
        up = self._builder.icmp_signed("<", value, stop)
        if isinstance(step, ir.Constant) and step.constant > 0:
            return up
        down = self._builder.icmp_signed(">", value, stop)
        if isinstance(step, ir.Constant):
            return down
        return self._builder.select(self._builder.icmp_signed(">", step, WORD(0)), up, down)

    def _for_each(self, statement: ast.For, values: Sequence[Typed]) -> None:
        """The body once for each of some values."""
        end = self._builder.append_basic_block("end")
        for value in values:
            onward = self._builder.append_basic_block("next")
            self._store(statement.target, value)
            self._repeat(_Turn(onward, end), statement)
            self._builder.position_at_end(onward)
        self._builder.branch(end)
        self._builder.position_at_end(end)

    def _break(self, statement: ast.Break) -> None:
        turn = self._turns[-1]
        if turn.end is None:
            turn.end = self._builder.append_basic_block("end")
        self._builder.branch(turn.end)

    def _continue(self, statement: ast.Continue) -> None:
        self._builder.branch(self._turns[-1].onward)

    def _give(self, statement: ast.Return) -> None:
        if statement.value is None:
            self._return(types.none, self._context.get_dummy_value())
        else:
            self._return(*self.typed(statement.value))

    def _return(self, kind: Any, value: Any) -> None:
        if self._kinds.result is None:
            self._kinds.result = types.unliteral(kind)
            self._settle(self._kinds.result)
        wanted = self._kinds.result
        if wanted != types.unliteral(kind) and (wider := self.unified(wanted, kind)) != wanted:
            if isinstance(wider, types.Optional):
                raise StrayError("an end without a result")
            self._kinds.result = wider
            raise WiderError
        result = self._context.get_return_value(self._builder, wanted, self.cast((kind, value), wanted))
        self._context.call_conv.return_value(self._builder, result)


_FORMS: dict[type, Callable[[Structured, Any], None]] = {
    ast.Assign: Structured._assign,
    ast.AugAssign: Structured._augment,
    ast.Expr: Structured._expression,
    ast.If: Structured._branch,
    ast.While: Structured._while,
    ast.For: Structured._for,
    ast.Break: Structured._break,
    ast.Continue: Structured._continue,
    ast.Return: Structured._give,
    ast.Pass: lambda code, statement: None,
}
