"""LLVM's instructions of a function's statements: branches, loops, results.

Where a result turns out to be of a wider type than the first one, all is emitted once more with that.
"""

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from llvmlite import ir
from numba import types

from qddot.runner.machine.assignments import Assignments, WiderError
from qddot.runner.machine.text import StrayError
from qddot.runner.machine.values import WORD, Typed, is_whole


@dataclass
class _Turn:
    """Where a loop goes on; end: made when something leaves the loop."""

    onward: Any
    end: Any = None


class Structured(Assignments):
    """Instructions of a function, see `Assignments`."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self._turns: list[_Turn] = []

    def emit(self) -> None:
        """All of them."""
        self.run(self._function.body)
        if not self._ended():
            self._return(types.none, self._context.get_dummy_value())

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
        self.store(statement.target, (types.int64, value))
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
            self.store(statement.target, value)
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

    def _settle(self) -> None:
        """Let the function have its result, where it had none: the first argument says where it goes."""
        description, function = self._context.fndesc, self._builder.function
        description.restype = self._kinds.result
        made = self._context.call_conv.get_function_type(description.restype, description.argtypes)
        function.ftype, function.type, function.args[0].type = made, made.as_pointer(), made.args[0]

    def _return(self, kind: Any, value: Any) -> None:
        if self._kinds.result is None:
            self._kinds.result = types.unliteral(kind)
            self._settle()
        wanted = self._kinds.result
        if wanted != types.unliteral(kind) and (wider := self.unified(wanted, kind)) != wanted:
            if isinstance(wider, types.Optional):
                raise StrayError("an end without a result")
            self._kinds.result = wider
            raise WiderError
        result = self._context.get_return_value(self._builder, wanted, self.cast((kind, value), wanted))
        self._context.call_conv.return_value(self._builder, result)


_FORMS: dict[type, Callable[[Structured, Any], None]] = {
    ast.Assign: Structured.assign,
    ast.AugAssign: Structured.augment,
    ast.Expr: Structured._expression,
    ast.If: Structured._branch,
    ast.While: Structured._while,
    ast.For: Structured._for,
    ast.Break: Structured._break,
    ast.Continue: Structured._continue,
    ast.Return: Structured._give,
    ast.Pass: lambda code, statement: None,
}
