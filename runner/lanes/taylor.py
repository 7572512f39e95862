"""Taylor's method in lanes: every lane has its own time, step, pieces of inputs, breakpoints, samples and end.

The order is that of all. What a lane does is what `taylor.loop` does with its run alone; no step is tried twice.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types

from qddot.runner.lanes.adaptive import stuck_lanes
from qddot.runner.lanes.attempts import begin, hand_over, plan
from qddot.runner.lanes.lane import control_of
from qddot.runner.lanes.pack import BATCH_TYPE, GOOD, LANES, NEXT, PACK_TYPE, SIZE, THETA, H
from qddot.runner.lanes.runs import all_idle
from qddot.runner.lanes.samples import aim, write_aimed, write_samples
from qddot.runner.lanes.series import SERIES_TYPE, look_around, take_factors
from qddot.runner.lanes.series_step import end_steps, judge_steps, plan_steps, set_behind
from qddot.runner.lanes.settle import status_unless_stuck
from qddot.runner.lanes.terms import size_states
from qddot.runner.lanes.values import ROW
from qddot.runner.lanes.vectors import choose
from qddot.runner.machine.calls import doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers
from qddot.runner.machine.series_calls import call_polynomials, call_series, call_steps
from qddot.runner.machine.series_memory import SENSE
from qddot.runner.problem import Status

#: As np.int64, because numba compiles a function again for every literal int that it is called with.
RUNNING, FINISHED = np.int64(Status.RUNNING), np.int64(Status.FINISHED)
NON_FINITE, STEP_UNDERFLOW = np.int64(Status.NON_FINITE), np.int64(Status.STEP_UNDERFLOW)


@compiled(**LEAN)
def set_out(batch, pack, series):
    """Lanes that have a new run or passed a stop: first samples, the next stop, and the factors of a new run."""
    write_samples(batch, pack, 0.0)
    for lane in range(LANES):
        its = control_of(pack, lane)
        if its.fresh > 0.0:
            plan(batch, pack, lane)
            if its.steps == 0.0:
                take_factors(pack, series, lane)
            its.fresh = 0.0
    pack.fresh = 0


@compiled(**LEAN)
def sum_series(pack, series, times, target):
    """Rows of states at a row of times from where the series stand."""
    call_polynomials(series.polynomial, pack.slopes, series.order, times, target)


@compiled(**LEAN)
def worst_state(batch, pack, series, lane):
    """The first state of a lane whose last coefficient is not finite, or else the one with the largest."""
    last, found = floats(pack.now + series.state_stride * series.order, batch.n * LANES), 0
    for m in range(batch.n):
        if not np.isfinite(last[m * LANES + lane]):
            return m
        if abs(last[m * LANES + lane]) > abs(last[found * LANES + lane]):
            found = m
    return found


@compiled(**LEAN)
def fail(batch, pack, series, lane):
    """A lane needs a step too small, or diverged: notes when and by which state, returns the status."""
    its, run = control_of(pack, lane), integers(pack.run, LANES)[lane]
    new, state, when, status = floats(pack.new, batch.n * LANES), -1, its.t, NON_FINITE
    if its.next >= its.least and its.next > 0.0:
        when = its.t + its.h
        for m in range(batch.n):
            if state < 0 and not abs(new[m * LANES + lane]) <= batch.limit:
                state = m
    else:
        state = worst_state(batch, pack, series, lane)
        status = STEP_UNDERFLOW if its.next > 0.0 else NON_FINITE
    floats(batch.failed_at, batch.runs)[run] = when
    integers(batch.failed_state, batch.runs)[run] = state
    return status


@compiled(**LEAN)
def status_of(batch, pack, series, lane, stuck):
    """How the run of a lane stands after a step."""
    if stuck >> lane & 1:
        integers(pack.evaluations, LANES)[lane] = 1
        return fail(batch, pack, series, lane)
    return status_unless_stuck(batch, pack, lane)


@compiled(**LEAN)
def settle(batch, pack, series, stuck):
    """After the step: runs that came to their end or got stuck are left, their lanes refilled; others pass a stop."""
    for lane in range(LANES):
        if integers(pack.run, LANES)[lane] < 0:
            continue
        status = status_of(batch, pack, series, lane, stuck)
        if status != RUNNING:
            hand_over(batch, pack, lane, status, np.int64(control_of(pack, lane).steps))
            if begin(batch, pack, np.inf, lane):
                pack.fresh = 1


@compiled(**LEAN)
def write_samples_within(batch, pack, series):
    """Write the samples of all lanes within the steps they just made by their series, and those at their ends."""
    while aim(batch, pack) > 0:
        set_behind(doubles(pack.control))
        sum_series(pack, series, pack.control + ROW * THETA, pack.stage)
        write_aimed(batch, pack)


@compiled(**LEAN)
def take_step(batch, pack, series):
    """The series of all lanes, and the steps that they allow; leaves the ends in the rows `new`; see `judge_steps`."""
    rows, order, memory = doubles(pack.control), series.order, pack.slopes
    look_around(batch, pack, series)
    call_series(series.series, memory, order)
    steps = pack.control + ROW * NEXT
    call_steps(series.step, memory, order, batch.rtol, batch.atol, series.rtol, series.decay, steps)
    plan_steps(rows, batch.first_step, float(batch.n_inputs))
    sum_series(pack, series, pack.control + ROW * H, pack.new)
    size_states(batch.n, pack.new, pack.control + ROW * SIZE)
    return judge_steps(rows, batch.limit)


def loop(batch, pack, series, most_steps):
    """At most so many steps of all lanes; returns whether runs are left: RUNNING or FINISHED."""
    rows = doubles(pack.control)
    for _ in range(most_steps):
        if pack.fresh != 0:
            set_out(batch, pack, series)
        closely, stuck = take_step(batch, pack, series), 0
        if closely > 0:
            write_samples_within(batch, pack, series)
            stuck = stuck_lanes(pack)
        end_steps(rows)
        choose(batch.n, pack.control + ROW * GOOD, pack.now, pack.new)
        if closely > 0 or batch.max_steps > 0:
            settle(batch, pack, series, stuck)
            if all_idle(pack):
                return FINISHED
    return RUNNING


_ARGUMENTS = (BATCH_TYPE, PACK_TYPE, SERIES_TYPE)


@cache
def compiled_loop() -> Any:
    """`loop`, compiled."""
    return compiled(types.int64(*_ARGUMENTS, types.int64), _nrt=False, nogil=True)(loop)


def start(batch, pack, series):
    """Give all lanes of a new pack their first runs; returns whether there is any."""
    pack.now = pack.slopes + series.states
    for lane in range(LANES):
        floats(pack.slopes + ROW * SENSE, LANES)[lane] = 1.0
        begin(batch, pack, np.inf, lane)
    pack.fresh = 1
    return not all_idle(pack)


@cache
def compiled_start() -> Any:
    """`start`, compiled."""
    return compiled(types.boolean(*_ARGUMENTS), _nrt=False, nogil=True)(start)
