"""An exact run that is followed closely, for events or pieces: by Taylor series, in steps that a polynomial follows.

Within a step the states are those of the same series from its start: dense output has no error but rounding.
"""

import math
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from qddot.runner.exact.forcing import force, look_up
from qddot.runner.exact.propagate import leaving
from qddot.runner.exact.space import SPACE
from qddot.runner.exact.taylor import largest_rate, taylor_step
from qddot.runner.frame.events import watch_for
from qddot.runner.frame.functions import DenseOutput, give_functions
from qddot.runner.frame.log import LOG, has_room, log_for
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.search import NONE, WATCH
from qddot.runner.frame.slices import run_slices
from qddot.runner.frame.space import make_space, row_address, set_inputs, space_layout, state_within, states
from qddot.runner.frame.step_end import events_at_start, finish_step
from qddot.runner.inputs.instants import after
from qddot.runner.machine.by_places import Loop, by_places
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.compiling import working_time
from qddot.runner.machine.memory import BLOCK, BY_ADDRESS, LEAN, floats, layout, place, record, record_at
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Statistics, Status, Trajectory

RUNNING, FINISHED, TERMINATED = int(Status.RUNNING), int(Status.FINISHED), int(Status.TERMINATED)
NON_FINITE = int(Status.NON_FINITE)
#: The longest step, times the fastest rate of the states or their inputs; over such a step the polynomial of DEGREE
#: through Chebyshev's points is 2 (1/4)^(DEGREE + 1)/(DEGREE + 1)! = 1e-14 of a sine off.
LONGEST, DEGREE = 1.0, 10
#: Steps of a slice times states: some milliseconds.
SLICE_WORK = 10_000

#: Rows of states: at the start of the step, at its end, within it.
STATE, NEW, WITHIN = np.arange(3)
#: Fields beside those of every space: the balanced state at the start of the step, and room for one within; the records
#: of the propagation and of the course.
EVENT_SPACE = space_layout("before between propagation course")
#: What a run has reached, beside SPACE: the step goes from `start` over `length`.
COURSE = layout("", "start length")
_space_at, _propagation_at, _course_at = map(record_at, (EVENT_SPACE, SPACE, COURSE))


@compiled(**LEAN)
def write_state(s, space, x, row):
    """Write the states that stand balanced at an address into a row."""
    target, balanced, scale = states(space, row), floats(x, s.n), floats(s.scale, s.n)
    for i in range(s.n):
        target[i] = scale[i] * balanced[i]


@compiled(**LEAN)
def copy_balanced(s, source, target):
    """Copy a balanced state from one address to another."""
    x, y = floats(source, BLOCK * s.panels), floats(target, BLOCK * s.panels)
    for i in range(BLOCK * s.panels):
        y[i] = x[i]


@compiled(**BY_ADDRESS)
def within(where, theta):
    """The address of the state at part theta of the step."""
    space = _space_at(where)
    s, course = _propagation_at(space.propagation), _course_at(space.course)
    if theta == 0.0:
        return row_address(space, STATE)
    end, s.x = s.x, space.between
    copy_balanced(s, space.before, s.x)
    taylor_step(s, theta * course.length)
    write_state(s, space, s.x, WITHIN)
    s.x = end
    return row_address(space, WITHIN)


@compiled(**BY_ADDRESS)
def ready(where):
    """Dense output needs nothing beyond the step."""


DENSE_OUTPUT = DenseOutput(ready, within, within)


@compiled(**LEAN)
def take_step(s, space, course):
    """Move x by a step, and s.t with it."""
    force(s)
    copy_balanced(s, s.x, space.before)
    parts = max(1, math.ceil((s.segment_end - s.t) * largest_rate(s) / LONGEST))
    stop = s.segment_end if parts == 1 else s.t + (s.segment_end - s.t) / parts
    course.start, course.length, s.t = s.t, stop - s.t, stop
    taylor_step(s, course.length)
    write_state(s, space, s.x, NEW)
    s.steps += 1


def run_slice(s, space, course, log, watch, most_steps):
    """Take at most `most_steps` steps; returns a Status. STATE is at course.start + course.length after each."""
    state = states(space, STATE)
    for _ in range(most_steps):
        if not has_room(log, watch.most):
            return RUNNING
        if s.t >= s.segment_end:
            look_up(s)
            set_inputs(space, s.t, after(s.t, s.segment_end - s.t))
            if events_at_start(space, log, watch, s.t, s.steps == 0):
                return TERMINATED
        take_step(s, space, course)
        s.failed_state = leaving(s)
        if s.failed_state >= 0:
            course.length = 0.0
            return NON_FINITE
        ended = finish_step(space, log, watch, course.start, course.length, s.t, row_address(space, NEW))
        if ended != NONE:
            state_within(space, ended)
            course.length *= ended
        reached = states(space, NEW if ended == NONE else WITHIN)
        for i in range(s.n):
            state[i] = reached[i]
        if ended != NONE:
            return TERMINATED
        if s.t >= s.t1:
            return FINISHED
    return RUNNING


@cache
def _compiled_loop() -> Loop:
    return by_places(run_slice, SPACE, EVENT_SPACE, COURSE, LOG, WATCH)


def integrate_closely(
    problem: Problem, options: Options, s: np.void, wanted: NDArray[np.float64], recorder: Recorder | None
) -> Trajectory:
    """The run whose propagation s stands at its start, saved at the wanted times (n,) strictly within, or recorded."""
    start, n = working_time(), int(s["n"])
    watch, watch_arrays = watch_for(options.events, n, DEGREE)
    work = np.zeros((3, n))
    work[STATE] = problem.initial_state
    before, between = np.zeros((2, BLOCK * int(s["panels"])))
    own = {"work": work, "before": before, "between": between}
    space, space_arrays = make_space(EVENT_SPACE, problem, own, stride=8 * n)
    course = record(COURSE, start=problem.t0)
    space["propagation"], space["course"] = place(s), place(course)
    give_functions(space, DENSE_OUTPUT, events=bool(options.events), conditions=False)
    wanted, refine = (wanted, 0) if recorder is None else (np.empty(0), DEGREE)
    log = log_for(problem, np.empty(0), wanted, refine=refine, events=int(watch["most"]), recorder=recorder)
    loop = partial(_compiled_loop().of(s, space, course, log.record, watch), max(16, SLICE_WORK // n))

    def one_slice() -> int:
        return Status.FINISHED if recorder is not None and s["t"] >= recorder.until else loop()

    status = run_slices(
        log.roomy(one_slice, int(watch["most"])),
        fraction_done=lambda: float((s["t"] - problem.t0) / (problem.t1 - problem.t0)),
        progress=options.progress,
        time_limit=options.time_limit,
    )
    reached = float(course["start"] + course["length"]) if status is not Status.FINISHED else float(problem.t1)
    log.save(reached, work[STATE])
    del watch_arrays, space_arrays  # The loop knew them by address: they had to live until here.
    counts = Statistics(steps=int(s["steps"]), evaluations=int(s["products"]), wall_time=working_time() - start)
    return log.trajectory(status, counts, lambda: (s["t"], s["failed_state"]), options.events)
