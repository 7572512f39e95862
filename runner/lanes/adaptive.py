"""Adaptive steps in lanes: every lane has its own time, step, controller, breakpoints, samples and end.

All lanes try a step at once, each of its own size; those whose step is good go on, the others try again. What a lane
does is what `explicit.adaptive_loop` does with its run alone.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types

from qddot.runner.explicit.workspace import MOST_STAGES
from qddot.runner.frame.step_control import Factors
from qddot.runner.lanes.attempts import begin
from qddot.runner.lanes.inputs import look_up_stage
from qddot.runner.lanes.judge import CONTROL_TYPE, end_steps, judge_steps, propose_steps, size_errors
from qddot.runner.lanes.lane import control_of
from qddot.runner.lanes.pack import AT, BATCH_TYPE, ERROR, GOOD, LANES, PACK_TYPE, H
from qddot.runner.lanes.restart import call_restart
from qddot.runner.lanes.runs import all_idle
from qddot.runner.lanes.samples import PAIR_TYPE, sample_within
from qddot.runner.lanes.settle import call_settle
from qddot.runner.lanes.values import ROW
from qddot.runner.lanes.vectors import choose, combine, estimate_errors
from qddot.runner.machine.calls import call_lanes, doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats
from qddot.runner.problem import Status

RUNNING, FINISHED = int(Status.RUNNING), int(Status.FINISHED)


@compiled(**LEAN)
def evaluate_stage(batch, pack, pair, i, end, where):
    """Slope i of all lanes, at the states in the rows at an address, and the inputs of the next stage before `end`.

    Inputs do not wait for the slope, as that stage does; they are looked up where its time is new.
    """
    c = floats(pair.c, MOST_STAGES)
    call_lanes(batch.rhs, pack.control + ROW * AT, where, pack.u, pack.c, pack.slopes + ROW * batch.n * i)
    if i + 1 < end and c[i + 1] != c[i]:
        look_up_stage(batch, pack, c[i + 1])


@compiled(**LEAN)
def sampled_within(pack):
    """How many lanes have a sample strictly within the step they just made."""
    found = 0
    for lane in range(LANES):
        its = control_of(pack, lane)
        found += its.good > 0.0 and its.sample < its.target
    return found


@compiled(**LEAN)
def stuck_lanes(pack):
    """The lanes whose step cannot be made smaller, as bits."""
    found = 0
    for lane in range(LANES):
        found |= (control_of(pack, lane).good < 0.0) << lane
    return found


_ARGUMENTS = (BATCH_TYPE, PACK_TYPE, PAIR_TYPE, CONTROL_TYPE)


@compiled(**LEAN)
def accept(batch, pack, last):
    """Where a step is good, its end is the present: time, states, and as the first slope the one numbered `last`."""
    end_steps(doubles(pack.control))
    choose(batch.n, pack.control + ROW * GOOD, pack.now, pack.new)
    choose(batch.n, pack.control + ROW * GOOD, pack.slopes, pack.slopes + ROW * batch.n * last)


@cache
def compiled_loop(method: str, all_stages: int, next_slope: int) -> Any:
    """The compiled loop of a method: batch, pack, pair, control, longest step as a part of the span, most steps."""
    last, first_dense, stages = np.int64(next_slope), np.int64(next_slope + 1), np.int64(all_stages)

    def loop(batch, pack, pair, control, longest_step, most_steps):
        rows, n, h, c = doubles(pack.control), batch.n, pack.control + ROW * H, floats(pair.c, MOST_STAGES)
        factors = Factors(control.kind, control.order, control.beta, control.safety, control.least, control.most)
        for _ in range(most_steps):
            if pack.fresh != 0:
                call_restart(batch.restart, batch, control, pack, pair, longest_step)
                if all_idle(pack):
                    return FINISHED
            propose_steps(rows, control.stretch)
            look_up_stage(batch, pack, c[1])
            for i in range(1, last + 1):
                target = pack.stage if i < last else pack.new
                combine(method, i, n, h, pack.now, pack.slopes, target)
                evaluate_stage(batch, pack, pair, i, last + 1, target)
            sizes = pack.control + ROW * ERROR
            estimate_errors(method, n, h, pack.now, pack.new, pack.slopes, batch.atol, batch.rtol, batch.limit, sizes)
            size_errors(rows, control.kind, pair.estimates, float(n))
            closely = judge_steps(rows, factors)
            stuck = 0
            if closely > 0:
                if stages > first_dense and sampled_within(pack) > 0:
                    look_up_stage(batch, pack, c[first_dense])
                    for i in range(first_dense, stages):
                        combine(method, i, n, h, pack.now, pack.slopes, pack.stage)
                        evaluate_stage(batch, pack, pair, i, stages, pack.stage)
                sample_within(batch.sample, batch, pack, pair)
                stuck = stuck_lanes(pack)
            accept(batch, pack, last)
            if closely > 0 or batch.max_steps > 0:
                call_settle(batch.settle, batch, control, pack, pair, longest_step, stuck)
                if all_idle(pack):
                    return FINISHED
        return RUNNING

    return compiled(types.int64(*_ARGUMENTS, types.float64, types.int64), _nrt=False, nogil=True)(loop)


def start(batch, pack, longest_step):
    """Give all lanes of a new pack their first runs; returns whether there is any."""
    for lane in range(LANES):
        begin(batch, pack, longest_step, lane)
    pack.fresh = 1
    return not all_idle(pack)


@cache
def compiled_start() -> Any:
    """`start`, compiled."""
    return compiled(types.boolean(*_ARGUMENTS[:2], types.float64), _nrt=False, nogil=True)(start)
