"""A row of lanes as one run's kernel reads and writes it: item i of lane l stands at base[i * LANES + l]."""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from qddot.runner import abi
from qddot.runner.machine.memory import intrinsic


class Row(types.Type):
    """Type of one lane of a row: a pointer and the lane's number, read and written like an array."""

    def __init__(self) -> None:
        super().__init__("Row")


class Advance(types.Type):
    """Type of one lane of a row of slopes; who writes a slope there advances a state along it, too."""

    def __init__(self) -> None:
        super().__init__("Advance")


ROW, ADVANCE = Row(), Advance()


@register_model(Row)
class _Row(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("base", abi.POINTER), ("lane", types.int64)])


@register_model(Advance)
class _Advance(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        members = [("slopes", ROW), ("states", ROW), ("advanced", ROW), ("step", types.float64)]
        super().__init__(manager, kind, members)


@infer_global(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        """The type of row[i]."""
        known = isinstance(arguments[0], Row | Advance)
        return signature(types.float64, arguments[0], types.intp) if known else None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        """The type of row[i] = value."""
        known = isinstance(arguments[0], Row | Advance)
        return signature(types.none, arguments[0], types.intp, types.float64) if known else None


def _place(context: Any, builder: Any, value: Any, index: Any) -> Any:
    lane_row = cgutils.create_struct_proxy(ROW)(context, builder, value=value)
    return builder.gep(lane_row.base, [builder.add(builder.mul(index, ir.IntType(64)(abi.LANES)), lane_row.lane)])


@lower_builtin(operator.getitem, Row, types.intp)
def _get(context: Any, builder: Any, signed: Any, arguments: Any) -> Any:
    return builder.load(_place(context, builder, *arguments))


@lower_builtin(operator.setitem, Row, types.intp, types.Float)
def _set(context: Any, builder: Any, signed: Any, arguments: Any) -> Any:
    builder.store(arguments[2], _place(context, builder, *arguments[:2]))
    return context.get_dummy_value()


@lower_builtin(operator.getitem, Advance, types.intp)
def _get_slope(context: Any, builder: Any, signed: Any, arguments: Any) -> Any:
    rows = cgutils.create_struct_proxy(ADVANCE)(context, builder, value=arguments[0])
    return builder.load(_place(context, builder, rows.slopes, arguments[1]))


@lower_builtin(operator.setitem, Advance, types.intp, types.Float)
def _set_slope(context: Any, builder: Any, signed: Any, arguments: Any) -> Any:
    given, index, slope = arguments
    rows = cgutils.create_struct_proxy(ADVANCE)(context, builder, value=given)
    state = builder.load(_place(context, builder, rows.states, index))
    moved = builder.fadd(builder.fmul(rows.step, slope, flags=("contract",)), state, flags=("contract",))
    builder.store(slope, _place(context, builder, rows.slopes, index))
    builder.store(moved, _place(context, builder, rows.advanced, index))
    return context.get_dummy_value()


@intrinsic
def row(typing_context: Any, base: Any, lane: Any) -> Any:
    """The row that begins at a pointer, as a lane sees it."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = cgutils.create_struct_proxy(ROW)(context, builder)
        made.base, made.lane = arguments
        return made._getvalue()

    return ROW(abi.POINTER, types.int64), emit


@intrinsic
def advance(typing_context: Any, slopes: Any, states: Any, advanced: Any, step: Any) -> Any:
    """A row of slopes; with each that is written there, advanced[i] = states[i] + step * slopes[i]."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        made = cgutils.create_struct_proxy(ADVANCE)(context, builder)
        made.slopes, made.states, made.advanced, made.step = arguments
        return made._getvalue()

    return ADVANCE(ROW, ROW, ROW, types.float64), emit
