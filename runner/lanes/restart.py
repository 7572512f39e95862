"""Where a lane of an adaptive method starts anew: at the start of its run and at every breakpoint of its inputs."""

from typing import Any

import numpy as np
from numba import typeof, types

from runner.compiled import compiled
from runner.explicit.adaptive import APART
from runner.explicit.controller import CONTROL, LEAST_LAST_ERROR, MATLAB, matlab_first_step, settled_step, trial_step
from runner.lanes.calls import call_lanes
from runner.lanes.inputs import INSIDE, look_up
from runner.lanes.pack import (
    ACTIVE,
    AT,
    BATCH_TYPE,
    FAILED,
    FAILURES,
    FRESH,
    LANES,
    LAST_ERROR,
    LONGEST,
    NEXT,
    PACK_TYPE,
    SAMPLE,
    SIDE,
    STEPS,
    STOP,
    H,
    T,
    control_rows,
)
from runner.lanes.runs import leave, next_break, sample_time, take_run
from runner.lanes.samples import PAIR_TYPE, write_samples
from runner.lanes.values import ROW
from runner.lanes.vectors import choose
from runner.memory import LEAN, floats, integers, intrinsic, record
from runner.pointers import caller
from runner.problem import Status

#: As np.int64, because numba compiles a function again for every literal int that it is called with.
NON_FINITE = np.int64(Status.NON_FINITE)


@compiled(**LEAN)
def plan(batch, pack, lane):
    """The next stop of a lane after its present time, and its next sample, those at present being written."""
    control, run = control_rows(pack), integers(pack.run, LANES)[lane]
    t0, t1 = floats(batch.t0, batch.runs)[run], floats(batch.t1, batch.runs)[run]
    near = APART * max(np.spacing(abs(t0)), np.spacing(abs(t1)))
    stop = next_break(batch, pack, lane, control[T * LANES + lane] + near)
    control[STOP * LANES + lane] = stop if stop < t1 - near else t1
    j = integers(pack.sample, LANES)[lane]
    control[SAMPLE * LANES + lane] = sample_time(batch, run, j) if j < batch.n_samples else np.inf


@compiled(**LEAN)
def begin(batch, pack, longest_step, lane):
    """Give a lane its next run; False where there is none."""
    if not take_run(batch, pack, lane):
        return False
    control, run = control_rows(pack), integers(pack.run, LANES)[lane]
    for row in (STEPS, FAILED, FAILURES):
        control[row * LANES + lane] = 0.0
    span = floats(batch.t1, batch.runs)[run] - floats(batch.t0, batch.runs)[run]
    control[LONGEST * LANES + lane] = batch.max_step if batch.max_step > 0.0 else longest_step * span
    control[NEXT * LANES + lane] = np.inf
    control[ACTIVE * LANES + lane] = control[FRESH * LANES + lane] = 1.0
    return True


@compiled(**LEAN)
def finish(batch, pack, pair, lane, status):
    """Write the results of a lane's run, whose states are those now."""
    control = control_rows(pack)
    steps, failed = np.int64(control[STEPS * LANES + lane]), np.int64(control[FAILED * LANES + lane])
    ends_with_next = pair.next_slope < pair.stages
    integers(pack.steps, LANES)[lane], integers(pack.failed_attempts, LANES)[lane] = steps, failed
    integers(pack.evaluations, LANES)[lane] += (steps + failed) * (pair.stages - 1) + (0 if ends_with_next else steps)
    leave(batch, pack, lane, status, pack.now)


@compiled(**LEAN)
def scaled(batch, control, pack, lane, m, value):
    """A number relative to the tolerance of state m of a lane, at its present state."""
    x = abs(floats(pack.now, batch.n * LANES)[m * LANES + lane])
    part, atol = batch.rtol * x, floats(batch.atol, batch.n)[m]
    ratio = abs(value) / (max(part, atol) if control.kind == MATLAB else part + atol)
    return ratio if ratio < np.inf and x <= batch.limit else np.inf


@compiled(**LEAN)
def lane_norm(batch, control, pack, lane, rows, minus, factor):
    """Size of a lane's states in the rows at an address, less those at another times a factor."""
    a, b = floats(rows, batch.n * LANES), floats(minus, batch.n * LANES)
    total = 0.0
    for m in range(batch.n):
        value = a[m * LANES + lane] - (factor * b[m * LANES + lane] if factor != 0.0 else 0.0)
        ratio = scaled(batch, control, pack, lane, m, value)
        total = max(total, ratio) if control.kind == MATLAB else total + ratio * ratio
    return total if control.kind == MATLAB else np.sqrt(total / batch.n)


@compiled(**LEAN)
def fail_at_start(batch, control, pack, pair, lane):
    """The slope where a lane starts is not finite: its run ends there."""
    run, k0 = integers(pack.run, LANES)[lane], floats(pack.slopes, batch.n * LANES)
    found, size = 0, -1.0
    for m in range(batch.n):
        ratio = scaled(batch, control, pack, lane, m, k0[m * LANES + lane])
        if ratio > size:
            found, size = m, ratio
    floats(batch.failed_at, batch.runs)[run] = control_rows(pack)[T * LANES + lane]
    integers(batch.failed_state, batch.runs)[run] = found
    integers(pack.evaluations, LANES)[lane] += 1
    finish(batch, pack, pair, lane, NON_FINITE)


