"""Adaptive steps in lanes: every lane has its own time, step, controller, breakpoints, samples and end.

All lanes try a step at once, each of its own size; those whose step is good go on, the others try again. What a lane
does is what `explicit.adaptive_loop` does with its run alone.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import typeof, types

from runner.compiled import compiled
from runner.explicit.controller import CONTROL
from runner.explicit.step import PAIR
from runner.explicit.workspace import MOST_STAGES
from runner.lanes.inputs import look_up, set_times
from runner.lanes.judge import end_steps, judge_steps, propose_steps
from runner.lanes.pack import (
    AT,
    BATCH,
    ERROR,
    FRESH,
    GOOD,
    LANDS,
    LANES,
    PACK,
    SAMPLE,
    STEPS,
    STOP,
    TARGET,
    H,
    T,
    control_rows,
)
from runner.lanes.restart import begin, finish, plan, restart, scaled
from runner.lanes.runs import INSIDE, all_idle, sample_time, write_sample
from runner.lanes.vectors import ROW, call_lanes, choose, combine, doubles, estimate_errors
from runner.memory import LEAN, floats, integers, record
from runner.problem import Status

RUNNING, FINISHED, NON_FINITE = int(Status.RUNNING), int(Status.FINISHED), int(Status.NON_FINITE)
STEP_UNDERFLOW, TOO_MANY_STEPS = int(Status.STEP_UNDERFLOW), int(Status.TOO_MANY_STEPS)


@compiled(**LEAN)
def interpolate(batch, pack, pair, lane, theta):
    """x_lane = the state of a lane at theta of its step, from its states and slopes."""
    P, weights = floats(pair.P, pair.degree * MOST_STAGES), floats(pack.weights, MOST_STAGES)
    for i in range(pair.all_stages):
        weights[i] = 0.0
        for j in range(pair.degree - 1, -1, -1):
            weights[i] = (weights[i] + P[j * MOST_STAGES + i]) * theta
    n, h = batch.n, control_rows(pack)[H * LANES + lane]
    now, slopes, x = floats(pack.now, n * LANES), floats(pack.slopes, 1), floats(pack.x_lane, n)
    for m in range(n):
        total = 0.0
        for i in range(pair.all_stages):
            total += weights[i] * slopes[(i * n + m) * LANES + lane]
        x[m] = now[m * LANES + lane] + h * total


@compiled(**LEAN)
def evaluate_stage(batch, pack, pair, i, look, where):
    """Slope i of all lanes, at the states in the rows at an address; inputs are looked up where the time is new."""
    c = floats(pair.c, MOST_STAGES)
    if look or c[i] != c[i - 1]:
        set_times(doubles(pack.control), c[i], min(max(c[i], INSIDE), 1.0 - INSIDE))
        look_up(batch, pack)
    call_lanes(batch.rhs, pack.control + ROW * AT, where, pack.u, pack.c, pack.slopes + ROW * batch.n * i)


@compiled(**LEAN)
def sampled_within(pack):
    """How many lanes have a sample strictly within the step they just made."""
    rows, found = control_rows(pack), 0
    for lane in range(LANES):
        found += rows[GOOD * LANES + lane] > 0.0 and rows[SAMPLE * LANES + lane] < rows[TARGET * LANES + lane]
    return found


@compiled(**LEAN)
def write_samples(batch, pack, pair, lane):
    """Write the samples of a lane within its step by dense output, and the one at its end."""
    rows, sample, n = control_rows(pack), integers(pack.sample, LANES), batch.n
    t, end, h = rows[T * LANES + lane], rows[TARGET * LANES + lane], rows[H * LANES + lane]
    if rows[SAMPLE * LANES + lane] < end:
        integers(pack.evaluations, LANES)[lane] += pair.all_stages - pair.next_slope - 1
    while rows[SAMPLE * LANES + lane] <= end:
        at, j = rows[SAMPLE * LANES + lane], sample[lane]
        if at < end:
            interpolate(batch, pack, pair, lane, (at - t) / h)
        else:
            x, new = floats(pack.x_lane, n), floats(pack.new, n * LANES)
            for m in range(n):
                x[m] = new[m * LANES + lane]
        write_sample(batch, pack, lane, j, at)
        sample[lane] = j + 1
        run = integers(pack.run, LANES)[lane]
        rows[SAMPLE * LANES + lane] = sample_time(batch, run, j + 1) if j + 1 < batch.n_samples else np.inf


@compiled(**LEAN)
def fail(batch, control, pack, pair, lane):
    """A lane needs a step too small, or diverged: the state with the largest scaled error is named."""
    rows, run, n = control_rows(pack), integers(pack.run, LANES)[lane], batch.n
    E, slopes = floats(pair.E, MOST_STAGES), floats(pack.slopes, 1)
    new, found, largest = floats(pack.new, n * LANES), 0, -1.0
    for m in range(n):
        total = 0.0
        for i in range(pair.stages):
            if E[i] != 0.0:
                total += E[i] * slopes[(i * n + m) * LANES + lane]
        size = scaled(batch, control, pack, lane, m, rows[H * LANES + lane] * total)
        size = size if abs(new[m * LANES + lane]) <= batch.limit else np.inf
        if size > largest:
            found, largest = m, size
    floats(batch.failed_at, batch.runs)[run] = rows[T * LANES + lane]
    integers(batch.failed_state, batch.runs)[run] = found
    finish(batch, pack, pair, lane, STEP_UNDERFLOW if rows[ERROR * LANES + lane] < np.inf else NON_FINITE)


@compiled(**LEAN)
def end_lanes(batch, control, pack, pair, longest_step, stuck):
    """After the step: runs that came to their end or got stuck are left, their lanes refilled; others pass a stop."""
    rows, run = control_rows(pack), integers(pack.run, LANES)
    for lane in range(LANES):
        if run[lane] < 0:
            continue
        good = rows[GOOD * LANES + lane] > 0.0
        landed = good and rows[LANDS * LANES + lane] > 0.0
        t1 = floats(batch.t1, batch.runs)[run[lane]]
        if stuck >> lane & 1:
            fail(batch, control, pack, pair, lane)
        elif landed and rows[STOP * LANES + lane] == t1:
            finish(batch, pack, pair, lane, FINISHED)
        elif good and batch.max_steps > 0 and rows[STEPS * LANES + lane] >= batch.max_steps:
            finish(batch, pack, pair, lane, TOO_MANY_STEPS)
        elif landed:
            plan(batch, pack, lane)
            rows[FRESH * LANES + lane] = pack.fresh = 1
            continue
        else:
            continue
        if begin(batch, pack, longest_step, lane):
            pack.fresh = 1


@compiled(**LEAN)
def stuck_lanes(pack):
    """The lanes whose step cannot be made smaller, as bits."""
    rows, found = control_rows(pack), 0
    for lane in range(LANES):
        found |= (rows[GOOD * LANES + lane] < 0.0) << lane
    return found


_ARGUMENTS = tuple(typeof(record(fields)) for fields in (BATCH, PACK, PAIR, CONTROL))


@cache
def advance(method: str, all_stages: int, next_slope: int) -> Any:
    """The compiled loop of a method: batch, pack, pair, control, longest step as a part of the span, most steps."""

    def loop(batch, pack, pair, control, longest_step, most_steps):
        rows, n, h = doubles(pack.control), batch.n, pack.control + ROW * H
        for _ in range(most_steps):
            if pack.fresh != 0:
                restart(batch, control, pack, pair, longest_step)
                if all_idle(pack):
                    return FINISHED
            propose_steps(rows, control.stretch)
            for i in range(1, next_slope + 1):
                target = pack.stage if i < next_slope else pack.new
                combine(method, i, n, h, pack.now, pack.slopes, target)
                evaluate_stage(batch, pack, pair, i, i == 1, target)
            estimate_errors(
                method, n, h, pack.now, pack.new, pack.slopes, batch.atol, batch.rtol, batch.limit,
                pack.control + ROW * ERROR,
            )  # fmt: skip
            closely = judge_steps(
                rows, control.kind, pair.estimates, float(n), control.order, control.beta, control.safety,
                control.least, control.most,
            )  # fmt: skip
            stuck = 0
            if closely > 0:
                if all_stages > next_slope + 1 and sampled_within(pack) > 0:
                    for i in range(next_slope + 1, all_stages):
                        combine(method, i, n, h, pack.now, pack.slopes, pack.stage)
                        evaluate_stage(batch, pack, pair, i, i == next_slope + 1, pack.stage)
                for lane in range(LANES):
                    if control_rows(pack)[GOOD * LANES + lane] > 0.0:
                        write_samples(batch, pack, pair, lane)
                stuck = stuck_lanes(pack)
            end_steps(rows)
            choose(n, pack.control + ROW * GOOD, pack.now, pack.new)
            choose(n, pack.control + ROW * GOOD, pack.slopes, pack.slopes + ROW * n * next_slope)
            if closely > 0 or batch.max_steps > 0:
                end_lanes(batch, control, pack, pair, longest_step, stuck)
                if all_idle(pack):
                    return FINISHED
        return RUNNING

    return compiled(types.int64(*_ARGUMENTS, types.float64, types.int64), error_model="numpy", _nrt=False, nogil=True)(
        loop
    )


def start(batch, pack, longest_step):
    """Give all lanes of a new pack their first runs; returns whether there is any."""
    for lane in range(LANES):
        begin(batch, pack, longest_step, lane)
    pack.fresh = 1
    return not all_idle(pack)


@cache
def compiled_start() -> Any:
    """`start`, compiled."""
    return compiled(types.boolean(*_ARGUMENTS[:2], types.float64), error_model="numpy", _nrt=False, nogil=True)(start)
