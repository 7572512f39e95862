"""What the work space of every stepping method has: a right-hand side, rows of states, constants and inputs.

A method's own record has these fields and more; what is here, and the frame, reads them by name.
"""

from typing import Any

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

from qddot.runner.frame.projection import call_projection, projection_for
from qddot.runner.inputs.instants import side_of
from qddot.runner.inputs.piece import InputTable
from qddot.runner.inputs.reader import FROM, TO, read_window, reader_for, refresh
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import (
    BY_ADDRESS,
    LEAN,
    VIEW,
    address,
    floats,
    integers,
    layout,
    matrix,
    place_of,
    record,
    record_at,
    writable,
)
from qddot.runner.machine.pointers import calling, pointer
from qddot.runner.problem import Problem

#: Addresses (see `memory`, `pointers`) and lengths. rhs; work: rows of n states, `stride` bytes apart; constants
#: (n_constants,); u (channels,); reader (reader_size,); pieces to order as in `InputTable`; steady: not 0 while all
#: inputs are known to be constant, and stand in u. project, held: what keeps the state on constraints, and the record
#: of these, see `projection`; 0 where it is kept on none. n_modes: of the last channels, which are modes of conditions
#: (see `hold`), those that stand in modes (n_modes,); 0 where conditions are free. by_item: not 0 where rhs takes the
#: state of a stage (see `stage`); jacobian_kernel: 0 where there is none. The rest are functions,
#: 0 where a run needs none: refresh: of the inputs' reader; those of the method's dense output and of the frame: see
#: `functions`.
_COMMON = (
    "rhs work n stride constants n_constants n_inputs channels u reader reader_size steady "
    "pieces n_pieces first last rate offset order project held n_modes modes by_item jacobian_kernel "
    "refresh prepare within sketch at_start walk finish take_sides keep_sides release"
)
#: The part that all spaces have. Its first field has a title: numba would take a space for a subtype of it, and warn.
COMMON = np.dtype([(("of all methods", "rhs"), np.int64), *layout(_COMMON.removeprefix("rhs ")).descr])
SPACE = from_dtype(COMMON)
common_at = record_at(COMMON)
REFRESH, PREPARE = types.void(types.int64, types.float64), types.void(types.int64)
WITHIN = types.int64(types.int64, types.float64)
_call_refresh, _call_prepare, _call_within = map(calling, (REFRESH, PREPARE, WITHIN))


def space_layout(own: str) -> np.dtype:
    """The type of a method's space: what all have, and fields of its own."""
    return layout(f"{_COMMON} {own}")


def make_space(
    fields: np.dtype, problem: Problem, own: dict[str, NDArray[Any]], **numbers: int
) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """A space for a problem and the arrays it points into, `own` among them: by the names of the fields they fill."""
    inputs = problem.inputs
    arrays = {name: writable(getattr(inputs, name)) for name in inputs._fields if name != "breakpoints"}
    arrays |= {
        "constants": np.array(problem.constants, dtype=np.float64),
        "u": np.zeros(2 + len(inputs.first))[1:],  # before it stands what `slide` finds its way by
        "reader": reader_for(inputs),
        "modes": np.zeros(problem.n_modes),
        **own,
    }
    n = len(problem.initial_state)
    kept_alive: dict[str, NDArray[Any]] = {}
    if problem.n_inputs > 0:
        numbers["refresh"] = pointer(_refresh, REFRESH, "refresh")
    if problem.held is not None:
        addresses, kept_alive = projection_for(problem.held, n, arrays["constants"], arrays["u"])
        numbers |= addresses
    numbers |= {
        "n": n,
        "n_constants": len(problem.constants),
        "n_inputs": int(problem.n_inputs),
        "channels": len(inputs.first),
        "n_pieces": len(inputs.pieces),
        "n_modes": problem.n_modes,
        "reader_size": len(arrays["reader"]),
    }
    made = record(fields, **numbers, **{name: address(array) for name, array in arrays.items()})
    return made, arrays | {f"held {name}": array for name, array in kept_alive.items()}


@compiled(**LEAN)
def row_address(space, row):
    """The address of a row."""
    return space.work + space.stride * row


@compiled(**VIEW)
def states(space, row):
    """The states of a row, (n,)."""
    return floats(row_address(space, row), space.n)


@compiled(**VIEW)
def input_values(space):
    """The input vector u, (channels,)."""
    return floats(space.u, space.channels)


@compiled(**VIEW)
def modes(space):
    """The modes of conditions that are held, (n_modes,)."""
    return floats(space.modes, space.n_modes)


@compiled(**LEAN)
def write_modes(space):
    """Let kernels see the modes."""
    u, found = input_values(space), modes(space)
    for k in range(space.n_modes):
        u[space.channels - space.n_modes + k] = found[k]


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


@compiled(**BY_ADDRESS)
def _refresh(where, t):
    """Have the reader of the space at an address take over the pieces at time t."""
    space = common_at(where)
    refresh(input_table(space), floats(space.reader, space.reader_size), t, space.n_inputs)


@compiled(**LEAN)
def set_inputs(space, t, side):
    """Look the inputs up at t, as limits from the side on which the time `side` lies."""
    _set_inputs(common(space), t, side)


@compiled(**LEAN)
def _set_inputs(space, t, side):
    if space.n_inputs > 0:
        reader = floats(space.reader, space.reader_size)
        if not reader[FROM] <= side < reader[TO]:
            _call_refresh(space.refresh, (place_of(space), side))
        read_window(reader, t, space.n_inputs, input_values(space))
        if space.n_modes > 0 and space.n_inputs > space.channels - space.n_modes:
            write_modes(space)


@compiled(**LEAN)
def look_up(space, t, h, c):
    """Look the inputs up at t + c*h of the step from t to t + h."""
    if space.steady == 0:
        set_inputs(space, t + c * h, side_of(t, h, c))


@compiled(**LEAN)
def project(space, t, x):
    """Put the state at an address on the constraints at t, the inputs being set."""
    call_projection(space.project, (space.held, t, x))


@compiled(**LEAN)
def project_at_end(space, t, h, x):
    """Put the state at an address on the constraints at the end of the step from t to t + h."""
    if space.n_inputs > 0:
        look_up(space, t, h, 1.0)
    project(space, t + h, x)


@compiled(**LEAN)
def project_at_switch(space, t, h, x):
    """As `project_at_end`, where a condition turns: with all of them free, as whoever looks at the state sees it.

    The search for the switch leaves the state a hair before or beyond it, where the branch that was held may be another
    than the one that the constraints have there.
    """
    u = input_values(space)
    for k in range(space.n_modes):
        u[space.channels - space.n_modes + k] = 0.0
    project_at_end(space, t, h, x)
    write_modes(space)


@compiled(**LEAN)
def common(space):
    """The part of a space that all methods have."""
    return common_at(place_of(space))


@compiled(**LEAN)
def prepare(space):
    """Write what dense output needs beyond the step itself; it may be called twice."""
    _call_prepare(space.prepare, (place_of(space),))


@compiled(**LEAN)
def state_within(space, theta):
    """The address of the state at part theta of the step, 0 to 1, from its prepared dense output; at 0 without."""
    return _call_within(space.within, (place_of(space), theta))


@compiled(**LEAN)
def sketch_within(space, theta):
    """The address of about that state, without any preparation beyond the slope at the end of the step."""
    return _call_within(space.sketch, (place_of(space), theta))
