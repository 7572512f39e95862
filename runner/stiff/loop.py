"""The compiled loop that all stiff methods share: segments, steps, events, saved points.

A method is four functions: first_step(space, s, v) begins a segment; step(space, s, v) takes an accepted step and
returns a status; prepare_polynomial(s, v) writes the step's dense output; choose_next(s, v) sets the step to come.
"""

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE
from qddot.runner.stiff.events import finish_events, watch_step
from qddot.runner.stiff.run import (
    RUNNING,
    START,
    STEP,
    begin_segment,
    check_step,
    finish_step,
    must_return,
    save_step,
    wants_inner_points,
)
from qddot.runner.stiff.space import vectors


@compiled(**INLINE)
def take_steps(space, s, points, watch, most_steps, first_step, step, prepare_polynomial, choose_next):
    """Take at most `most_steps` steps of a method; returns a Status."""
    v = vectors(space)
    status = RUNNING
    for _ in range(most_steps):
        if must_return(s, points, watch):
            break
        if s.phase == START:
            status = begin_segment(space, s, v, points, watch)
            if status == RUNNING:
                first_step(space, s, v)
        if status == RUNNING and s.phase == STEP:
            status = step(space, s, v)
            if status == RUNNING:
                status = check_step(s, v)
            if status == RUNNING:
                happened = watch_step(space, s, watch)
                if happened > 0 or wants_inner_points(s, points):
                    prepare_polynomial(s, v)
                finish_events(space, s, v, points, watch, happened)
        if status != RUNNING or not save_step(s, v, points):
            break
        choose_next(s, v)
        status = finish_step(s, v, points)
        if status != RUNNING:
            break
    return status
