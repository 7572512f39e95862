"""The compiled loop of constant steps that follows each, for events or pieces, on the cubic through its ends."""

from qddot.runner.explicit.march import (
    NON_FINITE,
    RUNNING,
    accept,
    diverged,
    first_to_leave,
    land,
    march_to,
    next_target,
)
from qddot.runner.explicit.slopes import settle, slope
from qddot.runner.explicit.workspace import K0, NEW, WITHIN, Y, copy
from qddot.runner.frame.hermite import cubic
from qddot.runner.frame.log import has_room, next_stop, save
from qddot.runner.frame.search import NONE
from qddot.runner.frame.space import look_up, project_at_end, row_address, states
from qddot.runner.frame.step_end import events_at_start, follow_step, save_within
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.problem import Status

TERMINATED = int(Status.TERMINATED)


def run_slice_closely(space, tableau, march, log, watch, most_steps):
    """March at most `most_steps` steps, up to a terminal event; returns a Status."""
    status, step = RUNNING, (tableau, march)
    for _ in range(most_steps):
        if not has_room(log, watch.most):
            return status
        if march.restart:
            settle(space, march.now, min(next_stop(log), march.t1) - march.now)
            if events_at_start(space, step, log, watch, march.now, march.steps == 0, state_within):
                return TERMINATED
        t, target = march.now, next_target(march, log)
        march_to(space, tableau, march, log, target)
        march.steps += 1
        if diverged(space, march.limit):
            march.failed_at, march.failed_state = target, first_to_leave(space, tableau.stages)
            return NON_FINITE
        march.target = target
        ended, new = NONE, row_address(space, NEW)
        if watch.count > 0:
            ended = follow_step(space, step, log, watch, t, target - t, new, evaluate_end_slope, state_within)
        if log.starts:
            evaluate_end_slope(space, step)
            save_within(space, step, log, t, target - t, target, state_within)
            save(log, target, new)
        if march.known:  # as the last stage left them
            look_up(space, t, target - t, 1.0)
        if ended != NONE:
            state_within(space, step, ended)
            copy(space, WITHIN, Y)
            march.now = t + ended * (target - t)
            return TERMINATED
        accept(space)
        status = land(space, march, log, target)
        if status != RUNNING:
            return status
    return status


@compiled(**LEAN)
def evaluate_end_slope(space, step):
    """The slope at the end of the step, for its cubic; a step is the tableau and the march that tells of it."""
    tableau, march = step
    look_up(space, march.now, march.target - march.now, 1.0)
    slope(space, march.target, NEW, K0 + tableau.stages)
    march.end_slopes += 1


@compiled(**LEAN)
def state_within(space, step, theta):
    """The address of the state at part theta of the step: the cubic through states and slopes at its ends."""
    tableau, march = step
    if theta == 0.0:
        return row_address(space, Y)
    start, end, within = states(space, Y), states(space, NEW), states(space, WITHIN)
    slope_start, slope_end = states(space, K0), states(space, K0 + tableau.stages)
    cubic(theta, march.target - march.now, start, slope_start, end, slope_end, within)
    if space.project != 0:
        project_at_end(space, march.now, theta * (march.target - march.now), row_address(space, WITHIN))
    return row_address(space, WITHIN)
