"""Histories: the coefficients of all orders that sums over lower orders take, in memory as vectors side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from qddot.runner.machine.packing import Packing
from qddot.runner.machine.series_memory import HIGHEST, Memory
from qddot.runner.machine.vector_code import VectorCode

Names = tuple[str | None, ...]


class Emitter(Protocol):
    """What is asked of the emitter of a series; see `series.Emitter`."""

    packing: Packing
    code: VectorCode
    memory: Memory
    late: set[str]

    def gather(self, names: Sequence[str | None]) -> Any:
        """The nodes' coefficients side by side."""

    def next(self, names: Sequence[str | None]) -> Any:
        """The next coefficients of integrals."""

    def counted(self, values: Any) -> Any:
        """The number of the order times values."""


@dataclass(eq=False)
class Operand:
    """Coefficients of nodes side by side, as sums over lower orders take them.

    how: "" as they are; "counted" k times the k-th; "next" that of order k + 1. late: complete only when the unknowns
    of the order are known. depth: see `Packing`. current, first: those of this order, 0; done: whether all of it.
    histories: those that it is in.
    """

    names: Names
    how: str
    late: bool
    depth: int
    current: Any = None
    first: Any = None
    done: bool = False
    histories: list["History"] = field(default_factory=list)


@dataclass(eq=False)
class History:
    """Where all coefficients of operands side by side are in memory, as vectors of a code.

    current, before: those of this order, once all are complete, and of the order before, 0 in order 1. ahead: whether
    "next" ones of the same nodes are written there, one order ahead, so that they are theirs too.
    """

    operands: tuple[Operand, ...]
    place: int
    code: VectorCode
    ahead: bool = False
    current: Any = None
    before: Any = None


class Histories:
    """Those of a series, and what they are made of, in one order after the other: `begin`, `fetch`, `finish`."""

    def __init__(self, emitter: Emitter) -> None:
        self._emitter = emitter
        self._operands: dict[tuple[Names, str], Operand] = {}
        self._histories: dict[tuple[Operand | None, ...], History] = {}
        self._k: Any = None

    def operand(self, names: Sequence[str], how: str) -> Operand:
        """That of these nodes."""
        key = (tuple(names), how)
        if key not in self._operands:
            late = not self._emitter.late.isdisjoint(names)
            depth = max(self._emitter.packing.depths[name] for name in names)
            self._operands[key] = Operand(key[0], how, late, depth)
        return self._operands[key]

    def of(self, operands: tuple[Operand, ...]) -> History:
        """That of operands side by side."""
        if operands not in self._histories:
            narrow, count = self._emitter.code, 1 << (len(operands) - 1).bit_length()
            code = VectorCode(narrow.builder, count * narrow.width, narrow.lanes)
            place = self._emitter.memory.take_history((HIGHEST + 2) * code.size)
            self._histories[operands] = History(operands, place, code)
            for each in set(operands):
                each.histories.append(self._histories[operands])
        return self._histories[operands]

    def share(self) -> None:
        """Let those of the next order write to the history of the same nodes, where there is one."""
        for history in self._histories.values():
            plain = self._histories.get(tuple(self._operands.get((each.names, "")) for each in history.operands))
            if plain and all(each.how == "next" for each in history.operands):
                plain.ahead = True
                history.place = plain.place + plain.code.size

    def begin(self, k: Any) -> None:
        """Begin an order, the first where k is None."""
        self._k = k
        for operand in self._operands.values():
            operand.current, operand.done = None, False
        for history in self._histories.values():
            history.current = None

    def finish(self) -> None:
        """Write what the histories of this order still lack, all unknowns being known."""
        for operand in self._operands.values():
            if operand.late:
                operand.current = None
            if not operand.done:
                self.fetch(operand, final=True)

    def fetch(self, operand: Operand, final: bool = False) -> Any:
        """An operand's coefficients of this order, kept in its histories once they are complete."""
        if operand.current is None:
            emitter = self._emitter
            value = emitter.next(operand.names) if operand.how == "next" else emitter.gather(operand.names)
            operand.current = emitter.counted(value) if operand.how == "counted" else value
            if final or not operand.late:
                operand.done = True
                if self._k is None:
                    operand.first = operand.current
                for history in operand.histories:
                    if all(each.done for each in history.operands):
                        self._write(history)
        return operand.current

    def _write(self, history: History) -> None:
        history.current = history.code.beside([each.current for each in history.operands])
        if self._k is None or not history.ahead:
            history.code.store(history.current, history.place, self._k)
