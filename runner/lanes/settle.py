"""What becomes of lanes of adaptive methods after a step: runs that end, get stuck or pass a breakpoint."""

from typing import Any

import numpy as np
from numba import types

from qddot.runner.explicit.workspace import MOST_STAGES
from qddot.runner.lanes.attempts import begin, finish, relative
from qddot.runner.lanes.judge import CONTROL_TYPE
from qddot.runner.lanes.lane import control_of
from qddot.runner.lanes.pack import BATCH_TYPE, LANES, PACK_TYPE
from qddot.runner.lanes.samples import PAIR_TYPE
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, floats, integers, intrinsic
from qddot.runner.machine.pointers import caller
from qddot.runner.problem import Status

#: As np.int64, because numba compiles a function again for every literal int that it is called with.
RUNNING, FINISHED = np.int64(Status.RUNNING), np.int64(Status.FINISHED)
NON_FINITE, STEP_UNDERFLOW = np.int64(Status.NON_FINITE), np.int64(Status.STEP_UNDERFLOW)
TOO_MANY_STEPS = np.int64(Status.TOO_MANY_STEPS)


@compiled(**LEAN)
def fail(batch, control, pack, pair, lane):
    """A lane needs a step too small, or diverged: names the state with the largest scaled error, returns the status."""
    its, run, n = control_of(pack, lane), integers(pack.run, LANES)[lane], batch.n
    E, slopes = floats(pair.E, MOST_STAGES), floats(pack.slopes, 1)
    new, found, largest = floats(pack.new, n * LANES), 0, -1.0
    for m in range(n):
        total = 0.0
        for i in range(pair.stages):
            if E[i] != 0.0:
                total += E[i] * slopes[(i * n + m) * LANES + lane]
        size = relative(batch, control, pack, lane, m, its.h * total)
        size = size if abs(new[m * LANES + lane]) <= batch.limit else np.inf
        if size > largest:
            found, largest = m, size
    floats(batch.failed_at, batch.runs)[run] = its.t
    integers(batch.failed_state, batch.runs)[run] = found
    return STEP_UNDERFLOW if its.error < np.inf else NON_FINITE


@compiled(**LEAN)
def status_of(batch, control, pack, pair, lane, stuck):
    """How the run of a lane stands after a step."""
    return fail(batch, control, pack, pair, lane) if stuck >> lane & 1 else status_unless_stuck(batch, pack, lane)


@compiled(**LEAN)
def status_unless_stuck(batch, pack, lane):
    """The same of a run that is not stuck; one that passes a stop is fresh then."""
    its, run = control_of(pack, lane), integers(pack.run, LANES)[lane]
    good = its.good > 0.0
    at_stop = good and its.lands > 0.0
    if at_stop and its.stop == floats(batch.t1, batch.runs)[run]:
        return FINISHED
    if good and batch.max_steps > 0 and its.steps >= batch.max_steps:
        return TOO_MANY_STEPS
    if at_stop:
        its.fresh = pack.fresh = 1
    return RUNNING


@compiled(**BY_ADDRESS)
def settle(batch, control, pack, pair, longest_step, stuck):
    """After the step: runs that came to their end or got stuck are left, their lanes refilled; others pass a stop."""
    for lane in range(LANES):
        if integers(pack.run, LANES)[lane] < 0:
            continue
        status = status_of(batch, control, pack, pair, lane, stuck)
        if status != RUNNING:
            finish(batch, pack, pair, lane, status)
            if begin(batch, pack, longest_step, lane):
                pack.fresh = 1


SETTLE = types.void(BATCH_TYPE, CONTROL_TYPE, PACK_TYPE, PAIR_TYPE, types.float64, types.int64)


@intrinsic
def call_settle(
    typing_context: Any, where: Any, batch: Any, control: Any, pack: Any, pair: Any, longest: Any, stuck: Any
) -> Any:
    """Call `settle` at an address, see `inputs.look_up`."""
    return caller(SETTLE)
