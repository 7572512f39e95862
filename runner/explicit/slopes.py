"""Slopes: the right-hand side at a row of the workspace, with the inputs of the time."""

from qddot.runner.explicit.workspace import ZERO, row_address, states
from qddot.runner.inputs.instants import after, side_of
from qddot.runner.inputs.reader import CONSTANT, TO, read
from qddot.runner.inputs.signal import InputTable
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, VIEW, floats, integers, matrix
from qddot.runner.machine.pointers import call_kernel
from qddot.runner.machine.stage import call_stage


@compiled(**VIEW)
def input_values(space):
    """The input vector u, (channels,)."""
    return floats(space.u, space.channels)


@compiled(**VIEW)
def constants(space):
    """The constants c, (n_constants,)."""
    return floats(space.constants, space.n_constants)


@compiled(**VIEW)
def input_table(space):
    """The inputs as `evaluate` takes them; the breakpoints are the plan's matter."""
    count = space.channels
    return InputTable(
        matrix(space.pieces, space.n_pieces, 8),
        integers(space.first, count),
        integers(space.last, count),
        floats(space.rate, count),
        floats(space.offset, count),
        integers(space.order, count),
        floats(space.rate, 0),
    )


@compiled(**LEAN)
def look_up(space, t, h, c):
    """Look the inputs up at t + c*h of the step from t to t + h."""
    if space.steady == 0:
        look_up_moving(space, t, h, c)


@compiled(**LEAN)
def look_up_moving(space, t, h, c):
    """`look_up` of inputs that are not constant."""
    if space.n_inputs > 0:
        reader = floats(space.reader, space.reader_size)
        read(input_table(space), reader, t + c * h, side_of(t, h, c), space.n_inputs, input_values(space))


@compiled(**LEAN)
def settle(space, t, h):
    """Find out whether the inputs are constant from t to t + h, where no breakpoint lies between, and look them up."""
    reader = floats(space.reader, space.reader_size)
    if space.n_inputs > 0:
        read(input_table(space), reader, t, after(t, h), space.n_inputs, input_values(space))
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
