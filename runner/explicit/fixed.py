"""Fixed-step marching: plans the steps and the saved points of a run for the compiled loop of `march`."""

from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from qddot.runner.explicit.march import MARCH, run_slice, steps_of
from qddot.runner.explicit.march_closely import DENSE_OUTPUT, run_slice_closely
from qddot.runner.explicit.step import PAIR, tableau_for
from qddot.runner.explicit.workspace import SPACE, space_for, state_of
from qddot.runner.frame.events import watch_for
from qddot.runner.frame.functions import give_functions
from qddot.runner.frame.hermite import DEGREE
from qddot.runner.frame.hold import holding, kept
from qddot.runner.frame.log import LOG, Log, log_for
from qddot.runner.frame.output_times import wanted_times
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.search import WATCH
from qddot.runner.frame.stops import grid_stops
from qddot.runner.frame.workplace import Marching, restorer, run_in_place, taking
from qddot.runner.inputs.short import with_stops
from qddot.runner.machine.by_places import Loop, by_places
from qddot.runner.machine.memory import BLOCK, place, reading, record
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Status, Trajectory

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: Points saved by default, about.
DEFAULT_POINTS = 5000
#: State components advanced per slice: some milliseconds of work for a generated model.
SLICE_WORK = 1_000_000


@cache
def _compiled_loop() -> Loop:
    return by_places(run_slice, SPACE, PAIR, MARCH, LOG)


@cache
def _compiled_close_loop() -> Loop:
    return by_places(run_slice_closely, SPACE, PAIR, MARCH, LOG, WATCH, WATCH)


def integrate(problem: Problem, method: "Method", options: Options, recorder: Recorder | None = None) -> Trajectory:
    """March `problem` with options.step; saves at options.output_times or every options.every-th grid point.

    Events are found on the cubic through the states and slopes at the ends of a step, and end up in extras["events"],
    an `EventLog`; recorder: takes the pieces of the run, which are these cubics. Raises ValueError where the step is
    missing, does not advance the time, or output times lie outside the span, and for an event that makes no sense.
    """
    return run_in_place(_workplace, problem, method, options, recorder)


def _workplace(problem: Problem, method: "Method", options: Options, recorder: Recorder | None) -> Marching:
    if method.tableau is None:
        raise ValueError(f"method {method.name!r} has no tableau to march")
    stages = method.tableau.stages
    march, log = _march(problem, options, method.name, recorder)
    space, space_arrays = space_for(problem, np.zeros(1), np.zeros(1))
    tableau, _ = tableau_for(method.tableau)
    most_steps = max(16, SLICE_WORK // (BLOCK * int(space["blocks"]) * stages))
    watch, watch_arrays = watch_for(options.events, int(space["n"]), DEGREE)
    sides, sides_arrays = holding(problem, space, space_arrays["u"], DEGREE)
    closely = bool(options.events) or recorder is not None or problem.n_modes > 0
    space["pair"], space["course"] = place(tableau), place(march)
    events, points = bool(options.events), recorder is not None
    give_functions(space, DENSE_OUTPUT, events=events, conditions=problem.n_modes > 0, points=points)
    loop = _compiled_close_loop() if closely else _compiled_loop()
    go_on = loop.of(space, tableau, march, log.record, *((watch, sides) if closely else ()))

    def one_slice() -> int:
        if recorder is None:
            return go_on(most_steps)
        status = go_on(min(most_steps, recorder.steps - int(march["steps"])))
        return Status.FINISHED if march["steps"] >= recorder.steps else status

    counts = reading(march, "steps", "end_slopes")

    def statistics() -> dict[str, int]:
        steps, end_slopes = counts()
        return {"steps": steps, "evaluations": steps * stages + end_slopes}

    return Marching(
        options,
        march,
        log,
        state_of(space, space_arrays),
        log.roomy(one_slice, int(watch["most"])) if closely else one_slice,
        statistics,
        restorer(
            space, march, log.record, watch, sides, space_arrays["reader"], space_arrays["u"], *kept(sides_arrays)
        ),
        taking(problem, partial(np.copyto, space_arrays["constants"])),
        (space_arrays, watch_arrays, sides_arrays),
        "failed_at",
    )


def _march(problem: Problem, options: Options, name: str, recorder: Recorder | None) -> tuple[np.void, Log]:
    """The march at its start, and a log with room for all that it will save."""
    t0, t1, step = float(problem.t0), float(problem.t1), options.step
    if step is None:
        raise ValueError(f"method {name!r} marches with a constant step: give step=, such as step=1e-3")
    if step < 64 * np.spacing(max(abs(t0), abs(t1))):
        raise ValueError(f"step is {step}, too small to advance a time as large as {max(abs(t0), abs(t1))}")
    grid_points = int(steps_of.py_func(t0, t1, step))
    wanted = wanted_times(options.output_times, t0, t1)
    every = 0 if options.output_times is not None else options.every or -(-grid_points // DEFAULT_POINTS)
    march = record(
        MARCH,
        grid_points=grid_points,
        every=every,
        failed_state=-1,
        restart=1,
        t0=t0,
        t1=t1,
        step=step,
        now=t0,
        limit=options.divergence_limit,
        failed_at=np.nan,
    )
    stops = grid_stops(with_stops(problem.inputs, step), wanted, t0, t1, step)
    if recorder is not None:
        march["every"] = 0
        return march, log_for(problem, stops, np.empty(0), refine=DEGREE, recorder=recorder)
    room = 3 + len(wanted) + (grid_points // every if every else 0)
    return march, log_for(problem, stops, wanted, room=room)
