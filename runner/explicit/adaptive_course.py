"""What a run of an adaptive explicit method has reached, and the dense output of its last step."""

from qddot.runner.explicit.step import PAIR, interpolate, prepare_dense
from qddot.runner.explicit.workspace import K0, NEW, WITHIN, Y, space_at
from qddot.runner.frame.functions import DenseOutput
from qddot.runner.frame.hermite import cubic
from qddot.runner.frame.space import project_at_end, row_address, states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, layout, record_at

#: Fields of the course of a run, besides the state itself. restart: the next step starts at a breakpoint. dense: the
#: last step's dense output is prepared. max_steps: 0 for no limit; first_step: 0 for the controller's; longest_first:
#: the longest after a stop. now: time of the state; size: of the next step; start, length: of the last.
COURSE = layout(
    "max_steps steps failed_attempts evaluations failed_state restart dense",
    "now size last_error start length max_step first_step longest_first",
)


_pair_at, _course_at = record_at(PAIR), record_at(COURSE)


@compiled(**BY_ADDRESS)
def ensure_dense(where):
    """The stages of dense output, once a step."""
    space = space_at(where)
    course = _course_at(space.course)
    if course.dense == 0:
        course.evaluations += prepare_dense(space, _pair_at(space.pair), course.start, course.length)
        course.dense = 1


@compiled(**BY_ADDRESS)
def within(where, theta):
    """The address of the state at part theta of the step, from its prepared dense output."""
    space = space_at(where)
    if theta == 0.0:
        return row_address(space, Y)
    course = _course_at(space.course)
    interpolate(space, _pair_at(space.pair), theta, course.length)
    if space.project != 0:
        project_at_end(space, course.start, theta * course.length, row_address(space, WITHIN))
    return row_address(space, WITHIN)


@compiled(**BY_ADDRESS)
def sketch(where, theta):
    """The address of about the state at part theta of the step: the cubic through its ends, which needs no stages."""
    space = space_at(where)
    cubic(
        theta,
        _course_at(space.course).length,
        states(space, Y),
        states(space, K0),
        states(space, NEW),
        states(space, K0 + _pair_at(space.pair).next_slope),
        states(space, WITHIN),
    )
    return row_address(space, WITHIN)


DENSE_OUTPUT = DenseOutput(ensure_dense, within, sketch)
