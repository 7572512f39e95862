"""Sets up and drives the run of a stiff method, slice by slice."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

from qddot.runner.events.kinds import EventLog, names_of, watch_for
from qddot.runner.events.search import WATCH
from qddot.runner.inputs.instants import ROUNDING, after, between
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.compiling import working_time
from qddot.runner.machine.memory import address, record
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Statistics, Status, Trajectory
from qddot.runner.slices import drive
from qddot.runner.stiff.consistent import AlgebraicEquations, InconsistentError, consistent_state
from qddot.runner.stiff.run import CORRECT, POINTS, START
from qddot.runner.stiff.space import SPACE, THRESHOLD, X, space_for

#: Scalar operations of a slice: some ten milliseconds, so that Ctrl-C is heard.
SLICE_WORK = 100_000_000
FOUND = ("found_t", "found_event", "found_x")
COUNTS = ("steps", "failed_attempts", "evaluations", "jacobians", "factorizations", "linear_solves")

Array = NDArray[np.float64]


class Run:
    """One run: the arrays that the compiled loop works on, and the saved points, which grow between slices."""

    def __init__(self, problem: Problem, options: Options, rows: int, control: np.dtype, **settings: Any) -> None:
        """Allocate everything; `control` types the record of scalars, `settings` are initial values of some."""
        self.problem, self.options = problem, options
        self.space, self.arrays = space_for(problem, options, rows)
        self.state = self.arrays["work"][X]
        self.watch, self.watch_arrays = watch_for(options.events, int(self.space["n"]))
        self.stops, self.requested = stops(problem), requested_times(problem, options)
        room, event_room = max(4096, len(self.requested) + 1), max(1, 8 * len(options.events))
        self.log: dict[str, NDArray[Any]] = {
            "saved_t": np.full(room, float(problem.t0)),
            "saved_x": np.tile(self.state, (room, 1)),
            "found_t": np.zeros(event_room),
            "found_event": np.zeros(event_room, dtype=np.int64),
            "found_x": np.zeros((event_room, int(self.space["n"]))),
        }
        self.control = record(control, **self._settings(), **settings)

    def _settings(self) -> dict[str, Any]:
        options, span = self.options, float(self.problem.t1) - float(self.problem.t0)
        mass = self.problem.mass_matrix
        algebraic = mass is not None and int(np.linalg.matrix_rank(mass)) < len(self.state)
        return {
            "t": self.problem.t0,
            "h_max": min(options.max_step or 0.1 * span, span),
            "first_step": options.first_step or 0.0,
            "longest_first": self.problem.longest_first_step,
            "rtol": options.least_rtol,
            "limit": options.divergence_limit,
            "refine": options.refine or 1,
            "max_steps": options.max_steps or np.iinfo(np.int64).max,
            "failed_state": -1,
            "saved": 1,
            "unit_mass": mass is None,
            "algebraic": algebraic,
            "phase": CORRECT if algebraic else START,
        }

    def points(self) -> np.void:
        """Where the loop finds its stops and saves its points, after making room where there is little left."""
        log, s = self.log, self.control
        for short, names in (
            (s["saved"] == len(log["saved_t"]), ("saved_t", "saved_x")),
            (s["found"] + 2 * self.watch["count"] > len(log["found_t"]), FOUND),
        ):
            if short:
                log |= {name: np.concatenate([log[name], np.zeros_like(log[name])]) for name in names}
        return record(
            POINTS,
            n=int(self.space["n"]),
            stops=address(self.stops),
            n_stops=len(self.stops),
            requested=address(self.requested),
            n_requested=len(self.requested),
            room=len(log["saved_t"]),
            event_room=len(log["found_t"]),
            **{name: address(array) for name, array in log.items()},
        )

    def drive(self, advance: Callable[..., Any]) -> Trajectory:
        """Call the method's loop, advance(space, s, points, watch, most_steps), compiled, to the run's end.

        Raises ValueError for initial values that cannot be made consistent with the algebraic equations.
        """
        loop = compiled_loop(advance, self.control.dtype)
        start, n = working_time(), int(self.space["n"])
        t0, span = float(self.problem.t0), float(self.problem.t1) - float(self.problem.t0)
        most_steps = max(4, SLICE_WORK // (100 * n + 10 * n**2 + n**3))

        def one_slice() -> int:
            if self.control["phase"] == CORRECT and not self._make_consistent():
                return Status.NEWTON_FAILURE
            return loop(self.space, self.control, self.points(), self.watch, most_steps)

        status = drive(
            one_slice,
            fraction_done=lambda: (self.control["t"] - t0) / span,
            progress=self.options.progress,
            time_limit=self.options.time_limit,
        )
        return self._trajectory(status, working_time() - start)

    def _make_consistent(self) -> bool:
        """Correct the algebraic states where a segment begins; False where that fails after the start."""
        s = self.control
        side = after.py_func(s["t"], self.stops[s["segment"]] - s["t"])
        threshold = self.arrays["work"][THRESHOLD]
        equations = AlgebraicEquations(self.problem, float(s["t"]), float(side), threshold)
        try:
            self.state[:] = consistent_state(equations, self.state.copy(), self.options.least_rtol)
        except InconsistentError:
            if s["steps"] == 0:
                raise
            return False
        if s["steps"] == 0:
            self.log["saved_x"][0] = self.state
        s["evaluations"] += equations.evaluations
        s["jacobians"] += equations.jacobians
        s["phase"] = START
        return True

    def _trajectory(self, status: Status, wall_time: float) -> Trajectory:
        """The saved points; a run that was cut short ends with its last state."""
        s, log = self.control, self.log
        t, x = log["saved_t"][: s["saved"]], log["saved_x"][: s["saved"]]
        if status is not Status.FINISHED and t[-1] < s["t"]:
            t, x = np.append(t, s["t"]), np.vstack([x, self.state])
        failed = status in (Status.NON_FINITE, Status.STEP_UNDERFLOW, Status.NEWTON_FAILURE)
        found_t, found_event, found_x = (log[name][: s["found"]].copy() for name in FOUND)
        names = names_of(self.options.events)
        return Trajectory(
            t=t.copy(),
            states=x.copy(),
            status=status,
            statistics=Statistics(**{name: int(s[name]) for name in COUNTS}, wall_time=wall_time),
            failed_at=float(max(s["t"], s["t_new"])) if failed else np.nan,
            failed_state=int(s["failed_state"]) if failed else -1,
            extras={"events": EventLog(found_t, found_event, found_x, names)} if names else {},
        )


@cache
def compiled_loop(advance: Callable[..., Any], control: np.dtype) -> Any:
    """A method's loop, with `control` the type of its record of scalars."""
    signature = types.int64(*map(from_dtype, (SPACE, control, POINTS, WATCH)), types.int64)
    return compiled(signature, nogil=True)(advance)


def stops(problem: Problem) -> Array:
    """The breakpoints of the inputs within the span, and its end."""
    t0, t1 = float(problem.t0), float(problem.t1)
    if not t0 < t1:
        raise ValueError(f"the run goes from t0 = {t0} to t1 = {t1}, expected t1 greater than t0")
    return np.append(between(problem.inputs.breakpoints, t0, t1), t1)


def requested_times(problem: Problem, options: Options) -> Array:
    """The output times after t0, the last of them t1; none where every step is to be saved."""
    if options.output_times is None:
        return np.empty(0)
    t0, t1 = float(problem.t0), float(problem.t1)
    times = np.asarray(options.output_times)
    outside = times[(t0 - times > ROUNDING * abs(t0)) | (times - t1 > ROUNDING * abs(t1))]
    if outside.size:
        raise ValueError(f"output time {outside[0]} is outside the span from {t0} to {t1}")
    return np.append(between(times, t0, t1), t1)
