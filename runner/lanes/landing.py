"""Where lanes of constant step land: on grid points, breakpoints, samples, the end of the run or out of bounds."""

from typing import Any

import numpy as np
from numba import types

from qddot.runner.explicit.march import steps_of
from qddot.runner.inputs.instants import ROUNDING, rounding
from qddot.runner.lanes.lane import control_of
from qddot.runner.lanes.pack import BATCH_TYPE, LANES, PACK_TYPE
from qddot.runner.lanes.runs import leave, next_break, sample_time, take_run
from qddot.runner.lanes.samples import write_samples
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, floats, integers, intrinsic
from qddot.runner.machine.pointers import caller
from qddot.runner.problem import Status

#: As np.int64, because numba compiles a function again for every literal int that it is called with.
FINISHED, NON_FINITE = np.int64(Status.FINISHED), np.int64(Status.NON_FINITE)
#: What a step of a lane lands on, as bits; NEW: the lane has just taken its run.
GRID, AT_STOP, END, NEW = 1, 2, 4, 8


@compiled(**LEAN)
def plan_stop(batch, pack, lane, t):
    """STOP: the next breakpoint or sample after t; ATTENTION: from when on the lane wants a closer look."""
    its, run = control_of(pack, lane), integers(pack.run, LANES)[lane]
    t0, t1, step = floats(batch.t0, batch.runs)[run], floats(batch.t1, batch.runs)[run], batch.step
    sample = np.inf
    if integers(pack.sample, LANES)[lane] < batch.n_samples:
        sample = sample_time(batch, run, integers(pack.sample, LANES)[lane])
    if its.breakpoint - t <= rounding(t):
        its.breakpoint = next_break(batch, pack, lane, t)
    stop = its.breakpoint
    if stop < np.inf:
        grid = t0 + np.round((stop - t0) / step) * step
        stop = stop if abs(stop - grid) > rounding(stop) else grid
    stop = sample if sample < np.inf and sample - stop <= rounding(sample) else stop
    stop = stop if t1 - stop > rounding(stop) else np.inf
    its.stop = stop
    before = stop - rounding(stop) if stop < np.inf else stop
    its.attention = min(before, t0 + (steps_of(t0, t1, step) - 0.5) * step)


@compiled(**LEAN)
def plan_closely(batch, pack, lane):
    """Let a lane step to what comes first: grid point, breakpoint, sample, end."""
    its, run = control_of(pack, lane), integers(pack.run, LANES)[lane]
    t0, t1, step = floats(batch.t0, batch.runs)[run], floats(batch.t1, batch.runs)[run], batch.step
    k = its.k
    last = k + 1.0 >= steps_of(t0, t1, step)
    grid = t1 if last else t0 + (k + 1.0) * step
    stop = its.stop
    at_stop = stop <= grid + rounding(grid)
    target = stop if at_stop else grid
    its.target = target
    its.h = target - its.t
    at_grid = not at_stop or target >= grid - rounding(target)
    integers(pack.landing, LANES)[lane] = GRID * at_grid + AT_STOP * at_stop + END * (last and not at_stop)


@compiled(**LEAN)
def plan_all_closely(batch, pack):
    """Plan the steps of the lanes that come to a breakpoint, a sample or their end."""
    for lane in range(LANES):
        its = control_of(pack, lane)
        if its.target >= its.attention:
            plan_closely(batch, pack, lane)


@compiled(**LEAN)
def begin(batch, pack, lane):
    """Give a lane its next run, from the first grid point on, where there is one."""
    integers(pack.landing, LANES)[lane] = 0
    if take_run(batch, pack, lane):
        its, run = control_of(pack, lane), integers(pack.run, LANES)[lane]
        its.start, its.k = floats(batch.t0, batch.runs)[run], 0.0
        its.step, its.breakpoint = batch.step, -np.inf
        integers(pack.steps, LANES)[lane] = pack.taken
        integers(pack.landing, LANES)[lane] = NEW
    pack.fresh = 1


@compiled(**LEAN)
def set_out(batch, pack):
    """Write the first samples of lanes that have a new run, and plan the next stop of all that landed."""
    landing, found = integers(pack.landing, LANES), 0
    for lane in range(LANES):
        found |= landing[lane]
    if found & NEW:
        write_samples(batch, pack, ROUNDING)
    for lane in range(LANES):
        if landing[lane] != 0:
            landing[lane] = 0
            plan_stop(batch, pack, lane, control_of(pack, lane).t)


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
def drop_diverged(batch, pack, stages):
    """Lanes that left the bounds end with their last good states, which stand in the rows `new`, and are refilled."""
    for lane in range(LANES):
        run = integers(pack.run, LANES)[lane]
        state = state_that_left(batch, pack, lane, stages) if run >= 0 else -1
        if state >= 0:
            floats(batch.failed_at, batch.runs)[run] = control_of(pack, lane).t
            integers(batch.failed_state, batch.runs)[run] = state
            leave_counted(batch, pack, lane, NON_FINITE, stages)
            begin(batch, pack, lane)


@compiled(**BY_ADDRESS)
def land(batch, pack, stages, diverged):
    """After a step: lanes that diverged or came to a breakpoint, a sample or their end are served."""
    if diverged > 0:
        drop_diverged(batch, pack, stages)
    landings = integers(pack.landing, LANES)
    write_samples(batch, pack, ROUNDING)
    for lane in range(LANES):
        landing = landings[lane]
        if landing != 0 and landing & (GRID | NEW) == 0:
            control_of(pack, lane).k -= 1.0
        if landing & END:
            leave_counted(batch, pack, lane, FINISHED, stages)
            begin(batch, pack, lane)
        pack.fresh |= landing & AT_STOP
    set_out(batch, pack)


LAND = types.void(BATCH_TYPE, PACK_TYPE, types.int64, types.int64)


@intrinsic
def call_land(typing_context: Any, where: Any, batch: Any, pack: Any, stages: Any, diverged: Any) -> Any:
    """Call `land` at an address, so that LLVM compiles it once and not into the loop of every method."""
    return caller(LAND)
