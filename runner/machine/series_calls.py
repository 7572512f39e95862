"""Calls of a series' functions by address, in compiled code; see `series_code`."""

from typing import Any

from llvmlite import ir
from numba import types

from qddot.runner.abi import LANES
from qddot.runner.machine.memory import intrinsic
from qddot.runner.machine.series_step import kinds_of_step
from qddot.runner.machine.vector_code import INTEGER, SCALAR

_POINTER, _NOTHING = SCALAR.as_pointer(), ir.VoidType()


def _caller(*kinds: Any, result: Any = _NOTHING) -> Any:
    """The code of a call of a C function at an address; pointers are given as addresses."""
    function = ir.FunctionType(result, kinds)

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        where, *others = arguments
        pairs = zip(others, kinds, strict=True)
        values = [builder.inttoptr(x, kind) if isinstance(kind, ir.PointerType) else x for x, kind in pairs]
        found = builder.call(builder.inttoptr(where, function.as_pointer()), values)
        return context.get_dummy_value() if result is _NOTHING else found

    return emit


@intrinsic
def call_series(typing_context: Any, where: Any, memory: Any, order: Any) -> Any:
    """Write the coefficients of all states up to an order, from what stands in the memory at an address."""
    return types.void(types.int64, types.int64, types.int64), _caller(_POINTER, INTEGER)


@intrinsic
def call_step(
    typing_context: Any, where: Any, memory: Any, order: Any, relative: Any, absolute: Any, rtol: Any, decay: Any
) -> Any:
    """The step that the last two coefficients allow, see `series_step.emit_step`; tolerances are at addresses."""
    signature = types.float64(*[types.int64] * 5, types.float64, types.float64)
    result, kinds = kinds_of_step(row=1)
    return signature, _caller(*kinds, result=result)


@intrinsic
def call_steps(
    typing_context: Any, where: Any, memory: Any, order: Any, relative: Any, absolute: Any, rtol: Any, decay: Any,
    target: Any,
) -> Any:  # fmt: skip
    """Write a row of steps, each as its run's last two coefficients allow."""
    signature = types.void(*[types.int64] * 5, types.float64, types.float64, types.int64)
    return signature, _caller(*kinds_of_step(LANES)[1])


@intrinsic
def call_polynomial(typing_context: Any, where: Any, memory: Any, order: Any, time: Any, target: Any) -> Any:
    """Write the states at a time from where the series stands to an address, with room for a whole row."""
    signature = types.void(types.int64, types.int64, types.int64, types.float64, types.int64)
    return signature, _caller(_POINTER, INTEGER, SCALAR, _POINTER)


@intrinsic
def call_polynomials(typing_context: Any, where: Any, memory: Any, order: Any, times: Any, target: Any) -> Any:
    """Write the states of a row of runs at a row of times from where their series stand to an address."""
    return types.void(*[types.int64] * 5), _caller(_POINTER, INTEGER, _POINTER, _POINTER)
