"""Constant steps in lanes: every lane has its own grid, breakpoints, samples and end, and lands on them.

The plan of a step is made for all lanes at once; lanes whose step ends at a breakpoint, a sample or the end of the run
are looked at one by one. What a lane does is what `explicit.march` does with its run alone.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import typeof, types

from runner import abi
from runner.compiled import compiled
from runner.explicit.march import SNAP
from runner.lanes.inputs import look_up, set_times
from runner.lanes.kernel import lane_loop
from runner.lanes.pack import (
    AT,
    ATTENTION,
    BATCH,
    LANES,
    PACK,
    SIZE,
    START,
    STEP,
    TARGET,
    H,
    K,
    T,
    control_rows,
)
from runner.lanes.runs import (
    INSIDE,
    all_idle,
    leave,
    next_break,
    sample_time,
    take_run,
    write_samples_at,
)
from runner.lanes.vectors import ROW, call_lanes, combine, doubles, sum_of_squares
from runner.memory import LEAN, floats, integers, record
from runner.problem import Status

RUNNING, FINISHED, NON_FINITE = int(Status.RUNNING), int(Status.FINISHED), int(Status.NON_FINITE)
#: What a step of a lane lands on, as bits.
GRID, STOP, END = 1, 2, 4


@lane_loop(types.int64(abi.POINTER))
def plan_steps(control):
    """Let every lane step to its next grid point; returns how many want a closer look."""
    found = 0
    for lane in range(LANES):
        target = control[START * LANES + lane] + (control[K * LANES + lane] + 1.0) * control[STEP * LANES + lane]
        control[TARGET * LANES + lane] = target
        control[H * LANES + lane] = target - control[T * LANES + lane]
        found += target >= control[ATTENTION * LANES + lane]
    return found


@lane_loop(types.int64(abi.POINTER, types.float64))
def end_steps(control, limit):
    """Make the ends of the steps the present; returns how many lanes may have left the bounds."""
    found = 0
    for lane in range(LANES):
        control[T * LANES + lane] = control[TARGET * LANES + lane]
        control[K * LANES + lane] += 1.0
        found += not control[SIZE * LANES + lane] <= limit
    return found


@compiled(**LEAN)
def plan_stop(batch, pack, lane, t):
    """Find the next breakpoint or sample after t, and from when on the lane wants a closer look."""
    control, run = control_rows(pack), integers(pack.run, LANES)[lane]
    t0, t1, step = floats(batch.t0, batch.runs)[run], floats(batch.t1, batch.runs)[run], batch.step
    near = SNAP * step
    sample = np.inf
    if integers(pack.sample, LANES)[lane] < batch.n_samples:
        sample = sample_time(batch, run, integers(pack.sample, LANES)[lane])
    stop = next_break(batch, pack, lane, t + near)
    if stop < np.inf:
        grid = t0 + np.round((stop - t0) / step) * step
        stop = stop if abs(stop - grid) > near else grid
    stop = sample if sample <= stop + near else stop
    stop = stop if stop < t1 - near else np.inf
    points = max(1.0, np.ceil((t1 - t0) / step - SNAP))
    control[ATTENTION * LANES + lane] = min(stop - near, t0 + (points - 0.5) * step)
    return stop


@compiled(**LEAN)
def plan_closely(batch, pack, lane):
    """Let a lane step to what comes first: grid point, breakpoint, sample, end."""
    control, run = control_rows(pack), integers(pack.run, LANES)[lane]
    t0, t1, step = floats(batch.t0, batch.runs)[run], floats(batch.t1, batch.runs)[run], batch.step
    k, near = control[K * LANES + lane], SNAP * step
    last = k + 1.0 >= max(1.0, np.ceil((t1 - t0) / step - SNAP))
    grid = t1 if last else t0 + (k + 1.0) * step
    stop = plan_stop(batch, pack, lane, control[T * LANES + lane])
    at_stop = stop <= grid + near
    target = stop if at_stop else grid
    control[TARGET * LANES + lane] = target
    control[H * LANES + lane] = target - control[T * LANES + lane]
    at_grid = not at_stop or target >= grid - near
    integers(pack.landing, LANES)[lane] = GRID * at_grid + STOP * at_stop + END * (last and not at_stop)


@compiled(**LEAN)
def begin(batch, pack, lane):
    """Give a lane its next run, from the first grid point on; False where there is none."""
    if not take_run(batch, pack, lane):
        return False
    control, run = control_rows(pack), integers(pack.run, LANES)[lane]
    control[START * LANES + lane], control[K * LANES + lane] = floats(batch.t0, batch.runs)[run], 0.0
    control[STEP * LANES + lane] = batch.step
    integers(pack.steps, LANES)[lane] = pack.taken
    write_samples_at(batch, pack, lane, control[T * LANES + lane], pack.now, SNAP * batch.step)
    plan_stop(batch, pack, lane, control[T * LANES + lane])
    return True


@compiled(**LEAN)
def state_that_left(batch, pack, lane, stages):
    """The first state with a slope that is not finite, stage by stage, else the largest; -1 where all are in bounds."""
    x, slopes = floats(pack.now, batch.n * LANES), floats(pack.slopes, stages * batch.n * LANES)
    within, largest, bad = True, 0, -1
    for m in range(batch.n):
        size = abs(x[m * LANES + lane])
        within = within and size <= batch.limit
        if bad < 0 and not np.isfinite(size):
            bad = m
        if size > abs(x[largest * LANES + lane]):
            largest = m
    if within:
        return -1
    for i in range(stages * batch.n):
        if not np.isfinite(slopes[i * LANES + lane]):
            return i % batch.n
    return bad if bad >= 0 else largest


@compiled(**LEAN)
def leave_counted(batch, pack, lane, status, stages):
    """`leave` after as many steps as were taken since the run came; the states are those now."""
    steps = pack.taken - integers(pack.steps, LANES)[lane]
    integers(pack.steps, LANES)[lane] = steps
    integers(pack.evaluations, LANES)[lane] = steps * stages
    leave(batch, pack, lane, status, pack.now if status == FINISHED else pack.new)


@compiled(**LEAN)
def land(batch, pack, lane, stages):
    """After a step to a breakpoint, sample or end: write, finish, take the next run."""
    control, landing = control_rows(pack), integers(pack.landing, LANES)[lane]
    integers(pack.landing, LANES)[lane] = 0
    if landing & GRID == 0:
        control[K * LANES + lane] -= 1.0
    t = control[T * LANES + lane]
    write_samples_at(batch, pack, lane, t, pack.now, SNAP * batch.step)
    if landing & END:
        leave_counted(batch, pack, lane, FINISHED, stages)
        begin(batch, pack, lane)
    else:
        plan_stop(batch, pack, lane, t)
    pack.fresh |= landing & (STOP | END)


@compiled(**LEAN)
def drop_diverged(batch, pack, stages):
    """Lanes that left the bounds end with their last good states, which stand in the rows `new`, and are refilled."""
    for lane in range(LANES):
        run = integers(pack.run, LANES)[lane]
        state = state_that_left(batch, pack, lane, stages) if run >= 0 else -1
        if state >= 0:
            integers(pack.landing, LANES)[lane] = 0
            floats(batch.failed_at, batch.runs)[run] = control_rows(pack)[T * LANES + lane]
            integers(batch.failed_state, batch.runs)[run] = state
            leave_counted(batch, pack, lane, NON_FINITE, stages)
            begin(batch, pack, lane)
            pack.fresh = 1


@compiled(**LEAN)
def plan_all_closely(batch, pack):
    """Plan the steps of the lanes that come to a breakpoint, a sample or their end."""
    control = control_rows(pack)
    for lane in range(LANES):
        if control[TARGET * LANES + lane] >= control[ATTENTION * LANES + lane]:
            plan_closely(batch, pack, lane)


@compiled(**LEAN)
def evaluate_stage(batch, pack, c, known, stage):
    """Slope of a stage in all lanes; known: whether the inputs at its time already are."""
    if not known:
        set_times(doubles(pack.control), c, min(max(c, INSIDE), 1.0 - INSIDE))
        look_up(batch, pack)
    at, where = pack.control + ROW * AT, pack.now if stage == 0 else pack.new
    call_lanes(batch.rhs, at, where, pack.u, pack.c, pack.slopes + ROW * batch.n * stage)


@compiled(**LEAN)
def look_closely(batch, pack, stages, diverged):
    """After a step: lanes that diverged or landed are served one by one."""
    if diverged > 0:
        drop_diverged(batch, pack, stages)
    for lane in range(LANES):
        if integers(pack.landing, LANES)[lane]:
            land(batch, pack, lane, stages)


@cache
def advance(method: str, stages: int) -> Any:
    """The compiled loop of a method for a batch, a pack and the addresses of c and of a number of steps."""

    def loop(batch, pack, c_address, most_steps):
        control, c = doubles(pack.control), floats(c_address, stages)
        h, limit = pack.control + ROW * H, min(batch.limit * batch.limit, 1e300)
        for _ in range(most_steps):
            closely = plan_steps(control)
            if closely > 0:
                plan_all_closely(batch, pack)
            for stage in range(stages):
                if stage > 0:
                    combine(method, stage, batch.n, h, pack.now, pack.slopes, pack.new)
                known = pack.fresh == 0 if stage == 0 else c[stage] == c[stage - 1]
                evaluate_stage(batch, pack, c[stage], known, stage)
            combine(method, stages, batch.n, h, pack.now, pack.slopes, pack.new)
            sum_of_squares(batch.n, pack.new, pack.control + ROW * SIZE)
            diverged = end_steps(control, limit)
            pack.now, pack.new = pack.new, pack.now
            pack.taken += 1
            pack.fresh = c[stages - 1] != 1.0
            if closely + diverged > 0:
                look_closely(batch, pack, stages, diverged)
                if all_idle(pack):
                    return FINISHED
        return RUNNING

    return compiled(types.int64(*_ARGUMENTS), error_model="numpy", _nrt=False, nogil=True)(loop)


_ARGUMENTS = (typeof(record(BATCH)), typeof(record(PACK)), types.int64, types.int64)


def start(batch, pack):
    """Give all lanes of a new pack their first runs; returns whether there is any."""
    for lane in range(LANES):
        begin(batch, pack, lane)
    pack.fresh = 1
    return not all_idle(pack)


@cache
def compiled_start() -> Any:
    """`start`, compiled."""
    return compiled(types.boolean(*_ARGUMENTS[:2]), error_model="numpy", _nrt=False, nogil=True)(start)
