"""LLVM's instructions of Python's expressions."""

import ast
import operator
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from numba import types

from qddot.runner.machine.text import StrayError
from qddot.runner.machine.values import BIT, Typed, Values, is_whole


class Expressions(Values):
    """Instructions at the end of a block; names: what global names mean."""

    def __init__(self, context: Any, builder: Any, names: Mapping[str, Any]) -> None:
        super().__init__(context, builder)
        self._names = names

    def local(self, name: str) -> Typed | None:
        """The value of a name of the function's own, None where it is none."""
        raise NotImplementedError

    def holds(self, name: str) -> bool:
        """Whether a name is one of the function's own."""
        raise NotImplementedError

    def number(self, node: ast.expr) -> Any:
        """The value of an expression as a float64."""
        return self.cast(self.typed(node))

    def typed(self, node: ast.expr) -> Typed:
        """The value of an expression."""
        form = _FORMS.get(type(node))
        if form is None:
            raise StrayError(type(node).__name__)
        found: Typed = getattr(self, form)(node)
        return found

    def true(self, node: ast.expr) -> Any:
        """Whether an expression is true, one bit."""
        kind, value = self.junction(node, self.true) if isinstance(node, ast.BoolOp) else self.typed(node)
        if kind == types.boolean:
            return value
        return self._context.is_true(self._builder, types.unliteral(kind), value)

    def text(self, node: ast.Constant) -> Typed:
        """A constant of the text."""
        return self.constant(node.value)

    def named(self, node: ast.Name) -> Typed:
        """The value of a name."""
        found = self.local(node.id)
        return found if found is not None else self.constant(self._global(node.id))

    def _global(self, name: str) -> Any:
        if name not in self._names:
            raise StrayError(name)
        return self._names[name]

    def _known(self, node: ast.expr) -> Any:
        """What a global name or an attribute of a module means; None where it is none."""
        if isinstance(node, ast.Name):
            return None if self.holds(node.id) else self._global(node.id)
        if isinstance(node, ast.Attribute) and isinstance(module := self._known(node.value), ModuleType):
            if not hasattr(module, node.attr):
                raise StrayError(node.attr)
            return getattr(module, node.attr)
        return None

    def attribute(self, node: ast.Attribute) -> Typed:
        """A constant of a module, or a field."""
        if (known := self._known(node)) is not None:
            return self.constant(known)
        return self.field(self.typed(node.value), node.attr)

    def arithmetic(self, node: ast.BinOp) -> Typed:
        """Sums and products from the left, which may be of thousands."""
        line: list[ast.BinOp] = []
        first: ast.expr = node
        while isinstance(first, ast.BinOp):
            line.append(first)
            first = first.left
        value = self.typed(first)
        for each in reversed(line):
            value = self.combined(type(each.op), value, self.typed(each.right))
        return value

    def opposite(self, node: ast.UnaryOp) -> Typed:
        """`not` of a truth, or minus a number."""
        if isinstance(node.op, ast.Not):
            return types.boolean, self._builder.not_(self.true(node.operand))
        if not isinstance(node.op, ast.USub):
            raise StrayError(type(node.op).__name__)
        if isinstance(node.operand, ast.Constant) and isinstance(node.operand.value, int | float):
            return self.constant(-node.operand.value)
        kind, value = self.typed(node.operand)
        if kind == types.float64:
            return kind, self._builder.fneg(value)
        if is_whole(kind):
            return types.int64, self._builder.neg(value)
        return self.result(operator.neg, [(kind, value)])

    def compared(self, node: ast.Compare) -> Typed:
        """A comparison; of several in a row all, none of which does more than compute."""
        left, found = self.typed(node.left), []
        for relation, other in zip(node.ops, node.comparators, strict=True):
            if isinstance(relation, ast.In):
                found.append(self._among(left, other))
                continue
            right = self.typed(other)
            found.append(self.related(type(relation), left, right))
            left = right
        value = found[0]
        for each in found[1:]:
            value = self._builder.and_(value, each)
        return types.boolean, value

    def _among(self, value: Typed, others: ast.expr) -> Any:
        if not isinstance(others, ast.Tuple):
            raise StrayError("in")
        found = BIT(False)
        for each in others.elts:
            found = self._builder.or_(found, self.related(ast.Eq, value, self.typed(each)))
        return found

    def junction(self, node: ast.BoolOp, last: Callable[[ast.expr], Any] | None = None) -> Typed:
        """Of truths; what comes after the one that decides is not computed. last: what gives the truth of the last."""
        end = self._builder.append_basic_block("decided")
        decided: list[tuple[Any, Any]] = []
        for part in node.values[:-1]:
            found = self.true(part)
            decided.append((found, self._builder.block))
            more = self._builder.append_basic_block("more")
            self._builder.cbranch(found, *((more, end) if isinstance(node.op, ast.And) else (end, more)))
            self._builder.position_at_end(more)
        decided.append(((last or self._truth)(node.values[-1]), self._builder.block))
        self._builder.branch(end)
        self._builder.position_at_end(end)
        return types.boolean, self.joined(BIT, decided)

    def _truth(self, node: ast.expr) -> Any:
        kind, value = self.typed(node)
        if kind != types.boolean:
            raise StrayError(f"and, or of {kind}")
        return value

    def choice(self, node: ast.IfExp) -> Typed:
        """One of two values, of which the other is not computed."""
        then, other, end = (self._builder.append_basic_block(name) for name in ("then", "else", "chosen"))
        self._builder.cbranch(self.true(node.test), then, other)
        found = []
        for block, part in ((then, node.body), (other, node.orelse)):
            self._builder.position_at_end(block)
            found.append((self.typed(part), self._builder.block))
        kind = self.unified(found[0][0][0], found[1][0][0])
        values = []
        for value, block in found:
            self._builder.position_at_end(block)
            values.append((self.cast(value, kind), self._builder.block))
            self._builder.branch(end)
        self._builder.position_at_end(end)
        return kind, self.joined(self._context.get_value_type(kind), values)

    def several(self, node: ast.Tuple) -> Typed:
        """A tuple."""
        return self.together([self.typed(each) for each in node.elts])

    def item(self, node: ast.Subscript) -> Typed:
        """An item of an array, at a pointer, or of a tuple."""
        base, where = self.typed(node.value), self.indices(node.slice)
        if isinstance(base[0], types.BaseTuple) and isinstance(where[0][0], types.IntegerLiteral):
            return self.part(base, where[0][0].literal_value)
        if (place := self.place(base, where)) is not None:
            return self.loaded(base[0].dtype, place)
        index = where[0] if len(where) == 1 else self.together(where)
        return self.result(operator.getitem, [base, index])

    def indices(self, node: ast.expr) -> list[Typed]:
        """What stands between brackets, integers."""
        found = [self.typed(each) for each in (node.elts if isinstance(node, ast.Tuple) else [node])]
        if not all(is_whole(kind) for kind, _ in found):
            raise StrayError("an index")
        return found

    def called(self, node: ast.Call) -> Typed:
        """A call of what compiled code can call."""
        if node.keywords or any(isinstance(each, ast.Starred) for each in node.args):
            raise StrayError("a call by keywords")
        arguments = [self.typed(part) for part in node.args]
        function = self._known(node.func)
        if (function is min or function is max) and len(arguments) > 1:
            return self.extreme(ast.Lt if function is min else ast.Gt, arguments)
        if function is not None:
            return self.result(function, arguments)
        return self.result_of(self.typed(node.func)[0], arguments)


#: What gives each expression, by name: straight lines have forms of their own.
_FORMS: dict[type, str] = {
    ast.Name: "named",
    ast.Constant: "text",
    ast.Attribute: "attribute",
    ast.BinOp: "arithmetic",
    ast.UnaryOp: "opposite",
    ast.Subscript: "item",
    ast.Call: "called",
    ast.Compare: "compared",
    ast.BoolOp: "junction",
    ast.IfExp: "choice",
    ast.Tuple: "several",
}
