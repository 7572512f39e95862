"""The compiled loop of constant steps: one for all explicit tableaux and all models.

The grid is t0 + k*step, computed, not accumulated. A step that contains a breakpoint of the inputs or a requested
output time is split there; the last step lands on t1.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from runner import abi
from runner.compiled import compiled
from runner.inputs.reader import read
from runner.memory import LEAN
from runner.problem import Status

#: Times closer than this part of a step are the same time.
SNAP = 1e-9
#: A stage looks its inputs up this part of a step inside the step: the limit from within where an input jumps there.
SIDE = 1e-6
#: Of the one function that Python calls: nothing here allocates, so references to the arrays need no counting.
ENTRY = {"error_model": "numpy", "_nrt": False, "nogil": True}
RUNNING, FINISHED, NON_FINITE = int(Status.RUNNING), int(Status.FINISHED), int(Status.NON_FINITE)


class Plan(NamedTuple):
    """Where the steps end: grid points t0 + k*step for k = 1..grid_points - 1, then t1; and the stops between them.

    stops (m,) rising times within (t0, t1), save_at_stop (m,) whether the state is saved there; every: grid points
    between two saved ones, 0 for none.
    """

    t0: float
    t1: float
    step: float
    grid_points: int
    every: int
    stops: NDArray[np.float64]
    save_at_stop: NDArray[np.bool_]


class March(NamedTuple):
    """Everything the loop keeps between two slices, and its work space.

    counts: GRID, STOP, SAVED, STEPS, FAILED_STATE; time: NOW, FAILED_AT. x, x_stage, x_new, slope (n,),
    slopes (s * n,), u (channels,), reader (see `reader_for`); saved_t (points,), saved_x (points, n).
    """

    counts: NDArray[np.int64]
    time: NDArray[np.float64]
    x: NDArray[np.float64]
    x_stage: NDArray[np.float64]
    x_new: NDArray[np.float64]
    slope: NDArray[np.float64]
    slopes: NDArray[np.float64]
    u: NDArray[np.float64]
    reader: NDArray[np.float64]
    saved_t: NDArray[np.float64]
    saved_x: NDArray[np.float64]


GRID, STOP, SAVED, STEPS, FAILED_STATE = range(5)
NOW, FAILED_AT = range(2)


@compiled(**LEAN)
def combine(x, h, weights, row, count, slopes, result):
    """Write x + h * sum of weights[row + j] * slopes[j], j < count; vanishing weights cost nothing, not all vanish."""
    n = len(x)
    fresh = True
    for j in range(count):
        weight = h * weights[row + j]
        if weight == 0.0:
            continue
        if fresh:
            for i in range(n):
                result[i] = x[i] + weight * slopes[j * n + i]
        else:
            for i in range(n):
                result[i] += weight * slopes[j * n + i]
        fresh = False


@compiled(**LEAN)
def all_within(x, limit):
    """Whether every |x[i]| <= limit; NaN is not."""
    outside = 0
    for i in range(len(x)):
        outside += not abs(x[i]) <= limit
    return outside == 0


@compiled(**LEAN)
def first_to_leave(slopes, x):
    """Index of the state that diverged: the first with a non-finite slope, stage by stage, else the largest."""
    for i in range(len(slopes)):
        if not np.isfinite(slopes[i]):
            return i % len(x)
    largest = 0
    for i in range(len(x)):
        if not np.isfinite(x[i]):
            return i
        if abs(x[i]) > abs(x[largest]):
            largest = i
    return largest


@compiled(**LEAN)
def save(march, t):
    """Append time and state to the saved points."""
    place = march.counts[SAVED]
    march.saved_t[place] = t
    for i in range(len(march.x)):
        march.saved_x[place, i] = march.x[i]
    march.counts[SAVED] = place + 1


def advance(rhs, A, b, c, constants, inputs, n_inputs, plan, march, limit, most_steps):
    """March at most `most_steps` steps; returns a Status. Compiled once for all models by `compiled_advance`.

    A (s * s,), b, c (s,). The step is written out here: as a function of its own it would cost a tenth more.
    """
    counts, stops, reader, u = march.counts, plan.stops, march.reader, march.u
    x, x_stage, x_new, slope, slopes = march.x, march.x_stage, march.x_new, march.slope, march.slopes
    k, stop, t, near, stages, n = counts[GRID], counts[STOP], march.time[NOW], SNAP * plan.step, len(b), len(x)
    ends_at_target, known_at = c[stages - 1] == 1.0, np.nan
    status = RUNNING
    for _ in range(most_steps):
        grid = plan.t0 + (k + 1) * plan.step if k + 1 < plan.grid_points else plan.t1
        at_stop = stop < len(stops) and stops[stop] <= grid + near
        target = stops[stop] if at_stop else grid
        h = target - t
        for stage in range(stages):
            if (stage == 0 and t != known_at) or (stage > 0 and c[stage] != c[stage - 1]):
                side = t + min(max(c[stage], SIDE), 1.0 - SIDE) * h
                read(inputs, reader, t + c[stage] * h, side, n_inputs, u)
            if stage == 0:
                rhs(t, x, u, constants, slope)
            else:
                combine(x, h, A, stage * stages, stage, slopes, x_stage)
                rhs(t + c[stage] * h, x_stage, u, constants, slope)
            for i in range(n):
                slopes[stage * n + i] = slope[i]
        combine(x, h, b, 0, stages, slopes, x_new)
        counts[STEPS] += 1
        if not all_within(x_new, limit):
            march.time[FAILED_AT] = target
            counts[FAILED_STATE] = first_to_leave(slopes, x_new)
            status = NON_FINITE
            break
        for i in range(n):
            x[i] = x_new[i]
        t = target
        known_at = t if ends_at_target and not at_stop else np.nan
        at_grid = not at_stop or target >= grid - near
        k += at_grid
        finished = k == plan.grid_points
        if finished or (at_stop and plan.save_at_stop[stop]) or (at_grid and plan.every > 0 and k % plan.every == 0):
            save(march, t)
        stop += at_stop
        if finished:
            status = FINISHED
            break
    counts[GRID], counts[STOP], march.time[NOW] = k, stop, t
    return status


@cache
def compiled_advance(*arguments: Any) -> Any:
    """`advance` for arguments of these numba types, after the leading kernel."""
    return compiled(types.int64(abi.RHS, *arguments), **ENTRY)(advance)
