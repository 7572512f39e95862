"""Constant steps in lanes: every lane has its own grid, breakpoints, samples and end, and lands on them.

The plan of a step is made for all lanes at once; lanes whose step ends at a breakpoint, a sample or the end of the run
are looked at one by one. What a lane does is what `explicit.march` does with its run alone.

Methods of constant step start each stage along the last slope alone, so the right-hand side writes the next stage while
its slopes are in registers: what is loaded and stored is what a step costs. That of a large model does not, it would
take twice as long to compile.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types

from qddot.runner import abi
from qddot.runner.lanes.inputs import look_up_stage
from qddot.runner.lanes.landing import begin, call_land, plan_all_closely, set_out
from qddot.runner.lanes.lane import lane_of
from qddot.runner.lanes.pack import AT, BATCH_TYPE, LANES, PACK_TYPE, SIZE, H
from qddot.runner.lanes.runs import all_idle
from qddot.runner.lanes.values import ROW
from qddot.runner.lanes.vectors import conclude, go_along
from qddot.runner.machine.calls import call_advance, call_lanes, doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.lane_loop import lane_loop
from qddot.runner.machine.memory import floats
from qddot.runner.problem import Status

RUNNING, FINISHED = int(Status.RUNNING), int(Status.FINISHED)


@lane_loop(types.int64(abi.POINTER))
def plan_steps(rows):
    """Let every lane step to its next grid point; returns how many want a closer look."""
    found = 0
    for lane in range(LANES):
        its = lane_of(rows, lane)
        target = its.start + (its.k + 1.0) * its.step
        its.target = target
        its.h = target - its.t
        found += target >= its.attention
    return found


@lane_loop(types.int64(abi.POINTER, types.float64))
def end_steps(rows, limit):
    """Make the ends of the steps the present; returns how many lanes may have left the bounds."""
    found = 0
    for lane in range(LANES):
        its = lane_of(rows, lane)
        its.t = its.target
        its.k += 1.0
        found += not its.size <= limit
    return found


@cache
def compiled_loop(method: str, stages: int, form: str) -> Any:
    """The compiled loop of a method for a batch, a pack, the addresses of c and of `along`, and a number of steps.

    form: of the right-hand side, see `abi`. along: the weight of each slope in the next stage, of the last in the step.
    """
    count = np.int64(stages)  # see `landing`: a literal int would compile what it is handed to anew
    by_itself = form == "advance"
    counted = stages - by_itself  # slopes that the end of a step does not hold yet

    def loop(batch, pack, c_address, along_address, most_steps):
        rows, c, along = doubles(pack.control), floats(c_address, count), floats(along_address, count)
        at, h, limit = pack.control + ROW * AT, pack.control + ROW * H, min(batch.limit * batch.limit, 1e300)
        for _ in range(most_steps):
            closely = plan_steps(rows)
            if closely > 0:
                plan_all_closely(batch, pack)
            if pack.fresh != 0:
                look_up_stage(batch, pack, c[0])
            where = pack.now
            for stage in range(count):
                slopes, weight = pack.slopes + ROW * batch.n * stage, along[stage]
                target = pack.new if (count - stage) % 2 == 1 else pack.stage  # never where it stands, and last `new`
                if by_itself:
                    call_advance(batch.rhs, at, where, pack.u, pack.c, slopes, pack.now, target, h, weight)
                else:
                    call_lanes(batch.rhs, at, where, pack.u, pack.c, slopes)
                    if stage + 1 < count:
                        go_along(batch.n, h, weight, pack.now, slopes, target)
                if stage + 1 < count and c[stage + 1] != c[stage]:
                    look_up_stage(batch, pack, c[stage + 1])
                where = target
            base = pack.new if by_itself else pack.now
            conclude(method, counted, batch.n, h, base, pack.slopes, pack.new, pack.control + ROW * SIZE)
            diverged = end_steps(rows, limit)
            pack.now, pack.new = pack.new, pack.now
            pack.taken += 1
            pack.fresh = c[count - 1] != 1.0
            if closely + diverged > 0:
                call_land(batch.settle, batch, pack, count, diverged)
                if all_idle(pack):
                    return FINISHED
        return RUNNING

    return compiled(types.int64(*_ARGUMENTS), _nrt=False, nogil=True)(loop)


_ARGUMENTS = (BATCH_TYPE, PACK_TYPE, types.int64, types.int64, types.int64)


def start(batch, pack):
    """Give all lanes of a new pack their first runs; returns whether there is any."""
    for lane in range(LANES):
        begin(batch, pack, lane)
    set_out(batch, pack)
    return not all_idle(pack)


@cache
def compiled_start() -> Any:
    """`start`, compiled."""
    return compiled(types.boolean(*_ARGUMENTS[:2]), _nrt=False, nogil=True)(start)
