"""A run of a stiff method around its compiled loop: its settings, and algebraic states made consistent at starts."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.consistent import AlgebraicEquations, InconsistentError, consistent_state
from qddot.runner.frame.events import watch_for
from qddot.runner.frame.functions import DenseOutput, give_functions
from qddot.runner.frame.hold import holding, kept
from qddot.runner.frame.log import LOG, Log, log_for
from qddot.runner.frame.output_times import wanted_times
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.search import WATCH
from qddot.runner.frame.slices import run_slices
from qddot.runner.frame.stops import stops_to_end
from qddot.runner.frame.workplace import counting, restorer, taking
from qddot.runner.inputs.instants import after
from qddot.runner.machine.by_places import Loop, by_places
from qddot.runner.machine.compiling import working_time
from qddot.runner.machine.memory import place, record
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Statistics, Status, Trajectory
from qddot.runner.stiff.loop import CORRECT, START, within
from qddot.runner.stiff.space import DEGREE, SPACE, THRESHOLD, X, space_for

#: Scalar operations of a slice: some ten milliseconds, so that Ctrl-C is heard.
SLICE_WORK = 100_000_000
COUNTS = ("steps", "failed_attempts", "evaluations", "jacobians", "factorizations", "linear_solves")


@dataclass(frozen=True, eq=False)
class StiffWorkplace:
    """One run at a time: what the loop is called with; `arrays` are what its records know by address."""

    options: Options
    s: np.void
    log: Log
    rows: NDArray[np.float64]
    loop: Callable[[], int]
    counts: Callable[[], dict[str, int]]
    most_events: int
    restore: Callable[[], None]
    take: Callable[[NDArray[np.float64]], None]
    arrays: Any

    def run(self, problem: Problem) -> tuple[Trajectory, bool]:
        """See `Workplace`."""
        start, s, log, rows, options = working_time(), self.s, self.log, self.rows, self.options
        self.restore()
        self.take(problem.constants)
        rows[X] = problem.initial_state
        log.begin(problem.initial_state)

        def one_slice() -> int:
            if s["phase"] == CORRECT and not _make_consistent(problem, options, s, rows, log):
                return Status.NEWTON_FAILURE
            return self.loop()

        status = run_slices(
            log.roomy(one_slice, self.most_events),
            fraction_done=lambda: float((s["t"] - problem.t0) / (problem.t1 - problem.t0)),
            progress=options.progress,
            time_limit=options.time_limit,
        )
        log.save(float(s["t"]), rows[X])
        counts = Statistics(**self.counts(), wall_time=working_time() - start)
        failure = lambda: (max(s["t"], s["t_new"]), s["failed_state"])  # noqa: E731
        return log.trajectory(status, counts, failure, options.events), log.reusable(status)


def stiff_workplace(
    problem: Problem,
    options: Options,
    recorder: Recorder | None,
    run_slice: Callable[..., Any],
    prepare: Any,
    rows: int,
    control: np.dtype,
    **own: Any,
) -> StiffWorkplace:
    """Where a method's loop, run_slice(space, s, log, watch, sides, most_steps), works, with `rows` of vectors.

    prepare: see `DenseOutput`.
    recorder: takes the pieces of the run. control: the type of the record of scalars s; own: initial values of the
    method's own among them. A run raises ValueError for initial values that cannot be made consistent with the
    algebraic equations.
    """
    space, arrays = space_for(problem, options, rows)
    watch, watch_arrays = watch_for(options.events, int(space["n"]), DEGREE)
    sides, sides_arrays = holding(problem, space, arrays["u"], DEGREE)
    stops = stops_to_end(problem.inputs.breakpoints, problem.t0, problem.t1)
    times = None if recorder is not None else options.output_times
    wanted = wanted_times(times, problem.t0, problem.t1)
    refine = 0 if times is not None else options.refine or 1
    s = record(control, **_settings(problem, options), **own)
    if recorder is not None:
        refine, s["max_steps"] = DEGREE, recorder.steps
    space["scalars"] = place(s)
    dense = DenseOutput(prepare, within, within)
    give_functions(space, dense, events=bool(options.events), conditions=problem.n_modes > 0)
    log = log_for(problem, stops, wanted, refine=refine, events=int(watch["most"]), recorder=recorder)
    n, cells = int(space["n"]), int(space["cells"])
    most_steps = max(4, SLICE_WORK // (100 * n + 10 * cells + cells * (cells // n)))
    return StiffWorkplace(
        options,
        s,
        log,
        arrays["work"],
        partial(compiled_loop(run_slice, control).of(space, s, log.record, watch, sides), most_steps),
        counting(s, *COUNTS),
        int(watch["most"]),
        restorer(
            space, s, log.record, watch, sides, *(arrays[name] for name in ("work", "reader", "u")), *kept(sides_arrays)
        ),
        taking(problem, partial(np.copyto, arrays["constants"])),
        (arrays, watch_arrays, sides_arrays),
    )


@cache
def compiled_loop(run_slice: Callable[..., Any], control: np.dtype) -> Loop:
    """A method's loop, with `control` the type of its record of scalars."""
    return by_places(run_slice, SPACE, control, LOG, WATCH, WATCH)


def _settings(problem: Problem, options: Options) -> dict[str, Any]:
    span, mass = float(problem.t1) - float(problem.t0), problem.mass_matrix
    algebraic = mass is not None and int(np.linalg.matrix_rank(mass)) < len(problem.initial_state)
    return {
        "t": problem.t0,
        "h_max": min(options.max_step or 0.1 * span, span),
        "first_step": options.first_step or 0.0,
        "longest_first": problem.longest_first_step,
        "rtol": options.least_rtol,
        "limit": options.divergence_limit,
        "max_steps": options.max_steps or np.iinfo(np.int64).max,
        "failed_state": -1,
        "part": 1.0,
        "unit_mass": mass is None,
        "algebraic": algebraic,
        "phase": CORRECT if algebraic else START,
    }


def _make_consistent(problem: Problem, options: Options, s: np.void, v: NDArray[np.float64], log: Log) -> bool:
    """Correct the algebraic states where a segment begins; False where that fails after the start."""
    stop = log.arrays["stops"][log.record["stop"]]
    side = after.py_func(s["t"], stop - s["t"])
    equations = AlgebraicEquations(problem, float(s["t"]), float(side), v[THRESHOLD])
    try:
        v[X] = consistent_state(equations, v[X].copy(), options.least_rtol)
    except InconsistentError:
        if s["steps"] == 0:
            raise
        return False
    if s["steps"] == 0:
        log.arrays["saved_x"][0] = v[X]
    s["evaluations"] += equations.evaluations
    s["jacobians"] += equations.jacobians
    s["phase"] = START
    return True
