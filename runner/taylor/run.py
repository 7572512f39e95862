"""A run of Taylor's method around its compiled loop."""

from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from qddot.runner.frame.events import watch_for
from qddot.runner.frame.functions import give_functions
from qddot.runner.frame.log import LOG, log_for
from qddot.runner.frame.output_times import wanted_times
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.search import WATCH
from qddot.runner.frame.stops import stops_to_end
from qddot.runner.frame.workplace import Marching, counting, restorer, run_in_place, taking
from qddot.runner.machine.by_places import Loop, by_places
from qddot.runner.machine.memory import place, record
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory
from qddot.runner.taylor.loop import run_slice
from qddot.runner.taylor.space import COURSE, DENSE_OUTPUT, SPACE, space_for
from qddot.runner.taylor.step import decay_for, order_for

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: Terms of coefficients in a slice, some milliseconds of work; those of a coefficient that is no sum over lower orders.
SLICE_WORK, TERMS = 1_000_000, 4
#: Points saved in a step where no output times are given: a step is some tenth of an oscillation.
REFINE = 4
COUNTS = ("steps", "evaluations")
#: Of the polynomial that stands for a step: singularities are e^1.3 steps away or more, and it converges as 12^-degree.
DEGREE = 12


@cache
def _compiled_loop() -> Loop:
    return by_places(run_slice, SPACE, COURSE, LOG, WATCH)


def integrate(problem: Problem, method: "Method", options: Options, recorder: Recorder | None = None) -> Trajectory:
    """Integrate a model by the Taylor series of its solution; reads the options of adaptive methods, see `Options`.

    The order follows from the least relative tolerance; the dense output is the series. Saves options.refine points a
    step, or at options.output_times. Events end up in extras["events"], an `EventLog`.
    Raises ValueError where the right-hand side has no recurrences, and for events or times that make no sense.
    """
    return run_in_place(_workplace, problem, method, options, recorder)


def _workplace(problem: Problem, method: "Method", options: Options, recorder: Recorder | None) -> Marching:
    code = problem.recurrences
    if code is None:
        raise ValueError(
            f"method {method.name} takes the recurrences of a generated model, and this is a function; choose another, "
            "such as dop853"
        )
    rtol, atol = options.tolerances(len(problem.initial_state))
    order = order_for(options.least_rtol, code.sums, held=problem.held is not None)
    space, arrays = space_for(problem, code, order, rtol, atol)
    watch, watch_arrays = watch_for(options.events, int(space["n"]), order)
    times = None if recorder is not None else options.output_times
    wanted = wanted_times(times, problem.t0, problem.t1)
    refine = 0 if times is not None else options.refine or REFINE
    course, loop = _course(problem, options, order), _compiled_loop()
    space["course"] = place(course)
    give_functions(space, DENSE_OUTPUT, events=bool(options.events), conditions=False)
    if recorder is not None:
        refine, course["max_steps"] = min(order, DEGREE), recorder.steps
    stops = stops_to_end(problem.inputs.breakpoints, problem.t0, problem.t1)
    log = log_for(problem, stops, wanted, refine=refine, events=int(watch["most"]), recorder=recorder)
    most_steps = max(16, SLICE_WORK // (order * (order if code.sums else TERMS) * int(space["n"])))
    go_on = partial(loop.of(space, course, log.record, watch), most_steps)
    memory, places = arrays["memory"], code.memory
    return Marching(
        options,
        course,
        log,
        memory[places.states : places.states + int(space["n"])],
        log.roomy(go_on, int(watch["most"])),
        counting(course, *COUNTS),
        restorer(course, log.record, watch, arrays["reader"], memory[places.sides :][: len(code.table.sides)]),
        taking(problem, partial(np.copyto, arrays["constants"]), partial(code.fill_factors, memory)),
        (space, arrays, watch_arrays),
    )


def _course(problem: Problem, options: Options, order: int) -> np.void:
    return record(
        COURSE,
        max_steps=options.max_steps or 0,
        failed_state=-1,
        restart=1,
        now=problem.t0,
        max_step=options.max_step or np.inf,
        first_step=options.first_step or 0.0,
        longest_first=problem.longest_first_step,
        rtol=options.least_rtol,
        decay=decay_for(options.least_rtol, order),
        limit=options.divergence_limit,
    )
