"""Runs in and out of lanes: a free lane takes the next run of the batch, a finished one leaves its results there."""

import numpy as np

from qddot.runner.inputs.instants import rounding
from qddot.runner.lanes.lane import control_of
from qddot.runner.lanes.pack import LANES
from qddot.runner.machine.calls import take_next
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers


@compiled(**LEAN)
def sample_time(batch, run, j):
    """Time of the sample j of a run."""
    return floats(batch.times, 1)[run * batch.n_samples + j]


@compiled(**LEAN)
def gather(lane, where, x):
    """Copy what stands for a lane in the rows at an address into x (n,)."""
    rows = floats(where, len(x) * LANES)
    for m in range(len(x)):
        x[m] = rows[m * LANES + lane]


@compiled(**LEAN)
def next_break(batch, pack, lane, t):
    """The first breakpoint of the lane's inputs after t, and not one time with it."""
    run, at = integers(pack.run, LANES)[lane], integers(pack.break_at, 1)
    found = np.inf
    for i in range(batch.channels):
        where = run * batch.channels + i
        table, rate = integers(batch.table, 1)[where], floats(batch.rate, 1)[where]
        first, end = integers(batch.break_first, 1)[table], integers(batch.break_last, 1)[table]
        if rate == 0.0 or integers(batch.order, 1)[i] != 0 or first == end:
            continue
        offset, breaks, count = floats(batch.offset, 1)[where], floats(batch.breaks, 1), end - first
        j = at[lane * batch.channels + i]
        while j < count:
            when = (breaks[first + j if rate > 0.0 else end - 1 - j] - offset) / rate
            if when - t > rounding(when):
                found = min(found, when)
                break
            j += 1
        at[lane * batch.channels + i] = j
    return found


@compiled(**LEAN)
def idle(pack, lane):
    """Leave a lane with nothing to do: it stands still and counts for nothing."""
    its = control_of(pack, lane)
    its.h = its.k = its.step = its.active = its.fresh = 0.0
    its.start = its.target = its.stop = its.t
    its.attention = its.high = its.sample = np.inf
    its.low = -np.inf
    integers(pack.run, LANES)[lane] = -1


@compiled(**LEAN)
def take_run(batch, pack, lane):
    """Give a lane the next run of the batch; False where there is none."""
    run = take_next(batch.next)
    if run >= batch.runs:
        idle(pack, lane)
        return False
    integers(pack.run, LANES)[lane] = run
    for counter in (pack.sample, pack.steps, pack.failed_attempts, pack.evaluations, pack.landing):
        integers(counter, LANES)[lane] = 0
    now, initial = floats(pack.now, batch.n * LANES), floats(batch.initial + 8 * run * batch.n, batch.n)
    for m in range(batch.n):
        now[m * LANES + lane] = initial[m]
    c, constants = floats(pack.c, 1), floats(batch.constants + 8 * run * batch.n_constants, batch.n_constants)
    for m in range(batch.n_constants):
        c[m * LANES + lane] = constants[m]
    for i in range(batch.channels):
        for cursor in (pack.piece, pack.break_at):
            integers(cursor, 1)[lane * batch.channels + i] = 0
    its, t0 = control_of(pack, lane), floats(batch.t0, batch.runs)[run]
    its.t = t0
    its.low = its.high = np.inf
    its.at = its.side = t0
    return True


@compiled(**LEAN)
def leave(batch, pack, lane, status, where):
    """Write the results of a lane's run: its states stand in the rows at an address."""
    run, n = integers(pack.run, LANES)[lane], batch.n
    gather(lane, where, floats(batch.final + 8 * n * run, n))
    integers(batch.status, batch.runs)[run] = status
    integers(batch.steps, batch.runs)[run] = integers(pack.steps, LANES)[lane]
    integers(batch.failed_attempts, batch.runs)[run] = integers(pack.failed_attempts, LANES)[lane]
    integers(batch.evaluations, batch.runs)[run] = integers(pack.evaluations, LANES)[lane]


@compiled(**LEAN)
def all_idle(pack):
    """Whether no lane has a run."""
    busy = 0
    for lane in range(LANES):
        busy += integers(pack.run, LANES)[lane] >= 0
    return busy == 0
