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
from runner.explicit.stage import STAGE_KERNEL, stage_kernel
from runner.explicit.sums import add_latest, sum_slopes
from runner.inputs.reader import reader_for
from runner.memory import BLOCK, INLINE, LEAN, VIEW, address, floats, layout, record, writable
from runner.pointers import pointer
from runner.problem import Problem

MOST_STAGES = 16
#: Offsets of the rows within a block: zeros, state, new state, argument of a stage, error estimates, their scaled
#: sizes, absolute tolerance, a state within the step; then the slopes k_0, k_1, ... As np.int64, because numba compiles
#: a function again for every literal int that it is called with.
ZERO, Y, NEW, STAGE, ERROR, ERROR_2, SCALED, ATOL, WITHIN, K0 = np.arange(0, 10 * BLOCK, BLOCK)
BLOCK_SIZE = K0 + MOST_STAGES * BLOCK
#: Fields of a space, what a step reads and writes: addresses (see `memory`, `pointers`) and lengths. rhs; work
#: (blocks*BLOCK_SIZE,); x, dx (n,) for models larger than a block; constants (n_constants,); u (channels,); reader
#: (reader_size,);
#: pieces to order as in `InputTable`; steady: not 0 while all inputs are constant.
SPACE = layout(
    "rhs direct work n blocks x dx constants n_constants n_inputs channels u reader reader_size steady "
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
    w = space.work
    sum_slopes(w + 8 * base, h, weights, count, w + 8 * K0, w + 8 * target)
    if space.blocks > 1:
        combine_others(space, h, base, weights, count, target)


@compiled(**LEAN)
def combine_others(space, h, base, weights, count, target):
    """`combine`, of the blocks after the first."""
    for b in range(1, space.blocks):
        w = space.work + 8 * BLOCK_SIZE * b
        sum_slopes(w + 8 * base, h, weights, count, w + 8 * K0, w + 8 * target)


@compiled(**INLINE)
def combine_with_latest(space, h, base, weights, count, target):
    """`combine` where the last of these slopes has just been evaluated."""
    if space.direct:
        w = space.work
        sum_slopes(w + 8 * base, h, weights, count - 1, w + 8 * K0, w + 8 * target)
        last = floats(weights, MOST_STAGES)[count - 1]
        add_latest(w + 8 * target, h * last, w + 8 * (K0 + BLOCK * (count - 1)), space.n)
    else:
        combine(space, h, base, weights, count, target)


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


def space_for(problem: Problem, atol: NDArray[np.float64]) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """A space with the initial state and the absolute tolerances (scalar or (n,)), and the arrays it points into."""
    n = len(problem.initial_state)
    blocks = max(1, -(-n // BLOCK))
    direct = problem.by_item and blocks == 1
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
        "rhs": _rhs(problem.rhs, direct),
        "direct": int(direct),
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


def _rhs(rhs: Any, direct: bool) -> int:
    return pointer(stage_kernel(rhs), STAGE_KERNEL, "rhs") if direct else pointer(rhs, abi.VECTOR_KERNEL, "rhs")


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
