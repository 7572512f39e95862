"""Where a lane of an adaptive method starts anew: at the start of its run and at every breakpoint of its inputs."""

from typing import Any

import numpy as np
from numba import types

from qddot.runner.frame.step_control import (
    LEAST_LAST_ERROR,
    MATLAB,
    matlab_first_step,
    settled_step,
    trial_step,
)
from qddot.runner.inputs.instants import after, side_of
from qddot.runner.lanes.attempts import begin, finish, lane_norm, plan, relative
from qddot.runner.lanes.inputs import look_up, outside
from qddot.runner.lanes.judge import CONTROL_TYPE
from qddot.runner.lanes.lane import control_of
from qddot.runner.lanes.pack import AT, BATCH_TYPE, FRESH, LANES, PACK_TYPE
from qddot.runner.lanes.samples import PAIR_TYPE, write_samples
from qddot.runner.lanes.values import ROW
from qddot.runner.lanes.vectors import choose
from qddot.runner.machine.calls import call_lanes, doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, floats, integers, intrinsic
from qddot.runner.machine.pointers import caller
from qddot.runner.problem import Status

#: As np.int64, because numba compiles a function again for every literal int that it is called with.
NON_FINITE = np.int64(Status.NON_FINITE)


@compiled(**LEAN)
def fail_at_start(batch, control, pack, pair, lane):
    """The slope where a lane starts is not finite: its run ends there."""
    run, k0 = integers(pack.run, LANES)[lane], floats(pack.slopes, batch.n * LANES)
    found, size = 0, -1.0
    for m in range(batch.n):
        ratio = relative(batch, control, pack, lane, m, k0[m * LANES + lane])
        if ratio > size:
            found, size = m, ratio
    floats(batch.failed_at, batch.runs)[run] = control_of(pack, lane).t
    integers(batch.failed_state, batch.runs)[run] = found
    integers(pack.evaluations, LANES)[lane] += 1
    finish(batch, pack, pair, lane, NON_FINITE)


@compiled(**LEAN)
def evaluate(batch, pack, states, target):
    """Slopes of all lanes at their times AT and the states in rows at an address, into the rows at another."""
    look_up(batch.look_up, batch, pack, 0, outside(doubles(pack.control)))
    call_lanes(batch.rhs, pack.control + ROW * AT, states, pack.u, pack.c, target)


@compiled(**LEAN)
def take_slopes(batch, control, pack, pair, longest_step):
    """The slopes of fresh lanes at their start, with inputs as they are right after it; lanes that fail are refilled.

    Returns how many were refilled: their slopes are still to be taken.
    """
    again = 0
    write_samples(batch, pack, 0.0)
    for lane in range(LANES):
        its = control_of(pack, lane)
        if its.fresh > 0.0:
            plan(batch, pack, lane)
        t = its.t
        its.at = t
        its.side = after(t, its.stop - t)
    next_slope = pack.slopes + ROW * batch.n
    evaluate(batch, pack, pack.now, next_slope)
    choose(batch.n, pack.control + ROW * FRESH, pack.slopes, next_slope)
    for lane in range(LANES):
        fresh = control_of(pack, lane).fresh > 0.0
        if fresh and not lane_norm(batch, control, pack, lane, pack.slopes, pack.slopes, 0.0) < np.inf:
            fail_at_start(batch, control, pack, pair, lane)
            again += begin(batch, pack, longest_step, lane)
    return again


@compiled(**BY_ADDRESS)
def restart(batch, control, pack, pair, longest_step):
    """Take the slopes of fresh lanes, and settle how long their next steps are."""
    while take_slopes(batch, control, pack, pair, longest_step) > 0:
        pass
    evaluations = integers(pack.evaluations, LANES)
    for lane in range(LANES):
        its = control_of(pack, lane)
        its.at = its.side = its.t
        its.h = 0.0
        if its.fresh == 0.0:
            continue
        evaluations[lane] += 1
        speed = lane_norm(batch, control, pack, lane, pack.slopes, pack.slopes, 0.0)
        ahead = min(its.longest, its.stop - its.t)
        its.last_error = LEAST_LAST_ERROR
        if first_is_given(batch, its):
            its.next = batch.first_step
        elif control.kind == MATLAB:
            size = matlab_first_step(speed, control.rtol, control.order, ahead)
            its.next = min(its.next, size)
        else:
            h = min(trial_step(lane_norm(batch, control, pack, lane, pack.now, pack.now, 0.0), speed), ahead)
            its.h = h
            its.at += h
            its.side = side_of(its.t, h, 1.0)
            evaluations[lane] += 1
    if control.kind != MATLAB:
        first_steps(batch, control, pack)
    for lane in range(LANES):
        control_of(pack, lane).fresh = 0.0
    pack.fresh = 0


@compiled(**LEAN)
def first_is_given(batch, its):
    """Whether this is a run's first step and its size was asked for."""
    return batch.first_step > 0.0 and its.steps == 0.0


@compiled(**LEAN)
def first_steps(batch, control, pack):
    """Sizes of first steps from second derivatives, which an explicit Euler step of all fresh lanes tells."""
    n = batch.n
    now, slope, stage = floats(pack.now, n * LANES), floats(pack.slopes, n * LANES), floats(pack.stage, n * LANES)
    for i in range(n * LANES):
        stage[i] = now[i] + control_of(pack, i % LANES).h * slope[i]
    second = pack.slopes + ROW * n
    evaluate(batch, pack, pack.stage, second)
    for lane in range(LANES):
        its = control_of(pack, lane)
        if its.fresh > 0.0 and not first_is_given(batch, its):
            h = its.h
            size = lane_norm(batch, control, pack, lane, pack.now, pack.now, 0.0)
            speed = lane_norm(batch, control, pack, lane, pack.slopes, pack.slopes, 0.0)
            bend = lane_norm(batch, control, pack, lane, second, pack.slopes, 1.0) / h
            ahead = min(its.longest, its.stop - its.t)
            settled = min(settled_step(trial_step(size, speed), max(speed, bend), control.order), ahead)
            its.next = min(its.next, settled)


RESTART = types.void(BATCH_TYPE, CONTROL_TYPE, PACK_TYPE, PAIR_TYPE, types.float64)


@intrinsic
def call_restart(typing_context: Any, where: Any, batch: Any, control: Any, pack: Any, pair: Any, longest: Any) -> Any:
    """Call `restart` at an address, see `inputs.look_up`."""
    return caller(RESTART)
