"""Records of numbers and addresses, for compiled functions that run once per stage or step.

Numba counts references: passing a tuple of arrays to a function that is not inlined takes and drops a reference to each
of them, some 10 ns an array and call, and every function that takes a tuple of n numbers takes n arguments and 10 n ms
longer to compile. A record is one pointer; an array made from an address in it where it is used has no counter. The
caller keeps the arrays alive; nothing here checks bounds.
"""

import ctypes
from collections.abc import Callable
from functools import partial
from inspect import Parameter, Signature
from operator import itemgetter
from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.extending import intrinsic as numba_intrinsic
from numpy.typing import NDArray

from qddot.runner.machine.inner import OUTER

_FLOATS = types.Array(types.float64, 1, "C")
_INTEGERS = types.Array(types.int64, 1, "C")
_MATRIX = types.Array(types.float64, 2, "C")


#: Untyped: what a compiled caller hands over is not what the typing function below it takes.
intrinsic: Any = numba_intrinsic


def intrinsic_of(count: int, typed: Any) -> Any:
    """An intrinsic of so many arguments from a function of any number of types, which gives the type and the code."""

    def definition(typing_context: Any, *kinds: Any) -> Any:
        return typed(*kinds)

    names = ["typing_context", *(f"argument_{k}" for k in range(count))]
    # What numba asks for the number of arguments, which an intrinsic cannot leave open.
    definition.__signature__ = Signature([Parameter(name, Parameter.POSITIONAL_OR_KEYWORD) for name in names])  # type: ignore[attr-defined]
    return intrinsic(definition)


#: Options of numba for functions that allocate nothing and return no array: no reference counts.
LEAN: dict[str, Any] = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
#: The same for those that are called by their address: compiled on their own.
BY_ADDRESS = LEAN | {"pipeline_class": OUTER}
#: LEAN for those that return an array made from an address.
VIEW = LEAN | {"_nrt": True}
#: For functions that are called from one place, are a line or two, or take functions: compiled with their caller.
INLINE = LEAN | {"inline": "always"}


def layout(integers: str, floats: str = "") -> np.dtype:
    """The type of a record with these fields, int64 (counts and addresses) and float64."""
    return np.dtype(
        [*((name, np.int64) for name in integers.split()), *((name, np.float64) for name in floats.split())]
    )


def record(fields: np.dtype, /, **values: float) -> np.void:
    """A record with these values and zeros elsewhere."""
    names = fields.names or ()
    filled = dict.fromkeys(names, 0) | values
    if len(filled) > len(names):
        raise ValueError(f"no field {', '.join(sorted(values.keys() - set(names)))} among {', '.join(names)}")
    made: np.void = np.array([tuple(filled.values())], dtype=fields)[0]
    return made


def address(array: NDArray[Any]) -> int:
    """The address of a C-contiguous, writable array's first item."""
    if not array.flags.carray:
        raise ValueError(f"an array of shape {array.shape} is not contiguous and writable")
    if not array.size:
        place: int = array.__array_interface__["data"][0]
        return place
    buffer: Any = array  # numpy does not say to mypy that an array is one
    return ctypes.addressof(ctypes.c_char.from_buffer(buffer))  # a quarter of the time that array.ctypes.data takes


def place(of: np.void) -> int:
    """The address of a record."""
    base: Any = of.base
    return address(base)


def reading(of: np.void, *names: str) -> Callable[[], tuple[int, ...]]:
    """What reads two or more int64 fields of a record, all at once: each by its name takes a microsecond."""
    base: Any = of.base
    numbers: NDArray[np.int64] = base.view(np.int64)
    chosen = itemgetter(*(of.dtype.fields[name][1] // 8 for name in names))  # type: ignore[index]  # it has fields
    return lambda: chosen(numbers.tolist())


def number_in(of: np.void, name: str) -> Callable[[], Any]:
    """What reads one field of a record as a number of Python's, in a tenth of the time that its name takes."""
    base: Any = of.base
    kind, where = of.dtype.fields[name][:2]  # type: ignore[index]  # it has fields
    return partial(base.view(kind).item, where // 8)


def on_cache_line(size: int) -> NDArray[np.float64]:
    """An array of zeros that begins on a cache line."""
    buffer = np.zeros(size + 7)
    return buffer[-(buffer.ctypes.data // 8) % 8 :][:size]


def writable(array: NDArray[Any]) -> NDArray[Any]:
    """The array itself, or a copy where it is read-only or not contiguous."""
    return np.require(array, requirements=["C", "W"])


def uncounted(array_type: types.Array, context: Any, builder: Any, where: Any, shape: list[Any]) -> Any:
    """Emit an array of float64 or int64 of one or two dimensions at an address."""
    model, item = context.data_model_manager[array_type], cgutils.intp_t(8)
    parts = {
        "nitems": builder.mul(*shape) if len(shape) == 2 else shape[0],
        "itemsize": item,
        "data": builder.inttoptr(where, context.get_value_type(types.CPointer(array_type.dtype))),
        "shape": cgutils.pack_array(builder, shape),
        "strides": cgutils.pack_array(builder, [builder.mul(shape[1], item), item] if len(shape) == 2 else [item]),
    }
    array = ir.Constant(model.get_value_type(), None)
    for name, value in parts.items():
        array = model.set(builder, array, value, name)
    return array


@intrinsic
def place_of(typing_context: Any, of: Any) -> Any:
    """The address of a record, in compiled code."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(arguments[0], ir.IntType(64))

    return types.int64(of), emit


def record_at(fields: np.dtype) -> Any:
    """What gives the record of these fields that stands at an address, in compiled code."""
    kind = from_dtype(fields)

    @intrinsic
    def at(typing_context: Any, where: Any) -> Any:
        def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(kind))

        return kind(types.int64), emit

    return at


@intrinsic
def first_item(typing_context: Any, array: Any) -> Any:
    """The address of an array's first item, in compiled code."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.data_model_manager[signature.args[0]].get(builder, arguments[0], "data")
        return builder.ptrtoint(data, ir.IntType(64))

    return types.int64(array), emit


@intrinsic
def floats(typing_context: Any, where: Any, length: Any) -> Any:
    """The float64 array (length,) at an address."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return uncounted(_FLOATS, context, builder, arguments[0], [arguments[1]])

    return _FLOATS(types.int64, types.int64), emit


@intrinsic
def integers(typing_context: Any, where: Any, length: Any) -> Any:
    """The int64 array (length,) at an address."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return uncounted(_INTEGERS, context, builder, arguments[0], [arguments[1]])

    return _INTEGERS(types.int64, types.int64), emit


@intrinsic
def matrix(typing_context: Any, where: Any, rows: Any, columns: Any) -> Any:
    """The float64 array (rows, columns) at an address."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return uncounted(_MATRIX, context, builder, arguments[0], list(arguments[1:]))

    return _MATRIX(types.int64, types.int64, types.int64), emit


#: Floats that the sums in `sums` take at once.
BLOCK = 16
