"""The memory of a series: where its inputs, states, histories and factors are, in doubles from its beginning.

In lanes every number that is given or comes out is a row, one number a run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from qddot.runner.machine.packing import Group, Packing
from qddot.runner.machine.recurrences import Factor

#: The highest order.
HIGHEST = 40
#: Memory begins with the numbers (in lanes: rows) of the sense of time, 1 or -1, and the time.
SENSE, NOW, _HEAD = 0, 1, 8

#: A factor: where it is, its number, and the places of the constants that it is multiplied by.
Placed = tuple[int, float, tuple[int, ...]]


@dataclass(eq=False)
class Memory:
    """Order k of state i is at states + k*state_stride + i*row; so are those of inputs, and of what conditions compare.

    sides + i: 1 where the value that condition i compares is below zero; factors: all that depend on parameters. row:
    doubles of a number, 1 or those of all lanes.
    """

    row: int = 1
    size: int = _HEAD
    inputs: int = 0
    input_stride: int = 0
    states: int = 0
    state_stride: int = 0
    compared: int = 0
    sides: int = 0
    side_stride: int = 0
    factors: list[Placed] = field(default_factory=list)
    _rows: dict[tuple[Factor | None, ...], int] = field(default_factory=dict)

    def take(self, count: int) -> int:
        """Room for so many doubles, from a whole cache line on."""
        place, self.size = self.size, self.size + -(-count // 8) * 8
        return place

    def take_history(self, count: int) -> int:
        """The same, an odd number of lines long: histories that are read together share no place in a cache."""
        lines = -(-count // 8)
        return self.take(8 * (lines + 1 - lines % 2))

    def factor_row(self, factors: Sequence[Factor | None], width: int) -> int:
        """The place of these factors side by side."""
        key = tuple(factors)
        if key not in self._rows:
            place = self._rows[key] = self.take(width * self.row)
            found = [(place + i * self.row, factor) for i, factor in enumerate(factors) if factor]
            self.factors += [(where, factor.number, factor.constants) for where, factor in found]
        return self._rows[key]

    def place_of(self, packing: Packing, group: Group) -> tuple[int, int]:
        """Where a group that is given begins, and the stride from one order to the next."""
        number = packing.kind(group.kind).index(group) * packing.width * self.row
        places = {
            "state": (self.states, self.state_stride),
            "input": (self.inputs, self.input_stride),
            "side": (self.sides, 0),
        }
        start, stride = places[group.kind]
        return start + number, stride


def memory_for(packing: Packing, row: int = 1) -> Memory:
    """Memory with room for what is given and what comes out, of each order on whole cache lines."""
    table, memory = packing.table, Memory(row=row, size=_HEAD * row)
    memory.state_stride = _padded(len(table.states) * row)
    memory.input_stride = _padded(len(table.inputs) * row)
    memory.side_stride = _padded(len(table.sides) * row)
    memory.states = memory.take((HIGHEST + 2) * memory.state_stride)
    memory.inputs = memory.take((HIGHEST + 1) * memory.input_stride)
    memory.compared = memory.take((HIGHEST + 1) * memory.side_stride)
    memory.sides = memory.take(memory.side_stride)
    return memory


def _padded(count: int) -> int:
    return -(-count // 8) * 8
