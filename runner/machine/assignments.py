"""LLVM's instructions of assignments: a place in memory for each name, whose type it keeps throughout.

Where a later assignment needs a wider one (an integer first, a float then), all is emitted once more with that.
"""

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from numba import types
from numba.core import cgutils

from qddot.runner.machine.expressions import Expressions
from qddot.runner.machine.text import StrayError
from qddot.runner.machine.values import Typed


class WiderError(Exception):
    """A type was not the one that it has to be; what `Kinds` holds is, now."""


@dataclass
class Kinds:
    """Types found so far: of names, and of the result, None where it is not known."""

    result: Any
    names: dict[str, Any] = field(default_factory=dict)


class Assignments(Expressions):
    """Instructions of a function, its text a tree, at the end of a block. arguments: by name; kinds: see there."""

    def __init__(
        self,
        context: Any,
        builder: Any,
        names: Mapping[str, Any],
        arguments: Mapping[str, Typed],
        function: ast.FunctionDef,
        kinds: Kinds,
    ) -> None:
        super().__init__(context, builder, names)
        self._function, self._kinds, self._given = function, kinds, dict(arguments)
        named = [each for each in ast.walk(function) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)]
        self._own = {each.id for each in named}
        self._places: dict[str, Any] = {}
        for name in sorted(self._own & self._given.keys()):
            self.name(name, self._given.pop(name))

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

    def assign(self, statement: ast.Assign) -> None:
        """An assignment."""
        target = statement.targets[0]
        if isinstance(statement.value, ast.Tuple) and isinstance(target, ast.Tuple) and len(statement.targets) == 1:
            values = [self.typed(each) for each in statement.value.elts]
            if len(values) != len(target.elts):
                raise StrayError(f"{len(target.elts)} names for {len(values)} values")
            for part, each in zip(target.elts, values, strict=True):
                self.store(part, each)
            return
        value = self.typed(statement.value)
        for target in statement.targets:
            self.store(target, value)

    def store(self, target: ast.expr, value: Typed) -> None:
        """A value gets a name, or goes into an item or a field, or its parts do."""
        if isinstance(target, ast.Name):
            self.name(target.id, value)
        elif isinstance(target, ast.Tuple) and isinstance(value[0], types.BaseTuple):
            if len(target.elts) != len(value[0]):
                raise StrayError(f"{len(target.elts)} names for {value[0]}")
            for k, part in enumerate(target.elts):
                self.store(part, self.part(value, k))
        elif isinstance(target, ast.Subscript):
            kind, place = self._item(target)
            self.stored(kind, value, place)
        elif isinstance(target, ast.Attribute):
            self._onto(self.typed(target.value), target.attr, value)
        else:
            raise StrayError(f"an assignment to {type(target).__name__}")

    def _item(self, target: ast.Subscript) -> tuple[Any, Any]:
        """The type of an item, and where it stands."""
        base, where = self.typed(target.value), self.indices(target.slice)
        place = self.place(base, where)
        if place is None:
            raise StrayError(f"an item of {base[0]}")
        return base[0].dtype, place

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

    def augment(self, statement: ast.AugAssign) -> None:
        """A change in place."""
        target, operation = statement.target, type(statement.op)
        if isinstance(target, ast.Name):
            before = self.named(target)
            self.name(target.id, self.combined(operation, before, self.typed(statement.value)))
        elif isinstance(target, ast.Attribute):
            base = self.typed(target.value)
            added = self.combined(operation, self.field(base, target.attr), self.typed(statement.value))
            self._onto(base, target.attr, added)
        else:
            kind, place = self._item(target)
            before = self.loaded(kind, place)
            self.stored(kind, self.combined(operation, before, self.typed(statement.value)), place)
