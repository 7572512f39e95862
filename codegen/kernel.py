"""`Kernel`: the one small value between mathematics and text."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
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
    """An entry of one of a generated function's arguments: state[3], matrix[0, 2], or the argument t itself."""

    argument: str
    index: tuple[int, ...]

    def __str__(self) -> str:
        return f"{self.argument}[{', '.join(map(str, self.index))}]" if self.index else self.argument


@dataclass(frozen=True)
class Kernel:
    """A straight-line function in single assignment form, checked at birth.

    reads: the symbols it may read. temporaries: (symbol, expression), each in reads and earlier temporaries.
    writes: (slot, expression), in index order. Expressions are SymEngine's.
    """

    reads: frozenset[Any]
    temporaries: tuple[Assignment, ...]
    writes: tuple[tuple[Slot, Any], ...]

    def __post_init__(self) -> None:
        known = set(self.reads)
        for symbol, expression in self.temporaries:
            if symbol in known:
                raise KernelError(f"{symbol} is assigned twice")
            if missing := symbols_of(expression) - known:
                raise KernelError(f"{symbol} = {expression} uses {missing} before assignment")
            known.add(symbol)
        for slot, expression in self.writes:
            if missing := symbols_of(expression) - known:
                raise KernelError(f"{slot} = {expression} uses {missing}, which nothing assigns")

    @cached_property
    def expressions(self) -> tuple[Any, ...]:
        """All right-hand sides in order."""
        return tuple(e for _, e in self.temporaries) + tuple(e for _, e in self.writes)

    @cached_property
    def used(self) -> frozenset[Any]:
        """All symbols that occur in a right-hand side, temporaries among them."""
        return frozenset().union(*(symbols_of(expression) for expression in self.expressions))

    @cached_property
    def calls(self) -> frozenset[str]:
        """Names of the functions of tables that it calls."""
        found: set[Any] = set().union(*(expression.atoms(se.FunctionSymbol) for expression in self.expressions))
        return frozenset(map(function_name, found))

    @cached_property
    def operations(self) -> int:
        """Additions, multiplications, divisions, powers and function calls, all counted as one."""
        return sum(operations(expression) for expression in self.expressions)

    def replace(self, temporaries: Iterable[Assignment], writes: Iterable[tuple[Slot, Any]]) -> "Kernel":
        """The same reads with other assignments, unchecked: `checked` follows at the end of a chain of rules."""
        kernel = object.__new__(Kernel)
        values = {"reads": self.reads, "temporaries": tuple(temporaries), "writes": tuple(writes)}
        for name, value in values.items():
            object.__setattr__(kernel, name, value)
        return kernel

    def checked(self) -> "Kernel":
        """The same kernel, after the check for single assignment form."""
        return Kernel(self.reads, self.temporaries, self.writes)

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        """What the kernel writes, as slot text -> number, computed slowly from the names of its reads: the truth.

        Raises KernelError where a read that is used has no value.
        """
        known = {symbol: values[str(symbol)] for symbol in self.reads & self.used if str(symbol) in values}
        for symbol, expression in self.temporaries:
            known[symbol] = number(expression, known)
        return {str(slot): number(expression, known) for slot, expression in self.writes}


def number(expression: Any, values: Mapping[Any, float]) -> float:
    """The value of an expression, by SymEngine's own arithmetic."""
    if missing := symbols_of(expression) - values.keys():
        raise KernelError(f"no value for {missing}")
    value = expression.subs({symbol: se.RealDouble(values[symbol]) for symbol in symbols_of(expression)})
    return float(value.n(53, real=True))
