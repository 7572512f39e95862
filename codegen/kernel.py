"""`Kernel`: the one small value between mathematics and text."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import symengine as se

from qddot.codegen.convert import function_name
from qddot.codegen.nodes import symbols_of
from qddot.codegen.rewrite import operations

Assignment = tuple[Any, Any]


class KernelError(Exception):
    """A kernel that is not in single assignment form: a fault of the generator, never of a model."""


@dataclass(frozen=True)
class Slot:
    """An entry of one of a generated function's arguments: state[3], matrix[0, 2], or the argument t itself.

    adds: what is written is added to what stands there. loop: which of a kernel's loops it is written in, index being
    that of the first cell, steps how far it goes from one to the next.
    """

    argument: str
    index: tuple[int, ...]
    adds: bool = False
    loop: int | None = None
    steps: tuple[int, ...] = ()

    @property
    def item(self) -> tuple[str, tuple[int, ...]]:
        """Where it is, or begins."""
        return self.argument, self.index

    def __str__(self) -> str:
        return f"{self.argument}[{', '.join(map(str, self.index))}]" if self.index else self.argument


@dataclass(frozen=True)
class Loop:
    """What is done for each of many cells. symbols: what stands for a symbol of each cell -> those, in order."""

    counter: str
    count: int
    symbols: Mapping[Any, tuple[Any, ...]]


@dataclass(frozen=True)
class Kernel:
    """A straight-line function in single assignment form, checked at birth.

    reads: the symbols it may read. temporaries: (symbol, expression), each in reads and earlier temporaries.
    writes: (slot, expression), in index order. Expressions are SymEngine's. loops: parts that are done for many cells;
    what holds a symbol that stands for those of cells, if by way of temporaries, belongs to its loop. kept: symbols
    that are read from arrays of its own, which it writes first -> their items.
    """

    reads: frozenset[Any]
    temporaries: tuple[Assignment, ...]
    writes: tuple[tuple[Slot, Any], ...]
    loops: tuple[Loop, ...] = ()
    kept: Mapping[Any, Slot] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = set(self.reads).union(self.kept, *(loop.symbols for loop in self.loops))
        for symbol, expression in self.temporaries:
            if symbol in known:
                raise KernelError(f"{symbol} is assigned twice")
            if not symbols_of(expression) <= known:
                raise KernelError(f"{symbol} = {expression} uses {symbols_of(expression) - known} before assignment")
            known.add(symbol)
        for slot, expression in self.writes:
            if not symbols_of(expression) <= known:
                raise KernelError(f"{slot} = {expression} uses {symbols_of(expression) - known}, which nothing assigns")

    @cached_property
    def expressions(self) -> tuple[Any, ...]:
        """All right-hand sides in order."""
        return tuple(e for _, e in self.temporaries) + tuple(e for _, e in self.writes)

    @cached_property
    def held(self) -> frozenset[Any]:
        """All symbols that occur in a right-hand side, temporaries among them."""
        return frozenset().union(*(symbols_of(expression) for expression in self.expressions))

    @cached_property
    def used(self) -> frozenset[Any]:
        """The same, and those of all cells."""
        cells = (loop.symbols[each] for loop in self.loops for each in self.held & loop.symbols.keys())
        return self.held.union(*cells)

    @cached_property
    def homes(self) -> Mapping[Any, int]:
        """The loop that a symbol belongs to."""
        found = {symbol: k for k, loop in enumerate(self.loops) for symbol in loop.symbols}
        for symbol, expression in self.temporaries if found else ():
            for each in symbols_of(expression) & found.keys():
                found[symbol] = found[each]
        return found

    @cached_property
    def calls(self) -> frozenset[str]:
        """Names of the functions of tables that it calls."""
        found: set[Any] = set().union(*(expression.atoms(se.FunctionSymbol) for expression in self.expressions))
        return frozenset(map(function_name, found))

    @cached_property
    def operations(self) -> int:
        """Additions, multiplications, divisions, powers and function calls, all counted as one."""
        return sum(operations(expression) for expression in self.expressions)

    def entries(self, writes: Iterable[tuple[Slot, Any]]) -> int:
        """How many items are written, those of loops in each cell."""
        return sum(1 if slot.loop is None else self.loops[slot.loop].count for slot, _ in writes)

    def indices(self, slot: Slot) -> list[tuple[int, ...]]:
        """The index of a slot, or those in all cells of its loop."""
        if slot.loop is None:
            return [slot.index]
        pairs = list(zip(slot.index, slot.steps, strict=True))
        return [tuple(first + step * cell for first, step in pairs) for cell in range(self.loops[slot.loop].count)]

    def replace(self, temporaries: Iterable[Assignment], writes: Iterable[tuple[Slot, Any]]) -> "Kernel":
        """The same reads with other assignments, unchecked: `checked` follows at the end of a chain of rules."""
        kernel = object.__new__(Kernel)
        parts = {"temporaries": tuple(temporaries), "writes": tuple(writes)}
        same = {"reads": self.reads, "loops": self.loops, "kept": self.kept}
        for name, value in (parts | same).items():
            object.__setattr__(kernel, name, value)
        return kernel

    def checked(self) -> "Kernel":
        """The same kernel, after the check for single assignment form."""
        return replace(self)

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        """What the kernel writes, as slot text -> number, computed slowly from the names of its reads: the truth.

        Raises KernelError where a read that is used has no value.
        """
        known = {symbol: values[str(symbol)] for symbol in self.reads & self.used if str(symbol) in values}
        found: dict[str, float] = {}
        items = {str(slot): symbol for symbol, slot in self.kept.items()}
        for first in (True, False):
            self._assign(known, None)
            for k in (None, *range(len(self.loops))):
                writes = [write for write in self.writes if write[0].loop == k]
                now = [write for write in writes if (write[0].argument in self.arrays) is first]
                self._evaluate(now, k, known, found)
            known |= {symbol: found[item] for item, symbol in items.items()}
        return {item: value for item, value in found.items() if item not in items}

    @cached_property
    def arrays(self) -> Mapping[str, int]:
        """The arrays of its own that values are kept in, and their lengths."""
        return Counter(slot.argument for slot in self.kept.values())

    def _evaluate(
        self, writes: Sequence[tuple[Slot, Any]], loop: int | None, known: Mapping[Any, float], found: dict[str, float]
    ) -> None:
        """Compute what is written in a loop, or in none."""
        columns = self.loops[loop].symbols if loop is not None else {}
        for cell in range(self.loops[loop].count if loop is not None and writes else bool(writes)):
            standing = {each: known[column[cell]] for each, column in columns.items() if column[cell] in known}
            inside = {**known, **standing}
            self._assign(inside, loop)
            for slot, expression in writes:
                item = str(Slot(slot.argument, self.indices(slot)[cell]))
                found[item] = number(expression, inside) + (found[item] if slot.adds else 0.0)

    def _assign(self, known: dict[Any, float], loop: int | None) -> None:
        """Compute the temporaries of a loop, or those of none, as far as what they need is known."""
        for symbol, expression in self.temporaries:
            if self.homes.get(symbol) == loop and symbols_of(expression) <= known.keys():
                known[symbol] = number(expression, known)


def number(expression: Any, values: Mapping[Any, float]) -> float:
    """The value of an expression, by SymEngine's own arithmetic; NaN where it is no real number."""
    symbols = list(symbols_of(expression))
    if missing := set(symbols) - values.keys():
        raise KernelError(f"no value for {missing}")
    numbers = [float(values[symbol]) for symbol in symbols]
    try:
        exact = expression.subs(dict(zip(symbols, map(se.RealDouble, numbers), strict=True)))
        return float(exact.n(53, real=True))
    except RuntimeError:  # sign(0.3 - pi), and what is complex on the way; this is slower, and real throughout
        one_at_least = se.Dummy()
        return float(se.Lambdify([*symbols, one_at_least], [expression], backend="lambda")([*numbers, 0.0])[0])
