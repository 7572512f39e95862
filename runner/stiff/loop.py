"""The compiled loop that all stiff methods share: segments, steps, and what the frame does at the end of a step.

A run is cut into segments at the breakpoints of the inputs, and where a condition of the model leaves the side on which
it is held. A method starts afresh in each one, because a jump in f, or in a low derivative of it, makes what it knew of
the past worthless.

A method is three functions, compiled with its loop: first_step(space, s, v) begins a segment; take_good_step(space, s,
v) takes an accepted step and returns a status; choose_next(s, v) sets the step to come. And one with an address, see
`DenseOutput`: it writes the polynomial of the step, unless the step was cut.
"""

import numpy as np

from qddot.runner.frame.hold import CHATTER, KEPT, NOTHING, SHORTER, keep_sides, may_release, release, take_sides
from qddot.runner.frame.log import has_room, next_stop
from qddot.runner.frame.search import NONE
from qddot.runner.frame.space import (
    prepare,
    project,
    project_at_end,
    project_at_switch,
    row_address,
    set_inputs,
    state_within,
)
from qddot.runner.frame.step_end import events_at_start, finish_step
from qddot.runner.inputs.instants import after
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, INLINE
from qddot.runner.problem import Status
from qddot.runner.stiff.space import DEGREE, POLYNOMIAL, WITHIN, X_NEW, F, X, scalars_at, space_at, vectors
from qddot.runner.stiff.system import all_finite, evaluate_f, evaluate_jacobian, evaluate_polynomial

RUNNING, FINISHED, TERMINATED = int(Status.RUNNING), int(Status.FINISHED), int(Status.TERMINATED)
NON_FINITE, TOO_MANY_STEPS = int(Status.NON_FINITE), int(Status.TOO_MANY_STEPS)
STEP_UNDERFLOW = int(Status.STEP_UNDERFLOW)
#: What the loop does next: have the algebraic states corrected, begin a segment, take a step.
CORRECT, START, STEP = range(3)


@compiled(**INLINE)
def take_steps(space, s, log, watch, sides, most_steps, first_step, take_good_step, choose_next):
    """Take at most `most_steps` steps of a method; returns a Status."""
    v = vectors(space)
    status = RUNNING
    for _ in range(most_steps):
        if s.phase == CORRECT or not has_room(log, watch.most):
            break
        if s.phase == START:
            status = begin_segment(space, s, v, log, watch, sides)
            if status != RUNNING:
                break
            first_step(space, s, v)
        status = take_good_step(space, s, v)
        if status == RUNNING:
            status = check_step(s, v)
        if status == NON_FINITE and sides.count > 0 and sides.free == 0 and may_release(sides, s.t):
            release(space, sides)
            s.phase, status = START, RUNNING
            continue
        if status != RUNNING:
            break
        fate = hold_sides(space, s, v, log, sides) if sides.count > 0 else KEPT
        if fate == NOTHING:
            continue
        if fate == CHATTER:
            status = STEP_UNDERFLOW
            break
        ended = finish_step(space, log, watch, s.t, s.length, s.t_new, row_address(space, X_NEW))
        if ended != NONE:
            cut_step(space, s, v, ended)
        choose_next(s, v)
        status = complete_step(s, v, log, ended)
        if status != RUNNING:
            break
    return status


@compiled(**BY_ADDRESS)
def within(where, theta):
    """The address of the state at part theta of the step, from its prepared polynomial."""
    space = space_at(where)
    s = scalars_at(space.scalars)
    if theta == 0.0:
        return row_address(space, X)
    evaluate_polynomial(vectors(space), theta)
    if space.project != 0:
        project_at_end(space, s.t, theta * s.length, row_address(space, WITHIN))
    return row_address(space, WITHIN)


@compiled(**INLINE)
def hold_sides(space, s, v, log, sides):
    """Cut a step where a condition leaves its side; returns what became of it, see `keep_sides`."""
    new = row_address(space, X_NEW)
    prepare(space)
    fate, part = keep_sides(space, log, sides, s.t, s.length, new)
    if fate == NOTHING:
        s.phase = START
        s.failed_attempts += 1
    elif fate == SHORTER:
        cut_step(space, s, v, part)
        if space.project != 0:
            project_at_switch(space, s.t, part * s.length, new)
        s.part, power = part, part
        for p in range(DEGREE):
            for i in range(v.shape[1]):
                v[POLYNOMIAL + p, i] *= power
            power *= part
        s.length = s.t_new - s.t
    return fate


@compiled(**INLINE)
def begin_segment(space, s, v, log, watch, sides):
    """Evaluate f, its Jacobian and the events at the start of a segment; returns a status."""
    s.segment_end = next_stop(log)
    s.reaches_end = False
    s.length, s.t_new, s.part = 0.0, s.t, 1.0
    set_inputs(space, s.t, after(s.t, s.segment_end - s.t))
    if space.project != 0:
        project(space, s.t, row_address(space, X))
    if sides.count > 0 and sides.free == 0:
        take_sides(space, sides, s.t, row_address(space, X))
    if events_at_start(space, log, watch, s.t, s.steps == 0):
        return TERMINATED
    evaluate_f(space, s, s.t, X, F)
    if sides.count > 0 and not all_finite(row_address(space, F), space.n):  # a hair beyond where the branch has values
        release(space, sides)
        evaluate_f(space, s, s.t, X, F)
    for i in range(v.shape[1]):
        if not np.isfinite(v[F, i]):
            s.failed_state = i
            return NON_FINITE
    evaluate_jacobian(space, s, v, s.t, 0.0)
    s.fresh_jacobian = True
    s.phase = STEP
    return RUNNING


@compiled(**INLINE)
def check_step(s, v):
    """Take note of a new step; returns NON_FINITE where a state is NaN or larger than the limit."""
    s.length = s.t_new - s.t
    for i in range(v.shape[1]):
        if not abs(v[X_NEW, i]) <= s.limit:
            s.failed_state = i
            return NON_FINITE
    return RUNNING


@compiled(**INLINE)
def cut_step(space, s, v, theta):
    """End the step at part theta of it."""
    state_within(space, theta)
    s.t_new = s.t + theta * s.length
    for i in range(v.shape[1]):
        v[X_NEW, i] = v[WITHIN, i]


@compiled(**INLINE)
def complete_step(s, v, log, ended):
    """Make the new point the present one; returns a status."""
    s.t = s.t_new
    for i in range(v.shape[1]):
        v[X, i] = v[X_NEW, i]
    s.steps += 1
    s.fresh_jacobian = False
    if ended != NONE:
        return TERMINATED
    if s.part < 1.0:
        s.phase = START
    elif s.reaches_end:
        log.stop += 1
        s.phase = CORRECT if s.algebraic else START
        if log.stop == log.n_stops:
            return FINISHED
    return TOO_MANY_STEPS if s.steps >= s.max_steps else RUNNING
