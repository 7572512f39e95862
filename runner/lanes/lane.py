"""A lane's own numbers by name: `its.h` is its number in the row of step lengths.

Rows hold one number a lane. To the compiler, an attribute is the place that `rows[LANES * row + lane]` is.
"""

from collections.abc import Mapping
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import models, register_model

from qddot.runner import abi
from qddot.runner.lanes.pack import CHANNEL_ROWS, CONTROL_NAMES, INPUT_ROWS
from qddot.runner.lanes.values import ROW
from qddot.runner.machine.calls import doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, intrinsic


class Lane(types.Type):
    """Type of a lane of named rows: where they begin, and its number."""

    def __init__(self, name: str, rows: Mapping[str, int]) -> None:
        super().__init__(name)
        self.rows = rows


#: A lane of the rows `control` of a pack, and one of the rows of an input channel.
CONTROL = Lane("ControlLane", {name: row for row, name in enumerate(CONTROL_NAMES)})
CHANNEL = Lane("ChannelLane", CHANNEL_ROWS)


@register_model(Lane)
class _Model(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("rows", abi.POINTER), ("lane", types.int64)])


#: Untyped: numba's own type of it leaves no room for a `generic_resolve`.
_AttributeTemplate: Any = AttributeTemplate


@infer_getattr
class _Attributes(_AttributeTemplate):
    key = Lane

    def generic_resolve(self, lane: Any, name: str) -> Any:
        """The type of lane.name."""
        return types.float64 if name in lane.rows else None


def _place(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    lane = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    return builder.gep(lane.rows, [builder.add(lane.lane, ir.IntType(64)(abi.LANES * kind.rows[name]))])


@lower_getattr_generic(Lane)
def _get(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    return builder.load(_place(context, builder, kind, value, name))


@lower_setattr_generic(Lane)
def _set(context: Any, builder: Any, signed: Any, arguments: Any, name: str) -> None:
    number = context.cast(builder, arguments[1], signed.args[1], types.float64)
    builder.store(number, _place(context, builder, signed.args[0], arguments[0], name))


def _of(kind: Lane) -> Any:
    def emit(context: Any, builder: Any, signed: Any, arguments: Any) -> Any:
        made = cgutils.create_struct_proxy(kind)(context, builder)
        made.rows, made.lane = arguments
        return made._getvalue()

    return kind(abi.POINTER, types.int64), emit


@intrinsic
def lane_of(typing_context: Any, control: Any, lane: Any) -> Any:
    """The lane of this number in the rows `control` of a pack, see `pack`."""
    return _of(CONTROL)


@intrinsic
def channel_of(typing_context: Any, rows: Any, lane: Any) -> Any:
    """The lane of this number in the rows of an input channel, see `pack`."""
    return _of(CHANNEL)


@compiled(**LEAN)
def control_of(pack, lane):
    """`lane_of` the pack."""
    return lane_of(doubles(pack.control), lane)


@compiled(**LEAN)
def input_of(pack, i, lane):
    """`channel_of` channel i of the pack."""
    return channel_of(doubles(pack.inputs + ROW * INPUT_ROWS * i), lane)
