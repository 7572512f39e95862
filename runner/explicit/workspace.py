"""Where an explicit Runge-Kutta method works: one flat buffer of rows, each as long as the states, on cache lines.

A row is padded with zeros to a multiple of sixteen states, so that sums over slopes stay in registers. Kernels read and
write the rows where they are.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.frame.space import make_space, row_address, space_layout
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, INLINE, LEAN, VIEW, floats, on_cache_line, record_at
from qddot.runner.machine.pointers import pointer
from qddot.runner.machine.stage import stage_pointer
from qddot.runner.machine.sums import add_latest, sum_slopes
from qddot.runner.problem import Problem

MOST_STAGES = 16
#: The rows: zeros, state, new state, argument of a stage, error estimates, their scaled sizes, absolute and relative
#: tolerance, a state within the step; then the slopes k_0, k_1, ... As np.int64, because numba compiles a function
#: again for every literal int that it is called with.
ZERO, Y, NEW, STAGE, ERROR, ERROR_2, SCALED, ATOL, RTOL, WITHIN, K0 = np.arange(11)
ROWS = K0 + MOST_STAGES
NO_SLOPES = np.int64(0)
#: Bytes of a block of states.
BLOCK_BYTES = 8 * BLOCK


#: Fields beside those of every space. A row is in so many blocks; weights (MOST_STAGES,): room; pair, course: the
#: records of the method's coefficients and of what the run has reached.
SPACE = space_layout("blocks weights pair course")
space_at = record_at(SPACE)


@compiled(**VIEW)
def block(space, row, b):
    """The b-th block of a row, (BLOCK,)."""
    return floats(row_address(space, row) + BLOCK_BYTES * b, BLOCK)


@compiled(**LEAN)
def sum_rows(space, base, h, weights, count, target):
    """Target = base + h * sum of weights[j] * slope j, j < count; all but h and count addresses."""
    slopes = row_address(space, K0)
    for offset in range(0, space.stride, BLOCK_BYTES):
        sum_slopes(base + offset, h, weights, count, slopes + offset, space.stride, target + offset)


@compiled(**LEAN)
def combine(space, h, base, weights, count, target):
    """Row `target` = row `base` + h * sum of weights[j] * slope j, j < count; weights an address."""
    sum_rows(space, row_address(space, base), h, weights, count, row_address(space, target))


@compiled(**INLINE)
def combine_with_latest(space, h, base, weights, count, target):
    """`combine` where the last of these slopes has just been evaluated."""
    if space.by_item and space.blocks == 1:
        combine(space, h, base, weights, count - 1, target)
        last = floats(weights, MOST_STAGES)[count - 1]
        add_latest(row_address(space, target), h * last, row_address(space, K0 + count - 1), space.n)
    else:
        combine(space, h, base, weights, count, target)


@compiled(**LEAN)
def copy(space, source, target):
    """Copy a row to another."""
    combine(space, 0.0, source, space.work, NO_SLOPES, target)


def space_for(
    problem: Problem, rtol: NDArray[np.float64], atol: NDArray[np.float64]
) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """A space with the initial state and the tolerances, each (1,) or (n,), and the arrays it points into."""
    blocks = max(1, -(-len(problem.initial_state) // BLOCK))
    own: dict[str, NDArray[Any]] = {
        "work": _initial_work(problem.initial_state, rtol, atol, blocks),
        "weights": np.zeros(MOST_STAGES),
    }
    return make_space(
        SPACE,
        problem,
        own,
        rhs=stage_pointer(problem.rhs) if problem.by_item else pointer(problem.rhs, abi.VECTOR_KERNEL, "rhs"),
        by_item=int(problem.by_item),
        blocks=blocks,
        stride=blocks * BLOCK_BYTES,
    )


def state_of(space: np.void, arrays: dict[str, NDArray[Any]]) -> NDArray[np.float64]:
    """The present state (n,), a view of the workspace."""
    state: NDArray[np.float64] = arrays["work"].reshape(ROWS, -1)[Y, : space["n"]]
    return state


def _initial_work(
    x: NDArray[np.float64], rtol: NDArray[np.float64], atol: NDArray[np.float64], blocks: int
) -> NDArray[np.float64]:
    """The buffer, on a cache line. An absolute tolerance of zero becomes a tiny one, so that 0/0 cannot arise."""
    work = on_cache_line(int(ROWS) * blocks * BLOCK)
    rows = work.reshape(ROWS, blocks * BLOCK)
    rows[Y, : len(x)] = x
    rows[ATOL] = rows[RTOL] = 1.0
    rows[ATOL, : len(x)] = np.maximum(atol, 1e-300)
    rows[RTOL, : len(x)] = rtol
    return work
