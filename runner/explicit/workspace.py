"""Where an explicit Runge-Kutta method works: one flat buffer in blocks of sixteen states.

A block holds sixteen states of every row (state, stage, errors, slopes), so that sums over slopes stay in registers.
States beyond the model's are padding and stay zero. Up to sixteen states lie in one block, and kernels read and write
there directly; more are gathered and scattered around each kernel call.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from runner import abi
from runner.compiled import compiled
from runner.inputs.reader import CONSTANT, TO, read, reader_for
from runner.inputs.signal import InputTable
from runner.memory import BLOCK, LEAN, VIEW, address, floats, integers, layout, matrix, record, weighted_sum, writable
from runner.pointers import call_kernel, pointer
from runner.problem import Problem

MOST_STAGES = 16
#: Offsets of the rows within a block: zeros, state, new state, argument of a stage, error estimates, their scaled
#: sizes, absolute tolerance, a state within the step; then the slopes k_0, k_1, ... As np.int64, because numba compiles
#: a function again for every literal int that it is called with.
ZERO, Y, NEW, STAGE, ERROR, ERROR_2, SCALED, ATOL, WITHIN, K0 = np.arange(0, 10 * BLOCK, BLOCK)
BLOCK_SIZE = K0 + MOST_STAGES * BLOCK
#: Inputs of a stage are looked up at least this part of a step inside the step: the limit from within at a jump.
SIDE = 1e-6


#: Fields of a space, what a step reads and writes: addresses (see `memory`, `pointers`) and lengths. rhs; work
#: (blocks*BLOCK_SIZE,); x, dx (n,) for models larger than a block; constants (n_constants,); u (channels,); reader
#: (reader_size,);
#: pieces to order as in `InputTable`; steady: not 0 while all inputs are constant.
SPACE = layout(
    "rhs work n blocks x dx constants n_constants n_inputs channels u reader reader_size steady "
    "pieces n_pieces first last rate offset order"
)


@compiled(**VIEW)
def block(space, b):
    """All rows of the b-th block, (BLOCK_SIZE,)."""
    return floats(space.work + 8 * BLOCK_SIZE * b, BLOCK_SIZE)


@compiled(**LEAN)
def gather(space, row, x):
    """Write the states of a row into x (n,)."""
    for b in range(space.blocks):
        w = block(space, b)
        for m in range(min(BLOCK, space.n - b * BLOCK)):
            x[b * BLOCK + m] = w[row + m]


@compiled(**LEAN)
def scatter(space, x, row):
    """The states of a row = x (n,)."""
    for b in range(space.blocks):
        w = block(space, b)
        for m in range(min(BLOCK, space.n - b * BLOCK)):
            w[row + m] = x[b * BLOCK + m]


@compiled(**LEAN)
def combine(space, h, base, weights, count, target):
    """Row `target` = row `base` + h * sum of weights[j] * slope j, j < count; weights an address."""
    for b in range(space.blocks):
        w = space.work + 8 * BLOCK_SIZE * b
        weighted_sum(w + 8 * base, h, weights, count, w + 8 * K0, w + 8 * target)


@compiled(**LEAN)
def copy(space, source, target):
    """Copy a row to another."""
    combine(space, 0.0, source, space.work, 0, target)


@compiled(**VIEW)
def states(space, row):
    """The states of a row as one array (n,), valid until the next call."""
    if space.blocks == 1:
        return floats(space.work + 8 * row, space.n)
    x = floats(space.x, space.n)
    gather(space, row, x)
    return x


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
    if space.n_inputs > 0 and space.steady == 0:
        side = t + min(max(c, SIDE), 1.0 - SIDE) * h
        reader = floats(space.reader, space.reader_size)
        read(input_table(space), reader, t + c * h, side, space.n_inputs, input_values(space))


@compiled(**LEAN)
def settle(space, t, h):
    """Find out whether the inputs are constant from t to t + h, where no breakpoint lies between, and look them up."""
    space.steady = 0
    look_up(space, t, h, 0.0)
    reader = floats(space.reader, space.reader_size)
    space.steady = space.n_inputs == 0 or (reader[CONSTANT] != 0.0 and reader[TO] > t + (1.0 - SIDE) * h)


@compiled(**LEAN)
def slope(space, t, source, target):
    """The row `target` = rhs(t, row `source`), with the inputs as they stand in u."""
    u, c = input_values(space), constants(space)
    if space.blocks == 1:
        call_kernel(
            space.rhs, t, floats(space.work + 8 * source, space.n), u, c, floats(space.work + 8 * target, space.n)
        )
    else:
        x, dx = floats(space.x, space.n), floats(space.dx, space.n)
        gather(space, source, x)
        call_kernel(space.rhs, t, x, u, c, dx)
        scatter(space, dx, target)


def space_for(problem: Problem, atol: NDArray[np.float64]) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """A space with the initial state and the absolute tolerances (scalar or (n,)), and the arrays it points into."""
    n = len(problem.initial_state)
    blocks = max(1, -(-n // BLOCK))
    inputs = problem.inputs
    arrays: dict[str, NDArray[Any]] = {name: writable(getattr(inputs, name)) for name in inputs._fields}
    arrays |= {
        "work": _initial_work(problem.initial_state, atol, blocks),
        "x": np.zeros(n),
        "dx": np.zeros(n),
        "constants": np.array(problem.constants, dtype=np.float64),
        "u": np.zeros(max(1, len(inputs.first))),
        "reader": reader_for(inputs),
    }
    numbers = {
        "rhs": pointer(problem.rhs, abi.VECTOR_KERNEL, "rhs"),
        "n": n,
        "blocks": blocks,
        "n_constants": len(problem.constants),
        "n_inputs": int(problem.n_inputs),
        "channels": len(inputs.first),
        "n_pieces": len(inputs.pieces),
        "reader_size": len(arrays["reader"]),
    }
    places = {name: address(array) for name, array in arrays.items() if name != "breakpoints"}
    return record(SPACE, **numbers, **places), arrays


def _initial_work(x: NDArray[np.float64], atol: NDArray[np.float64], blocks: int) -> NDArray[np.float64]:
    """The buffer, on a cache line. An absolute tolerance of zero becomes a tiny one, so that 0/0 cannot arise."""
    size = blocks * BLOCK_SIZE
    buffer = np.zeros(size + 7)
    work = buffer[-(buffer.ctypes.data // 8) % 8 :][:size]
    rows = work.reshape(blocks, BLOCK_SIZE)
    for row, padding, values in ((Y, 0.0, x), (ATOL, 1.0, np.maximum(np.broadcast_to(atol, x.shape), 1e-300))):
        padded = np.full(blocks * BLOCK, padding)
        padded[: len(x)] = values
        rows[:, row : row + BLOCK] = padded.reshape(blocks, BLOCK)
    return work
