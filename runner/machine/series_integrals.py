"""States, and what else is an integral: their coefficients of the next order.

A few go on from order to order in registers. Many would not stay there: they are read again where they were written,
and written as soon as their rates are known.
"""

from collections.abc import Sequence
from typing import Any, Protocol

from qddot.runner.machine.packing import Group, Packing
from qddot.runner.machine.recurrences import Factor, Recurrences
from qddot.runner.machine.series_memory import Memory
from qddot.runner.machine.vector_code import VectorCode

#: Vectors of states that go on in registers: of these there are 16 with AVX2, and a vector of eight doubles takes two.
_IN_REGISTERS = 8


class Emitter(Protocol):
    """What is asked of the emitter of a series; see `series.Emitter`."""

    packing: Packing
    code: VectorCode
    memory: Memory
    table: Recurrences
    current: dict[int, Any]
    step: Any

    def gather(self, names: Sequence[str | None]) -> Any:
        """The nodes' coefficients side by side."""

    def scaled(self, values: Any, factors: Sequence[Factor | None], total: Any = None) -> Any:
        """Factors times values, plus a total."""


def is_integral(group: Group) -> bool:
    """Whether it is made of integrals."""
    return group.kind == "state" or group.kind.startswith("integral")


class Integrals:
    """Those of a packing, in one order after the other: `begin`, then `follow` whenever more is known."""

    def __init__(self, emitter: Emitter) -> None:
        self._emitter = emitter
        self._groups = [each for each in emitter.packing.groups if each.live and is_integral(each)]
        states = [each for each in self._groups if each.kind == "state"]
        many = emitter.code.width > 1 and len(states) > _IN_REGISTERS
        self._read_again = {each.index: each for each in states} if many else {}
        self._following: dict[int, Any] = {}
        self._k: Any = None

    def carried(self) -> list[Any]:
        """The next coefficients of those that go on in registers."""
        return [self._following[each.index] for each in self._carried]

    def begin(self, k: Any, held: Sequence[Any] = ()) -> None:
        """Begin an order; held: its coefficients of those that were `carried`, of which order 0 has none."""
        current = self._emitter.current
        if held:
            current |= {each.index: value for each, value in zip(self._carried, held, strict=True)}
        for index in self._read_again:
            current.pop(index, None)
        self._k, self._following = k, {}

    def read(self, index: int) -> Any:
        """A group's coefficients of this order."""
        current, code, memory = self._emitter.current, self._emitter.code, self._emitter.memory
        if index not in current and index in self._read_again:
            place, stride = memory.place_of(self._emitter.packing, self._read_again[index])
            current[index] = code.load(place, self._k, stride)
        return current[index]

    def follow(self, known: set[int] | None = None) -> None:
        """Write the next coefficients of those whose rates are known, once; known: groups, None for all.

        Where states go on in registers, all are written at the end. Those that are read again count as known when
        something has read them: what is computed of them while they are in a register need not be read once more.
        """
        if known is not None and not self._read_again:
            return
        current = self._emitter.current
        ready = None if known is None else (known | self._read_again.keys()) & current.keys()
        for group in self._groups:
            if group.index not in self._following and (ready is None or self._sources(group) <= ready):
                value = self._following[group.index] = self.next([node.name for node in group.nodes])
                if group.kind == "state":
                    stride = self._emitter.memory.state_stride
                    place, _ = self._emitter.memory.place_of(self._emitter.packing, group)
                    self._emitter.code.store(value, place + stride, self._k, stride)

    def next(self, names: Sequence[str | None]) -> Any:
        """The next coefficients of integrals."""
        nodes = [self._emitter.table.nodes[name] if name else None for name in names]
        rates = self._emitter.gather([node.arguments[0] if node else None for node in nodes])
        scaled = self._emitter.scaled(rates, [node.factors[0] if node else None for node in nodes])
        return self._emitter.code.multiply(scaled, self._emitter.step)

    @property
    def _carried(self) -> list[Group]:
        return [each for each in self._groups if each.index not in self._read_again]

    def _sources(self, group: Group) -> set[int]:
        return {self._emitter.packing.home[node.arguments[0]][0] for node in group.nodes}
