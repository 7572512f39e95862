"""The compiled loop of constant steps that follows each, for events or pieces, on the cubic through its ends."""

from qddot.runner.explicit.march import (
    MARCH,
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
from qddot.runner.explicit.step import PAIR
from qddot.runner.explicit.workspace import K0, NEW, WITHIN, Y, copy, space_at
from qddot.runner.frame.functions import DenseOutput
from qddot.runner.frame.hermite import cubic
from qddot.runner.frame.hold import CHATTER, KEPT, SHORTER, keep_sides, release, take_sides
from qddot.runner.frame.log import has_room, next_stop
from qddot.runner.frame.search import NONE
from qddot.runner.frame.space import look_up, project_at_end, project_at_switch, row_address, state_within, states
from qddot.runner.frame.step_end import events_at_start, finish_step
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, record_at
from qddot.runner.problem import Status

TERMINATED = int(Status.TERMINATED)
_tableau_at, _march_at = record_at(PAIR), record_at(MARCH)


def run_slice_closely(space, tableau, march, log, watch, sides, most_steps):
    """March at most `most_steps` steps, up to a terminal event; returns a Status."""
    status = RUNNING
    for _ in range(most_steps):
        if not has_room(log, watch.most):
            return status
        if march.restart and begin(space, march, log, watch, sides):
            return TERMINATED
        march.target = next_target(march, log)
        part = try_step(space, tableau, march, log, sides)
        if part > 0.0:
            status = finish(space, tableau, march, log, watch, part < 1.0)
            if status != RUNNING:
                return status
    return status


@compiled(**LEAN)
def begin(space, march, log, watch, sides):
    """Inputs, sides and events where the right-hand side may jump; whether a terminal event is there."""
    settle(space, march.now, min(next_stop(log), march.t1) - march.now)
    if sides.count > 0 and sides.free == 0:
        take_sides(space, sides, march.now, row_address(space, Y))
    return events_at_start(space, log, watch, march.now, march.steps == 0)


@compiled(**LEAN)
def try_step(space, tableau, march, log, sides):
    """March to the target, or to where a condition leaves its side; returns the part of the step that is left."""
    march_to(space, tableau, march, log, march.target)
    march.steps += 1
    if sides.count == 0:
        return 1.0
    if sides.free == 0 and diverged(space, march.limit):
        release(space, sides)
        march.steps, march.known = march.steps - 1, 0
        return 0.0
    return hold_sides(space, tableau, march, log, sides)


@compiled(**LEAN)
def finish(space, tableau, march, log, watch, at_switch):
    """Follow the step for events and pieces, and make its end the present state; returns a status."""
    t, target, ended = march.now, march.target, NONE
    if diverged(space, march.limit):
        march.failed_at, march.failed_state = target, first_to_leave(space, tableau.stages)
        return NON_FINITE
    if watch.count > 0 or log.starts:
        ended = finish_step(space, log, watch, t, target - t, target, row_address(space, NEW))
    if march.known:  # as the last stage left them
        look_up(space, t, target - t, 1.0)
    if ended != NONE:
        state_within(space, ended)
        copy(space, WITHIN, Y)
        march.now = t + ended * (target - t)
        return TERMINATED
    accept(space)
    if at_switch:
        march.now, march.restart = target, 1
        return RUNNING
    return land(space, march, log, target)


@compiled(**LEAN)
def hold_sides(space, tableau, march, log, sides):
    """Take a step that a condition leaves its side in again, as far as there; returns the part of it that is left."""
    t, h, new = march.now, march.target - march.now, row_address(space, NEW)
    evaluate_end_slope(space, tableau, march)
    fate, part = keep_sides(space, log, sides, t, h, new)
    if fate == KEPT:
        return 1.0
    march.end_slopes += tableau.stages
    march.known = 0
    if fate == CHATTER:
        release(space, sides)
    if fate != SHORTER:
        march.steps -= 1
        march.restart = 1
        return 0.0
    march.target = t + part * h
    march_to(space, tableau, march, log, march.target)
    if space.project != 0:
        project_at_switch(space, t, part * h, new)
    march.restart = 1
    return part


@compiled(**LEAN)
def evaluate_end_slope(space, tableau, march):
    """The slope at the end of the step, for its cubic."""
    look_up(space, march.now, march.target - march.now, 1.0)
    slope(space, march.target, NEW, K0 + tableau.stages)
    march.end_slopes += 1


@compiled(**BY_ADDRESS)
def prepare(where):
    """`evaluate_end_slope`."""
    space = space_at(where)
    evaluate_end_slope(space, _tableau_at(space.pair), _march_at(space.course))


@compiled(**BY_ADDRESS)
def within(where, theta):
    """The address of the state at part theta of the step: the cubic through states and slopes at its ends."""
    space = space_at(where)
    tableau, march = _tableau_at(space.pair), _march_at(space.course)
    if theta == 0.0:
        return row_address(space, Y)
    start, end, between = states(space, Y), states(space, NEW), states(space, WITHIN)
    slope_start, slope_end = states(space, K0), states(space, K0 + tableau.stages)
    cubic(theta, march.target - march.now, start, slope_start, end, slope_end, between)
    if space.project != 0:
        project_at_end(space, march.now, theta * (march.target - march.now), row_address(space, WITHIN))
    return row_address(space, WITHIN)


DENSE_OUTPUT = DenseOutput(prepare, within, within)
