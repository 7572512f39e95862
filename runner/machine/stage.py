"""The state of a Runge-Kutta stage as a kernel reads it: y + factor * k, summed where each item is read.

A kernel writes its slopes one by one, and a wide load across fresh stores waits until all of them have reached the
cache. Read one by one, by the kernel of the next stage itself, they are there at once, and the sum needs no place in
memory.
"""

import operator
from functools import cache
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from qddot.runner import abi
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, intrinsic
from qddot.runner.machine.pointers import caller, pointer


class Stage(types.Type):
    """Type of the state of a stage: two pointers and a number, read like an array."""

    def __init__(self) -> None:
        super().__init__("Stage")


STAGE = Stage()
#: rhs of the calling convention (see `abi`), its state that of a stage and its other arguments pointers.
STAGE_KERNEL = types.void(abi.SCALAR, STAGE, abi.POINTER, abi.POINTER, abi.POINTER)


@register_model(Stage)
class _Model(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("y", abi.POINTER), ("k", abi.POINTER), ("factor", types.float64)])


@infer_global(operator.getitem)
class _Item(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        """The type of stage[i]."""
        stage, _ = arguments
        return signature(types.float64, stage, types.intp) if isinstance(stage, Stage) else None


@lower_builtin(operator.getitem, Stage, types.intp)
def _item(context: Any, builder: Any, signed: Any, arguments: Any) -> Any:
    stage = cgutils.create_struct_proxy(signed.args[0])(context, builder, value=arguments[0])
    y, k = (builder.load(builder.gep(row, [arguments[1]])) for row in (stage.y, stage.k))
    product = builder.fmul(stage.factor, k, flags=("contract",))
    return builder.fadd(y, product, flags=("contract",))


@cache
def stage_pointer(rhs: Any) -> int:
    """The address of a jitted rhs that uses its arguments item by item, compiled for `STAGE_KERNEL`."""
    return pointer(compiled(STAGE_KERNEL, **LEAN)(rhs.py_func), STAGE_KERNEL, "rhs")


@intrinsic
def call_stage(typing_context: Any, where: Any, t: Any, y: Any, k: Any, factor: Any, u: Any, c: Any, dx: Any) -> Any:
    """Call the kernel at an address for the state y + factor * k; all but t and factor are addresses."""
    _, emit = caller(STAGE_KERNEL)

    def call(context: Any, builder: Any, signed: Any, arguments: Any) -> Any:
        def pointer(address: Any) -> Any:
            return builder.inttoptr(address, ir.DoubleType().as_pointer())

        target, t, y, k, factor, *others = arguments
        stage = cgutils.create_struct_proxy(STAGE)(context, builder)
        stage.y, stage.k, stage.factor = pointer(y), pointer(k), factor
        return emit(context, builder, signed, [target, t, stage._getvalue(), *map(pointer, others)])

    address, number = types.int64, types.float64
    return types.void(address, number, address, address, number, address, address, address), call
