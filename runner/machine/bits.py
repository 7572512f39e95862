"""Floats by their bits, in compiled code, and what becomes part of the loop that calls it."""

from collections.abc import Callable
from typing import Any

from numba import types

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, intrinsic


def elementary(function: Callable[..., Any]) -> Any:
    """A jitted function that becomes part of the loop that calls it."""
    return compiled(forceinline=True, **LEAN)(function)


@intrinsic
def bits_of(typing_context: Any, value: Any) -> Any:
    """The bits of a float64 as an int64."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(types.int64))

    return types.int64(types.float64), emit


@intrinsic
def float_of(typing_context: Any, bits: Any) -> Any:
    """The float64 of these bits."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], context.get_value_type(types.float64))

    return types.float64(types.int64), emit


@elementary
def nearest(x):
    """The nearest whole number as an int64 and as a float64, |x| < 2**51."""
    shifted = x + 6755399441055744.0
    return bits_of(shifted) - bits_of(6755399441055744.0), shifted - 6755399441055744.0


@elementary
def rounded(x):
    """The nearest whole number, |x| < 2**51."""
    return (x + 6755399441055744.0) - 6755399441055744.0


@elementary
def power_of_two(n):
    """2**n for whole n from -1022 to 1023, given as int64."""
    return float_of((n + 1023) << 52)
