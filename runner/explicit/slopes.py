"""Slopes: the right-hand side at a row of the workspace, with the inputs of the time."""

from qddot.runner.explicit.workspace import ZERO
from qddot.runner.frame.space import constants, input_values, row_address, set_inputs, states
from qddot.runner.inputs.instants import after, side_of
from qddot.runner.inputs.reader import CONSTANT, TO
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, floats
from qddot.runner.machine.pointers import call_kernel
from qddot.runner.machine.stage import call_stage


@compiled(**LEAN)
def settle(space, t, h):
    """Find out whether the inputs are constant from t to t + h, where no breakpoint lies between, and look them up."""
    reader = floats(space.reader, space.reader_size)
    set_inputs(space, t, after(t, h))
    space.steady = space.n_inputs == 0 or (reader[CONSTANT] != 0.0 and reader[TO] > side_of(t, h, 1.0))


@compiled(**INLINE)
def slope(space, t, source, target):
    """The row `target` = rhs(t, row `source`), with the inputs as they stand in u."""
    if space.by_item:
        x, nothing, dx = row_address(space, source), row_address(space, ZERO), row_address(space, target)
        call_stage(space.rhs, t, x, nothing, 0.0, space.u, space.constants, dx)
    else:
        slope_by_arrays(space, t, source, target)


@compiled(**LEAN)
def slope_by_arrays(space, t, source, target):
    """`slope` by a kernel that wants arrays."""
    call_kernel(space.rhs, t, states(space, source), input_values(space), constants(space), states(space, target))
