"""Calls of a series' functions by address, in compiled code; see `series_code`."""

from typing import Any

from llvmlite import ir
from numba import types

from qddot.runner.machine.memory import intrinsic
from qddot.runner.machine.vector_code import INTEGER, SCALAR

_POINTER = SCALAR.as_pointer()


def _caller(*kinds: Any) -> Any:
    """The code of a call of a C function at an address, which returns nothing; pointers are given as addresses."""
    function = ir.FunctionType(ir.VoidType(), kinds)

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        where, *others = arguments
        values = [builder.inttoptr(x, k) if k is _POINTER else x for x, k in zip(others, kinds, strict=True)]
        builder.call(builder.inttoptr(where, function.as_pointer()), values)
        return context.get_dummy_value()

    return emit


@intrinsic
def call_series(typing_context: Any, where: Any, memory: Any, order: Any) -> Any:
    """Write the coefficients of all states up to an order, from what stands in the memory at an address."""
    return types.void(types.int64, types.int64, types.int64), _caller(_POINTER, INTEGER)


@intrinsic
def call_polynomial(typing_context: Any, where: Any, memory: Any, order: Any, time: Any, target: Any) -> Any:
    """Write the states at a time from where the series stands to an address, with room for a whole row."""
    signature = types.void(types.int64, types.int64, types.int64, types.float64, types.int64)
    return signature, _caller(_POINTER, INTEGER, SCALAR, _POINTER)


@intrinsic
def call_polynomials(typing_context: Any, where: Any, memory: Any, order: Any, times: Any, target: Any) -> Any:
    """Write the states of a row of runs at a row of times from where their series stand to an address."""
    return types.void(*[types.int64] * 5), _caller(_POINTER, INTEGER, _POINTER, _POINTER)
