"""What a lane of an adaptive method is given and leaves: its next stop and run, its results, sizes of its states."""

import numpy as np

from qddot.runner.frame.step_control import MATLAB, scaled, tolerance
from qddot.runner.inputs.instants import rounding
from qddot.runner.lanes.lane import control_of
from qddot.runner.lanes.pack import LANES
from qddot.runner.lanes.runs import leave, next_break, sample_time, take_run
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers


@compiled(**LEAN)
def plan(batch, pack, lane):
    """The next stop of a lane after its present time, and its next sample, those at present being written."""
    its, run = control_of(pack, lane), integers(pack.run, LANES)[lane]
    t, t1 = its.t, floats(batch.t1, batch.runs)[run]
    stop = next_break(batch, pack, lane, t)
    its.stop = stop if t1 - stop > rounding(stop) else t1
    j = integers(pack.sample, LANES)[lane]
    its.sample = sample_time(batch, run, j) if j < batch.n_samples else np.inf


@compiled(**LEAN)
def begin(batch, pack, longest_step, lane):
    """Give a lane its next run; False where there is none."""
    if not take_run(batch, pack, lane):
        return False
    its, run = control_of(pack, lane), integers(pack.run, LANES)[lane]
    its.steps = its.failed = its.failures = 0.0
    span = floats(batch.t1, batch.runs)[run] - floats(batch.t0, batch.runs)[run]
    its.longest = batch.max_step if batch.max_step > 0.0 else longest_step * span
    its.next = np.inf
    its.active = its.fresh = 1.0
    return True


@compiled(**LEAN)
def finish(batch, pack, pair, lane, status):
    """Write the results of a lane's run, whose states are those now."""
    its = control_of(pack, lane)
    steps, failed = np.int64(its.steps), np.int64(its.failed)
    ends_with_next = pair.next_slope < pair.stages
    hand_over(batch, pack, lane, status, (steps + failed) * (pair.stages - 1) + (0 if ends_with_next else steps))


@compiled(**LEAN)
def hand_over(batch, pack, lane, status, evaluations):
    """Write the results of a lane's run, so many evaluations being added to those that it has counted."""
    its = control_of(pack, lane)
    integers(pack.steps, LANES)[lane], integers(pack.failed_attempts, LANES)[lane] = its.steps, its.failed
    integers(pack.evaluations, LANES)[lane] += evaluations
    leave(batch, pack, lane, status, pack.now)


@compiled(**LEAN)
def relative(batch, control, pack, lane, m, value):
    """A number relative to the tolerance of state m of a lane, at its present state."""
    x = abs(floats(pack.now, batch.n * LANES)[m * LANES + lane])
    rtol, atol = floats(batch.rtol, batch.n)[m], floats(batch.atol, batch.n)[m]
    return scaled(value, tolerance(rtol, atol, x, control.kind == MATLAB), x, batch.limit)


@compiled(**LEAN)
def lane_norm(batch, control, pack, lane, rows, minus, factor):
    """Size of a lane's states in the rows at an address, less those at another times a factor."""
    a, b = floats(rows, batch.n * LANES), floats(minus, batch.n * LANES)
    total = 0.0
    for m in range(batch.n):
        value = a[m * LANES + lane] - (factor * b[m * LANES + lane] if factor != 0.0 else 0.0)
        ratio = relative(batch, control, pack, lane, m, value)
        total = max(total, ratio) if control.kind == MATLAB else total + ratio * ratio
    return total if control.kind == MATLAB else np.sqrt(total / batch.n)
