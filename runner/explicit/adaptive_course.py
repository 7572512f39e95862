"""What a run of an adaptive explicit method has reached, and the dense output of its last step."""

from qddot.runner.explicit.step import interpolate, prepare_dense
from qddot.runner.explicit.workspace import K0, NEW, WITHIN, Y
from qddot.runner.frame.hermite import cubic
from qddot.runner.frame.space import project_at_end, row_address, states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, layout

#: Fields of the course of a run, besides the state itself. restart: the next step starts at a breakpoint. dense: the
#: last step's dense output is prepared. max_steps: 0 for no limit; first_step: 0 for the controller's; longest_first:
#: the longest after a stop. now: time of the state; size: of the next step; start, length: of the last.
COURSE = layout(
    "max_steps steps failed_attempts evaluations failed_state restart dense",
    "now size last_error start length max_step first_step longest_first",
)


@compiled(**LEAN)
def ensure_dense(space, step):
    """The stages of dense output, once a step; a step is the pair and the course that tells of it."""
    pair, course = step
    if course.dense == 0:
        course.evaluations += prepare_dense(space, pair, course.start, course.length)
        course.dense = 1


@compiled(**LEAN)
def state_within(space, step, theta):
    """The address of the state at part theta of the step, from its prepared dense output."""
    pair, course = step
    if theta == 0.0:
        return row_address(space, Y)
    interpolate(space, pair, theta, course.length)
    if space.project != 0:
        project_at_end(space, course.start, theta * course.length, row_address(space, WITHIN))
    return row_address(space, WITHIN)


@compiled(**LEAN)
def sketch_within(space, step, theta):
    """The address of about the state at part theta of the step: the cubic through its ends, which needs no stages."""
    pair, course = step
    cubic(
        theta,
        course.length,
        states(space, Y),
        states(space, K0),
        states(space, NEW),
        states(space, K0 + pair.next_slope),
        states(space, WITHIN),
    )
    return row_address(space, WITHIN)