@compiled(**LEAN)
def evaluate(batch, pack, states, target):
    """Slopes of all lanes at their times AT and the states in rows at an address, into the rows at another."""
    look_up(batch.look_up, batch, pack, 0)
    call_lanes(batch.rhs, pack.control + ROW * AT, states, pack.u, pack.c, target)


@compiled(**LEAN)
def take_slopes(batch, control, pack, pair, longest_step):
    """The slopes of fresh lanes at their start, with inputs as they are right after it; lanes that fail are refilled.

    Returns how many were refilled: their slopes are still to be taken.
    """
    rows, again = control_rows(pack), 0
    write_samples(batch, pack, 0.0)
    for lane in range(LANES):
        if rows[FRESH * LANES + lane] > 0.0:
            plan(batch, pack, lane)
        t = rows[T * LANES + lane]
        rows[AT * LANES + lane] = t
        rows[SIDE * LANES + lane] = t + INSIDE * (rows[STOP * LANES + lane] - t)
    next_slope = pack.slopes + ROW * batch.n
    evaluate(batch, pack, pack.now, next_slope)
    choose(batch.n, pack.control + ROW * FRESH, pack.slopes, next_slope)
    for lane in range(LANES):
        fresh = rows[FRESH * LANES + lane] > 0.0
        if fresh and not lane_norm(batch, control, pack, lane, pack.slopes, pack.slopes, 0.0) < np.inf:
            fail_at_start(batch, control, pack, pair, lane)
            again += begin(batch, pack, longest_step, lane)
    return again


@compiled(**LEAN)
def restart(batch, control, pack, pair, longest_step):
    """Take the slopes of fresh lanes, and settle how long their next steps are."""
    while take_slopes(batch, control, pack, pair, longest_step) > 0:
        pass
    rows, evaluations = control_rows(pack), integers(pack.evaluations, LANES)
    for lane in range(LANES):
        rows[AT * LANES + lane] = rows[SIDE * LANES + lane] = rows[T * LANES + lane]
        rows[H * LANES + lane] = 0.0
        if rows[FRESH * LANES + lane] == 0.0:
            continue
        evaluations[lane] += 1
        speed = lane_norm(batch, control, pack, lane, pack.slopes, pack.slopes, 0.0)
        ahead = min(rows[LONGEST * LANES + lane], rows[STOP * LANES + lane] - rows[T * LANES + lane])
        rows[LAST_ERROR * LANES + lane] = LEAST_LAST_ERROR
        if first_is_given(batch, rows, lane):
            rows[NEXT * LANES + lane] = batch.first_step
        elif control.kind == MATLAB:
            size = matlab_first_step(speed, control.rtol, control.order, ahead)
            rows[NEXT * LANES + lane] = min(rows[NEXT * LANES + lane], size)
        else:
            h = min(trial_step(lane_norm(batch, control, pack, lane, pack.now, pack.now, 0.0), speed), ahead)
            rows[H * LANES + lane] = h
            rows[AT * LANES + lane] += h
            rows[SIDE * LANES + lane] += (1.0 - INSIDE) * h
            evaluations[lane] += 1
    if control.kind != MATLAB:
        first_steps(batch, control, pack)
    for lane in range(LANES):
        rows[FRESH * LANES + lane] = 0.0
    pack.fresh = 0


@compiled(**LEAN)
def first_is_given(batch, rows, lane):
    """Whether this is a run's first step and its size was asked for."""
    return batch.first_step > 0.0 and rows[STEPS * LANES + lane] == 0.0


@compiled(**LEAN)
def first_steps(batch, control, pack):
    """Sizes of first steps from second derivatives, which an explicit Euler step of all fresh lanes tells."""
    rows, n = control_rows(pack), batch.n
    now, slope, stage = floats(pack.now, n * LANES), floats(pack.slopes, n * LANES), floats(pack.stage, n * LANES)
    for i in range(n * LANES):
        stage[i] = now[i] + rows[H * LANES + i % LANES] * slope[i]
    second = pack.slopes + ROW * n
    evaluate(batch, pack, pack.stage, second)
    for lane in range(LANES):
        if rows[FRESH * LANES + lane] > 0.0 and not first_is_given(batch, rows, lane):
            h = rows[H * LANES + lane]
            size = lane_norm(batch, control, pack, lane, pack.now, pack.now, 0.0)
            speed = lane_norm(batch, control, pack, lane, pack.slopes, pack.slopes, 0.0)
            bend = lane_norm(batch, control, pack, lane, second, pack.slopes, 1.0) / h
            ahead = min(rows[LONGEST * LANES + lane], rows[STOP * LANES + lane] - rows[T * LANES + lane])
            settled = min(settled_step(trial_step(size, speed), max(speed, bend), control.order), ahead)
            rows[NEXT * LANES + lane] = min(rows[NEXT * LANES + lane], settled)


CONTROL_TYPE = typeof(record(CONTROL))
RESTART = types.void(BATCH_TYPE, CONTROL_TYPE, PACK_TYPE, PAIR_TYPE, types.float64)


@intrinsic
def call_restart(typing_context: Any, where: Any, batch: Any, control: Any, pack: Any, pair: Any, longest: Any) -> Any:
    """Call `restart` at an address, see `inputs.look_up`."""
    return caller(RESTART)
