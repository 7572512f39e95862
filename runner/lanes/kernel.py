"""A model's right-hand side in its forms for LANES runs at once, made of the text of `rhs` itself."""

import math
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError

from qddot.runner import abi
from qddot.runner.load import LoadError, Model
from qddot.runner.machine.bits import elementary
from qddot.runner.machine.elementary import FORMS
from qddot.runner.machine.lane_loop import lane_loop
from qddot.runner.machine.row import advance, row
from qddot.runner.machine.straight import straight
from qddot.runner.method import Method

#: States up to which the right-hand side advances them: of more, it would take twice as long to compile.
MOST_ADVANCED = 128


def form_of(model: Model, method: Method) -> str:
    """Which form of the right-hand side a method calls in lanes: "advance" or "rhs", see `abi`."""
    return "advance" if method.family == "fixed" and len(model.state_names) <= MOST_ADVANCED else "rhs"


def lane_rhs(model: Model, form: str = "rhs") -> Any | None:
    """A form of a model's right-hand side compiled for lanes; None where it calls a function without vectors.

    Raises LoadError where it does not compile.
    """
    try:
        return _compiled_kernel(model.module.rhs.py_func, form)
    except NumbaError as error:
        raise LoadError(f"model {model.name}: kernel 'rhs' does not compile for lanes:\n{error}") from None


@cache
def _compiled_kernel(rhs: FunctionType, form: str) -> Any | None:
    """The text of `rhs` once more: items of its arguments stand LANES apart, and `math` is that of lanes.

    The functions of tables that it calls become part of it.
    """
    if not set(rhs.__code__.co_names) & set(vars(math)) <= FORMS.keys():
        return None
    in_lanes = ModuleType("math", "What stands for `math` in lanes.")
    vars(in_lanes).update(FORMS)
    called = {name: rhs.__globals__.get(name) for name in rhs.__code__.co_names}
    tables = {name: elementary(each.py_func) for name, each in called.items() if isinstance(each, Dispatcher)}
    space = {**rhs.__globals__, **tables, "math": in_lanes}
    names = {**globals(), "one": elementary(straight(rhs, space, whole=True))}
    loop = _advance_over_lanes if form == "advance" else _over_lanes
    return lane_loop(abi.LANE_KERNELS[form], rhs)(FunctionType(loop.__code__, names, f"lane_{form}"))


def _over_lanes(times, state, inputs, constants, derivative):
    """State derivatives [qdot, qddot] of LANES runs; `one` is the right-hand side of one."""
    for lane in range(abi.LANES):
        one(times[lane], row(state, lane), row(inputs, lane), row(constants, lane), row(derivative, lane))  # noqa: F821


def _advance_over_lanes(times, state, inputs, constants, derivative, base, target, h, weight):
    """The same, and target = base + weight * h * derivative: slopes go from registers into the next stage."""
    for lane in range(abi.LANES):
        slopes = advance(row(derivative, lane), row(base, lane), row(target, lane), weight * h[lane])
        one(times[lane], row(state, lane), row(inputs, lane), row(constants, lane), slopes)  # noqa: F821
