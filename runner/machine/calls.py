"""Addresses as pointers, and calls by address, in compiled functions of lanes."""

from typing import Any

from llvmlite import ir
from numba import types

from qddot.runner import abi
from qddot.runner.machine.memory import intrinsic
from qddot.runner.machine.pointers import caller

#: Arguments of lane loops that are rows of integers.
INTEGERS = types.CPointer(types.int64)


@intrinsic
def doubles(typing_context: Any, where: Any) -> Any:
    """The pointer to float64 at an address."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], ir.DoubleType().as_pointer())

    return abi.POINTER(types.int64), emit


@intrinsic
def numbers(typing_context: Any, where: Any) -> Any:
    """The pointer to int64 at an address."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())

    return INTEGERS(types.int64), emit


@intrinsic
def call_lanes(typing_context: Any, where: Any, t: Any, x: Any, u: Any, c: Any, result: Any) -> Any:
    """Call a lane kernel of the calling convention at an address; the others are addresses, too."""
    _, call = caller(abi.LANE_KERNEL)

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointers = [builder.inttoptr(each, ir.DoubleType().as_pointer()) for each in arguments[1:]]
        return call(context, builder, signature, [arguments[0], *pointers])

    return types.void(*[types.int64] * 6), emit


@intrinsic
def take_next(typing_context: Any, where: Any) -> Any:
    """Add one to the int64 at an address and give what it was; threads may do so at the same time."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        return builder.atomic_rmw("add", place, ir.IntType(64)(1), "monotonic")

    return types.int64(types.int64), emit
