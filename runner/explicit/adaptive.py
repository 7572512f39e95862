"""Adaptive explicit Runge-Kutta methods: any embedded pair, any controller, any model, one compiled loop."""

from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from qddot.runner.explicit.adaptive_course import COURSE, DENSE_OUTPUT
from qddot.runner.explicit.adaptive_loop import run_slice
from qddot.runner.explicit.step import PAIR, pair_for
from qddot.runner.explicit.workspace import SPACE, space_for, state_of
from qddot.runner.frame.events import watch_for
from qddot.runner.frame.functions import give_functions
from qddot.runner.frame.hold import holding, kept
from qddot.runner.frame.log import LOG, log_for
from qddot.runner.frame.output_times import wanted_times
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.search import WATCH
from qddot.runner.frame.step_control import CONTROL, control_for
from qddot.runner.frame.stops import stops_to_end
from qddot.runner.frame.workplace import Marching, counting, restorer, run_in_place, taking
from qddot.runner.machine.by_places import Loop, by_places
from qddot.runner.machine.memory import BLOCK, place, record
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory
from qddot.runner.tableaux.embedded import EmbeddedPair

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: State components advanced per slice: some milliseconds of work for a generated model.
SLICE_WORK = 1_000_000
COUNTS = ("steps", "failed_attempts", "evaluations")


@cache
def _compiled_loop() -> Loop:
    return by_places(run_slice, SPACE, PAIR, CONTROL, COURSE, LOG, WATCH, WATCH)


def integrate(problem: Problem, method: "Method", options: Options, recorder: Recorder | None = None) -> Trajectory:
    """Integrate `problem` with method.pair; reads the options of adaptive methods, see `Options`.

    Saves options.refine points a step (the pair's own number by default), or at options.output_times by dense output,
    which changes no step. Events end up in extras["events"], an `EventLog`. recorder: takes the pieces of the run.
    Raises ValueError for a controller, an event or times that make no sense.
    """
    return run_in_place(_workplace, problem, method, options, recorder)


def _workplace(problem: Problem, method: "Method", options: Options, recorder: Recorder | None) -> Marching:
    pair = method.pair
    if pair is None:
        raise ValueError(f"method {method.name!r} has no embedded pair, so it cannot control its step")
    rtol, atol = options.tolerances(len(problem.initial_state))
    control = control_for(
        options.controller or pair.controller, pair.error_order, float(rtol.min()), options.divergence_limit
    )
    space, space_arrays = space_for(problem, rtol, atol)
    coefficients, _ = pair_for(pair)
    watch, watch_arrays = watch_for(options.events, int(space["n"]), int(coefficients["degree"]))
    sides, sides_arrays = holding(problem, space, space_arrays["u"], int(coefficients["degree"]))
    course, loop = _course(problem, options, pair), _compiled_loop()
    space["pair"], space["course"] = place(coefficients), place(course)
    give_functions(space, DENSE_OUTPUT, events=bool(options.events), conditions=problem.n_modes > 0)
    times = None if recorder is not None else options.output_times
    wanted = wanted_times(times, problem.t0, problem.t1)
    refine = 0 if times is not None else options.refine or pair.refine
    if recorder is not None:
        refine, course["max_steps"] = int(coefficients["degree"]), recorder.steps
    stops = stops_to_end(problem.inputs.breakpoints, problem.t0, problem.t1)
    log = log_for(problem, stops, wanted, refine=refine, events=int(watch["most"]), recorder=recorder)
    most_steps = max(16, SLICE_WORK // (BLOCK * int(space["blocks"]) * pair.tableau.stages))
    go_on = partial(loop.of(space, coefficients, control, course, log.record, watch, sides), most_steps)
    return Marching(
        options,
        course,
        log,
        state_of(space, space_arrays),
        log.roomy(go_on, int(watch["most"])),
        counting(course, *COUNTS),
        restorer(
            space, course, log.record, watch, sides, space_arrays["reader"], space_arrays["u"], *kept(sides_arrays)
        ),
        taking(problem, partial(np.copyto, space_arrays["constants"])),
        (space_arrays, watch_arrays, sides_arrays),
    )


def _course(problem: Problem, options: Options, pair: EmbeddedPair) -> np.void:
    return record(
        COURSE,
        max_steps=options.max_steps or 0,
        max_step=options.max_step or pair.longest_step * (problem.t1 - problem.t0),
        first_step=options.first_step or 0.0,
        longest_first=problem.longest_first_step,
        failed_state=-1,
        restart=1,
        now=problem.t0,
        size=np.inf,
    )
