"""The compiled loop of constant steps: one for all explicit tableaux and all models.

The grid is t0 + k*step, computed, not accumulated. A step that contains a breakpoint of the inputs or a requested
output time is split there; the last step lands on t1.
"""

import numpy as np

from qddot.runner.explicit.slopes import settle, slope
from qddot.runner.explicit.step import evaluate_stages
from qddot.runner.explicit.workspace import BLOCK_BYTES, K0, NEW, Y, combine_with_latest, copy
from qddot.runner.frame.log import next_stop, save, take_wanted
from qddot.runner.frame.space import look_up, project_at_end, row_address, states
from qddot.runner.inputs.instants import ROUNDING, rounding
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, floats, layout
from qddot.runner.machine.sums import any_beyond, copy_items
from qddot.runner.problem import Status

#: A last step shorter than this part of a step is none.
SNAP = 1e-9
RUNNING, FINISHED, NON_FINITE = int(Status.RUNNING), int(Status.FINISHED), int(Status.NON_FINITE)

#: Fields of a march. The steps end at t0 + k*step for k = 1..grid_points - 1, then at t1; grid: those behind us; every:
#: grid points between two saved ones, 0 for none. restart: the next step begins where the inputs may have changed;
#: known: they are looked up at its start. now: time of the state; limit: the size at which a state counts as diverged;
#: failed_at, failed_state: where it did. end_slopes: slopes at the ends of steps, evaluated to find events; target: the
#: end of the step in hand, where events are sought.
MARCH = layout(
    "grid_points grid every steps failed_state restart known end_slopes", "t0 t1 step now limit failed_at target"
)


@compiled(**INLINE)
def steps_of(t0, t1, step):
    """Steps from t0 to t1."""
    return max(1.0, np.ceil((t1 - t0) / step - max(SNAP, ROUNDING * abs(t1) / step)))


def run_slice(space, tableau, march, log, most_steps):
    """March at most `most_steps` steps; returns a Status."""
    status = RUNNING
    for _ in range(most_steps):
        target = next_target(march, log)
        march_to(space, tableau, march, log, target)
        march.steps += 1
        if diverged(space, march.limit):
            march.failed_at, march.failed_state = target, first_to_leave(space, tableau.stages)
            return NON_FINITE
        accept(space)
        status = land(space, march, log, target)
        if status != RUNNING:
            return status
    return status


@compiled(**LEAN)
def next_grid_point(march):
    """The end of the step where nothing lies within."""
    return march.t0 + (march.grid + 1) * march.step if march.grid + 1 < march.grid_points else march.t1


@compiled(**LEAN)
def next_target(march, log):
    """Where the next step ends."""
    stop, grid = next_stop(log), next_grid_point(march)
    return stop if stop <= grid + rounding(grid) else grid


@compiled(**INLINE)
def march_to(space, tableau, march, log, target):
    """From Y at march.now: the slopes and NEW, the state at `target`."""
    t, h = march.now, target - march.now
    if march.restart:
        settle(space, t, min(next_stop(log), march.t1) - t)
    elif not march.known:
        look_up(space, t, h, 0.0)
    slope(space, t, Y, K0)
    evaluate_stages(space, tableau, t, h, np.int64(1), tableau.stages)
    combine_with_latest(space, h, Y, tableau.b, tableau.stages, NEW)
    if space.project != 0:
        project_at_end(space, t, h, row_address(space, NEW))
    march.known = floats(tableau.c, tableau.stages)[tableau.stages - 1] == 1.0


@compiled(**INLINE)
def land(space, march, log, target):
    """Make `target` the present time, and save the state if it is to be saved; returns a status."""
    at_stop = next_stop(log) <= target
    at_grid = not at_stop or target >= next_grid_point(march) - rounding(target)
    march.now, march.restart = target, at_stop
    march.grid += at_grid
    wanted = at_grid and march.every > 0 and march.grid % march.every == 0
    if at_stop:
        wanted |= take_wanted(log, target)
        log.stop += 1
    if wanted:
        save(log, target, row_address(space, Y))
    return FINISHED if march.grid == march.grid_points else RUNNING


@compiled(**INLINE)
def accept(space):
    """The new state becomes the state."""
    if space.by_item and space.blocks == 1:
        copy_items(row_address(space, NEW), row_address(space, Y), space.n)
    else:
        copy(space, NEW, Y)


@compiled(**INLINE)
def diverged(space, limit):
    """Whether a new state is larger than the limit or not a number."""
    beyond = False
    for offset in range(0, space.stride, BLOCK_BYTES):
        beyond |= any_beyond(row_address(space, NEW) + offset, limit)
    return beyond


@compiled(**LEAN)
def first_to_leave(space, stages):
    """Index of the state that diverged: the first with a non-finite slope, stage by stage, else the largest."""
    for stage in range(stages):
        k = states(space, K0 + stage)
        for i in range(space.n):
            if not np.isfinite(k[i]):
                return i
    largest, size, new = 0, -1.0, states(space, NEW)
    for i in range(space.n):
        if not np.isfinite(new[i]):
            return i
        if abs(new[i]) > size:
            largest, size = i, abs(new[i])
    return largest
