"""Where a Taylor run works: the memory of its series, rows of states beside it, and the course of the run."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.functions import DenseOutput
from qddot.runner.frame.space import make_space, project_at_end, row_address, space_layout
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, VIEW, floats, layout, on_cache_line, record_at
from qddot.runner.machine.series_calls import call_polynomial
from qddot.runner.machine.series_code import SeriesCode
from qddot.runner.problem import Problem

#: Rows of states: the end of the step, a state within it, and tolerances.
NEW, WITHIN, RTOL, ATOL = range(4)
_ROWS = 4

#: Fields beside those of every space. series, step, polynomial: functions; memory: theirs; where states, inputs,
#: conditions and what they compare are in it, and the strides from order to order, in bytes; n_sides conditions; the
#: order; and how many inputs have series there; course: the record of that.
SPACE = space_layout(
    "series step polynomial memory states_at state_stride inputs_at input_stride compared_at side_stride sides_at "
    "n_sides highest series_inputs course"
)
#: Fields of the course. restart: the next step starts where inputs may jump. turned: conditions that changed sides at
#: this very time. now: time of the state; start, length: of the last step. decay: see `step.decay_for`.
COURSE = layout(
    "max_steps steps evaluations failed_state restart turned",
    "now start length max_step first_step longest_first rtol decay limit",
)
_space_at, _course_at = record_at(SPACE), record_at(COURSE)


def space_for(
    problem: Problem, code: SeriesCode, order: int, rtol: NDArray[np.float64], atol: NDArray[np.float64]
) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """A space with the initial state and the tolerances (n,), and the arrays it points into."""
    places, n = code.memory, len(problem.initial_state)
    memory, work = on_cache_line(places.size), on_cache_line(_ROWS * places.state_stride)
    memory[:2] = problem.sense, problem.t0
    memory[places.states : places.states + n] = problem.initial_state
    code.fill_factors(memory, np.asarray(problem.constants, dtype=np.float64))
    rows = work.reshape(_ROWS, -1)
    rows[ATOL] = 1.0  # of what is no state, too
    rows[RTOL, :n], rows[ATOL, :n] = rtol, np.maximum(atol, 1e-300)
    space, arrays = make_space(
        SPACE,
        problem,
        {"work": work, "memory": memory},
        series=code.series,
        step=code.step,
        polynomial=code.polynomial,
        stride=8 * places.state_stride,
        n_sides=len(code.table.sides),
        highest=order,
        series_inputs=min(problem.n_inputs, places.input_stride),
        state_stride=8 * places.state_stride,
        input_stride=8 * places.input_stride,
        side_stride=8 * places.side_stride,
    )
    for name, place in (
        *(("states_at", places.states), ("inputs_at", places.inputs)),
        *(("compared_at", places.compared), ("sides_at", places.sides)),
    ):
        space[name] = space["memory"] + 8 * place
    return space, arrays


@compiled(**VIEW)
def coefficient(space, k):
    """The coefficients of order k of all states, (n,)."""
    return floats(space.states_at + space.state_stride * k, space.n)


@compiled(**VIEW)
def time_and_sense(space):
    """The sense of time and the time that the series takes, (2,)."""
    return floats(space.memory, 2)


@compiled(**LEAN)
def sum_series(space, time, row):
    """Write the states at a time from the start of the step to a row."""
    call_polynomial(space.polynomial, space.memory, space.highest, time, row_address(space, row))


@compiled(**LEAN)
def advance(space, t, time, row):
    """The same, the step starting at t, and put on the constraints where there are any."""
    sum_series(space, time, row)
    if space.project != 0:
        project_at_end(space, t, time, row_address(space, row))


@compiled(**BY_ADDRESS)
def within(where, theta):
    """The address of the state at part theta of the step."""
    space = _space_at(where)
    if theta == 0.0:
        return space.states_at
    course = _course_at(space.course)
    advance(space, course.start, theta * course.length, WITHIN)
    return row_address(space, WITHIN)


@compiled(**BY_ADDRESS)
def nothing_to_prepare(where):
    """The dense output of a step is its series."""


DENSE_OUTPUT = DenseOutput(nothing_to_prepare, within, within)
