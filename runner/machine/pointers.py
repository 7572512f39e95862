"""Calls of jitted functions by address, or by name.

A driver that takes a kernel as an address compiles once for all models, like one that takes it as a declared
FunctionType; but handing over a FunctionType costs 0.2 ms a kernel and call of the driver, an address nothing.
"""

from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

from llvmlite import binding
from numba import types
from numba.core import cgutils
from numba.core.registry import cpu_target

from qddot.runner import abi
from qddot.runner.checks import shown
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, intrinsic, intrinsic_of

EVENT_SIGNATURE = types.float64(abi.SCALAR, abi.VECTOR, abi.VECTOR, abi.VECTOR)


def pointer(function: Any, signature: Any, name: str) -> int:
    """The address of a jitted function, compiled for this signature. Raises ValueError where it cannot be.

    The address is remembered, and the function kept alive with it.
    """
    if not hasattr(function, "get_compile_result"):
        raise ValueError(f"{name} is {shown(function)}, expected a function jitted by numba, {signature}")
    key = function, id(signature)
    if key not in _known:
        _known[key] = _address(function, signature, name), signature
    return _known[key][0]


#: Function and id of the signature, whose hash takes longer than a whole look-up -> address, and the signature itself,
#: which keeps the id its own.
_known: dict[tuple[Any, int], tuple[int, Any]] = {}


def _address(function: Any, signature: Any, name: str) -> int:
    compiled = function.get_compile_result(signature)
    if compiled.signature.return_type != signature.return_type:
        raise ValueError(f"{name} returns {compiled.signature.return_type}, expected {signature.return_type}")
    place: int = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    if place == 0:
        raise ValueError(f"{name} is compiled within what calls it, expected one with an address: `BY_ADDRESS`")
    return place


def caller(signature: Any) -> Any:
    """Type and code, as `intrinsic` wants them, of a call of a function of this signature at an address."""

    def emit(context: Any, builder: Any, own: Any, arguments: Any) -> Any:
        kind = context.call_conv.get_function_type(signature.return_type, signature.args)
        where = builder.inttoptr(arguments[0], kind.as_pointer())
        return _checked_call(context, builder, where, signature, arguments[1:])

    return signature.return_type(types.int64, *signature.args), emit


def _checked_call(context: Any, builder: Any, where: Any, signature: Any, arguments: Any) -> Any:
    """A call of a function of this signature that fails where that does."""
    status, result = context.call_conv.call_function(builder, where, signature.return_type, signature.args, arguments)
    with builder.if_then(status.is_error, likely=False):
        context.call_conv.return_status_propagate(builder, status)
    return result


def calling(signature: Any) -> Any:
    """What calls a function of this signature at an address, in compiled code: call(where, (its arguments))."""
    _, code = caller(signature)

    @intrinsic
    def call(typing_context: Any, where: Any, arguments: Any) -> Any:
        def emit(context: Any, builder: Any, own: Any, given: Any) -> Any:
            return code(context, builder, own, [given[0], *cgutils.unpack_tuple(builder, given[1])])

        return signature.return_type(types.int64, types.BaseTuple.from_types(signature.args)), emit

    return call


def by_name(signature: Any) -> Any:
    """A function of the runner compiled on its own, which generated kernels call by its name.

    They would be compiled with all of it, each of them, otherwise. Whoever imports the function makes its name known,
    and so can load what was compiled with it before. Raises ValueError as `pointer` does.
    """

    def decorate(function: FunctionType) -> Any:
        name = f"{function.__module__}.{function.__qualname__}"
        make_known(name, function, signature)

        def emit(context: Any, builder: Any, own: Any, arguments: Any) -> Any:
            return _checked_call(context, builder, _named(context, builder, name, signature), signature, arguments)

        return intrinsic_of(len(signature.args), lambda *kinds: (signature, emit))

    return decorate


def make_known(name: str, function: Callable[..., Any], signature: Any) -> None:
    """Let code that is compiled or loaded from here on call a function of the runner by this name."""
    binding.add_symbol(name, pointer(compiled(signature, **BY_ADDRESS)(function), signature, name))


def call_named(builder: Any, name: str, signature: Any, arguments: Sequence[Any]) -> None:
    """A call, in code that numba does not write, of a function that has been made known, which returns nothing."""
    context = cpu_target.target_context
    where = _named(context, builder, name, signature)
    context.call_conv.call_function(builder, where, signature.return_type, signature.args, arguments)


def _named(context: Any, builder: Any, name: str, signature: Any) -> Any:
    kind = context.call_conv.get_function_type(signature.return_type, signature.args)
    return cgutils.get_or_insert_function(builder.module, kind, name)


@intrinsic
def call_kernel(typing_context: Any, where: Any, t: Any, x: Any, u: Any, c: Any, result: Any) -> Any:
    """Call kernel(t, x, u, c, result) of the calling convention (see `abi`) at an address."""
    return caller(abi.VECTOR_KERNEL)


@intrinsic
def call_matrix_kernel(typing_context: Any, where: Any, t: Any, x: Any, u: Any, c: Any, result: Any) -> Any:
    """Call jacobian(t, x, u, c, J) of `solve`, which fills a matrix, at an address."""
    return caller(abi.MATRIX_KERNEL)


@intrinsic
def call_event(typing_context: Any, where: Any, t: Any, x: Any, u: Any, c: Any) -> Any:
    """The value of function(t, x, u, c) -> float at an address."""
    return caller(EVENT_SIGNATURE)
