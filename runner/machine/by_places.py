"""Compiled loops that Python calls with the places of their records.

To hand over a record costs Python 2 µs, as numba looks its type up in each call; its address costs nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, intrinsic, place
from qddot.runner.machine.pointers import caller, pointer

_PLACES = types.Array(types.int64, 1, "C")


@dataclass(frozen=True, eq=False)
class Loop:
    """A compiled function of records and a count, which returns an int."""

    function: Any
    _call: Callable[[int, NDArray[np.int64], int], int]
    _where: int

    def of(self, *records: np.void) -> Callable[[int], int]:
        """It with these records, in its order, which live as long: to be called with the count."""
        return partial(self._go, np.array([place(each) for each in records]), records)

    def _go(self, places: NDArray[np.int64], kept: tuple[np.void, ...], count: int) -> int:
        return self._call(self._where, places, count)


def by_places(function: Callable[..., int], *layouts: np.dtype) -> Loop:
    """function(*records, count) compiled for records of these layouts, four to seven; it allocates nothing."""
    signature = types.int64(*map(from_dtype, layouts), types.int64)
    made = compiled(signature, **BY_ADDRESS)(function)
    return Loop(made, _caller(len(layouts)), pointer(made, signature, function.__qualname__))


@cache
def _caller(count: int) -> Any:
    """What calls all loops of so many records: of each only the address counts."""
    return compiled(types.int64(types.int64, _PLACES, types.int64), nogil=True)(_CALLERS[count])


def _of(count: int) -> Any:
    """What calls a loop of so many records at an address, in compiled code."""
    _, call = caller(types.int64(*count * [types.voidptr], types.int64))

    @intrinsic
    def call_loop(typing_context: Any, where: Any, places: Any, most: Any) -> Any:
        def emit(context: Any, builder: Any, own: Any, arguments: Any) -> Any:
            items = context.data_model_manager[_PLACES].get(builder, arguments[1], "data")
            found = (builder.load(builder.gep(items, [ir.Constant(ir.IntType(64), k)])) for k in range(count))
            kind = context.get_value_type(types.voidptr)
            records = [builder.inttoptr(each, kind) for each in found]
            return call(context, builder, own, [arguments[0], *records, arguments[2]])

        return types.int64(types.int64, _PLACES, types.int64), emit

    return call_loop


_of_four, _of_five, _of_six, _of_seven = map(_of, (4, 5, 6, 7))


def _four(where, places, count):
    return _of_four(where, places, count)


def _five(where, places, count):
    return _of_five(where, places, count)


def _six(where, places, count):
    return _of_six(where, places, count)


def _seven(where, places, count):
    return _of_seven(where, places, count)


_CALLERS: dict[int, Any] = {4: _four, 5: _five, 6: _six, 7: _seven}
