"""What becomes of lanes of adaptive methods after a step: runs that end, get stuck or pass a breakpoint."""

from typing import Any

import numpy as np
from numba import types

from qddot.runner.explicit.workspace import MOST_STAGES
from qddot.runner.lanes.attempts import begin, finish, scaled
from qddot.runner.lanes.pack import (
    BATCH_TYPE,
    ERROR,
    FRESH,
    GOOD,
    LANDS,
    LANES,
    PACK_TYPE,
    STEPS,
    STOP,
    H,
    T,
    control_rows,
)
from qddot.runner.lanes.restart import CONTROL_TYPE
from qddot.runner.lanes.samples import PAIR_TYPE
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers, intrinsic
from qddot.runner.machine.pointers import caller
from qddot.runner.problem import Status

#: As np.int64, because numba compiles a function again for every literal int that it is called with.
RUNNING, FINISHED = np.int64(Status.RUNNING), np.int64(Status.FINISHED)
NON_FINITE, STEP_UNDERFLOW = np.int64(Status.NON_FINITE), np.int64(Status.STEP_UNDERFLOW)
TOO_MANY_STEPS = np.int64(Status.TOO_MANY_STEPS)


@compiled(**LEAN)
def fail(batch, control, pack, pair, lane):
    """A lane needs a step too small, or diverged: names the state with the largest scaled error, returns the status."""
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
    return STEP_UNDERFLOW if rows[ERROR * LANES + lane] < np.inf else NON_FINITE


@compiled(**LEAN)
def status_of(batch, control, pack, pair, lane, stuck):
    """How the run of a lane stands after a step."""
    rows, run = control_rows(pack), integers(pack.run, LANES)[lane]
    good = rows[GOOD * LANES + lane] > 0.0
    at_stop = good and rows[LANDS * LANES + lane] > 0.0
    if stuck >> lane & 1:
        return fail(batch, control, pack, pair, lane)
    if at_stop and rows[STOP * LANES + lane] == floats(batch.t1, batch.runs)[run]:
        return FINISHED
    if good and batch.max_steps > 0 and rows[STEPS * LANES + lane] >= batch.max_steps:
        return TOO_MANY_STEPS
    if at_stop:
        rows[FRESH * LANES + lane] = pack.fresh = 1
    return RUNNING


@compiled(**LEAN)
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
