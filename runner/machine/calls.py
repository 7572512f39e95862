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
    """Call a right-hand side in lanes at an address; the others are addresses, too."""
    return _with_addresses(abi.LANE_KERNELS["rhs"])


@intrinsic
def call_advance(
    typing_context: Any, where: Any, t: Any, x: Any, u: Any, c: Any, result: Any, base: Any, target: Any, h: Any,
    weight: Any,
) -> Any:  # fmt: skip
    """Call one that advances states, too, at an address; the others but the weight are addresses, too."""
    return _with_addresses(abi.LANE_KERNELS["advance"])


def _with_addresses(kernel: Any) -> Any:
    """Type and code of a call of a function of this signature that is handed addresses for pointers."""
    _, call = caller(kernel)

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        where, *given = arguments
        double = ir.DoubleType().as_pointer()
        pairs = zip(given, kernel.args, strict=True)
        handed = [builder.inttoptr(each, double) if kind == abi.POINTER else each for each, kind in pairs]
        return call(context, builder, signature, [where, *handed])

    return types.void(types.int64, *(types.int64 if kind == abi.POINTER else kind for kind in kernel.args)), emit


@intrinsic
def take_next(typing_context: Any, where: Any) -> Any:
    """Add one to the int64 at an address and give what it was; threads may do so at the same time."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        return builder.atomic_rmw("add", place, ir.IntType(64)(1), "monotonic")

    return types.int64(types.int64), emit
