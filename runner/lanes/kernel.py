"""A model's right-hand side in its second form, for LANES runs at once, made of the text of `rhs` itself."""

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
from qddot.runner.machine.row import row
from qddot.runner.machine.straight import straight


def lane_rhs(model: Model) -> Any | None:
    """The right-hand side of a model compiled for lanes (see `abi`); None where it calls a function without vectors.

    Raises LoadError where it does not compile.
    """
    try:
        return _compiled_kernel(model.module.rhs.py_func)
    except NumbaError as error:
        raise LoadError(f"model {model.name}: kernel 'rhs' does not compile for lanes:\n{error}") from None


@cache
def _compiled_kernel(rhs: FunctionType) -> Any | None:
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
    return _loop(rhs, straight(rhs, space, whole=True))


def _loop(rhs: FunctionType, one: FunctionType) -> Any:
    """The loop over lanes of a function for one of them; rhs: what it is made of."""
    names = {**globals(), "one": elementary(one)}
    return lane_loop(abi.LANE_KERNEL, rhs)(FunctionType(_over_lanes.__code__, names, f"lane_{rhs.__name__}"))


def _over_lanes(times, state, inputs, constants, derivative):
    """State derivatives [qdot, qddot] of LANES runs; `one` is the right-hand side of one."""
    for lane in range(abi.LANES):
        one(times[lane], row(state, lane), row(inputs, lane), row(constants, lane), row(derivative, lane))  # noqa: F821
