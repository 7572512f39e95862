"""Long straight lines as a table and a loop over it, so that what is compiled does not grow with their length.

The table says group by group which shape comes next, how often, and on which operands: see `straight_shapes`. Steps of
a group need each other's values nowhere; they follow those that they need.
"""

import ast
from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner.machine.straight_parts import Run
from qddot.runner.machine.straight_shapes import Shape, Steps, steps_of

_WORD, _HALF, _BYTE, _DOUBLE = ir.IntType(64), ir.IntType(32), ir.IntType(8), ir.DoubleType()


@dataclass(frozen=True)
class Table:
    """A run as a table: per group the place of its shape, how many steps, and of each its operands.

    numbers: what stands in the frame from `first` on. behind: where the values of the steps begin, in their order.
    """

    shapes: tuple[Shape, ...]
    entries: "array[int]"
    groups: int
    numbers: "array[float]"
    first: int
    behind: int


def tables(
    found: Sequence[Run], number: Callable[[ast.expr], float], short: int
) -> tuple[dict[int, Table], dict[str, int], int]:
    """The tables of runs of more than `short` operations by their places, the places of names in the frame, its length.

    number: what a constant is.
    """
    steps = {k: steps_of(run, number) for k, run in enumerate(found) if run.apart and run.length > short}
    kept: dict[str, int] = {}
    made: dict[int, Table] = {}
    length = 0
    for k, each in steps.items():
        if each is None:
            continue
        for name in each.outside:
            if name not in kept:
                kept[name], length = length, length + 1
        made[k], places, length = _table(each, kept, length)
        kept |= places
    return made, kept, length


def _table(steps: Steps, kept: Mapping[str, int], first: int) -> tuple[Table, dict[str, int], int]:
    """A table whose numbers stand at `first`, the places of its names, and where its values end."""
    places: dict[Any, int] = {("name", name): kept[name] for name in steps.outside}
    places |= {("number", text): first + k for k, text in enumerate(steps.numbers)}
    end = behind = first + len(steps.numbers)
    entries, groups = array("i"), 0
    ordered = sorted(steps.steps, key=lambda step: (step.level, step.shape))
    for (_, shape), alike in groupby(ordered, key=lambda step: (step.level, step.shape)):
        group = list(alike)
        groups += 1
        entries.extend((shape, len(group)))
        for step in group:
            entries.extend([each if isinstance(each, int) else places[each] for each in step.operands])
            if step.value is not None:
                places[step.value], end = end, end + 1
    names = {value[1]: place for value, place in places.items() if value[0] == "name"}
    numbers = array("d", map(float.fromhex, steps.numbers))
    return Table(tuple(steps.shapes), entries, groups, numbers, first, behind), names, end


class Loop:
    """The instructions of a table at the end of a block. code: what makes those of expressions; frame: the values."""

    def __init__(self, code: Any, builder: Any, table: Table, frame: Any) -> None:
        self._code, self._builder, self._table, self._frame = code, builder, table, frame
        self._words = self._constant(table.entries, _HALF)
        self._next = cgutils.alloca_once_value(builder, _WORD(0))
        self._place = cgutils.alloca_once_value(builder, _WORD(table.behind))

    def emit(self) -> None:
        """All of it."""
        builder, table = self._builder, self._table
        if table.numbers:
            size = _WORD(8 * len(table.numbers))
            cgutils.raw_memcpy(builder, self._at(table.first), self._constant(table.numbers, _DOUBLE), size, 1)
        with cgutils.for_range(builder, _WORD(table.groups)):
            shape, count = self._word(), self._word()
            behind = builder.append_basic_block("behind")
            choice = builder.switch(shape, behind)
            for k, each in enumerate(table.shapes):
                block = builder.append_basic_block(f"shape_{k}")
                choice.add_case(_WORD(k), block)
                builder.position_at_end(block)
                with cgutils.for_range(builder, count):
                    self._step(each)
                builder.branch(behind)
            builder.position_at_end(behind)

    def _step(self, shape: Shape) -> None:
        value = self._sum() if shape.expression is None else self._value(shape)
        if shape.target is not None:
            self._code.store(shape.target, (types.float64, value))
            return
        place = self._builder.load(self._place)
        self._builder.store(value, self._at(place))
        self._builder.store(self._builder.add(place, _WORD(1)), self._place)

    def _value(self, shape: Shape) -> Any:
        for k, is_index in enumerate(shape.indices):
            word = self._word()
            typed = (types.intp, word) if is_index else (types.float64, self._builder.load(self._at(word)))
            self._code.name(str(k), typed)
        return self._code.number(shape.expression)

    def _sum(self) -> Any:
        added, taken = self._word(), self._word()
        total = cgutils.alloca_once_value(self._builder, _DOUBLE(0.0))
        self._builder.store(_DOUBLE(0.0), total)
        for count, operation in ((added, self._builder.fadd), (taken, self._builder.fsub)):
            with cgutils.for_range(self._builder, count):
                each = self._builder.load(self._at(self._word()))
                self._builder.store(operation(self._builder.load(total), each), total)
        return self._builder.load(total)

    def _word(self) -> Any:
        """The next entry of the table."""
        place = self._builder.load(self._next)
        self._builder.store(self._builder.add(place, _WORD(1)), self._next)
        return self._builder.sext(self._builder.load(self._builder.gep(self._words, [place])), _WORD)

    def _at(self, place: Any) -> Any:
        return self._builder.gep(self._frame, [_WORD(place) if isinstance(place, int) else place])

    def _constant(self, values: Any, kind: Any) -> Any:
        """Where these values stand, which never change."""
        data = ir.Constant(ir.ArrayType(_BYTE, len(values) * values.itemsize), bytearray(values.tobytes()))
        name = self._builder.module.get_unique_name("table")
        found = cgutils.global_constant(self._builder.module, name, data)
        found.align = values.itemsize
        return self._builder.bitcast(found, kind.as_pointer())
