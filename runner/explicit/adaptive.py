"""Adaptive explicit Runge-Kutta methods: any embedded pair, any controller, any model, one compiled loop."""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner.events.kinds import EventLog, names_of, watch_for
from qddot.runner.events.search import WATCH
from qddot.runner.explicit.adaptive_course import COURSE
from qddot.runner.explicit.adaptive_loop import advance
from qddot.runner.explicit.controller import CONTROL, control_for
from qddot.runner.explicit.step import PAIR, pair_for
from qddot.runner.explicit.tableau_adaptive import EmbeddedPair
from qddot.runner.explicit.workspace import SPACE, space_for, state_of
from qddot.runner.inputs.instants import between
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.compiling import working_time
from qddot.runner.machine.memory import BLOCK, address, record
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Statistics, Status, Trajectory
from qddot.runner.slices import drive

if TYPE_CHECKING:
    from qddot.runner.methods import Method

#: State components advanced per slice: some milliseconds of work for a generated model.
SLICE_WORK = 1_000_000
#: Points that there is room for at first, beyond the wanted times; doubled whenever it is used up.
FIRST_ROOM = 8192


@cache
def _compiled_advance() -> Any:
    records = (typeof(record(fields)) for fields in (SPACE, PAIR, CONTROL, COURSE, WATCH))
    return compiled(types.int64(*records, types.int64), _nrt=False, nogil=True)(advance)


@dataclass(frozen=True, eq=False)
class Log:
    """What the compiled loop writes: the course of the run and the arrays it points into; points and events grow."""

    course: np.void
    arrays: dict[str, NDArray[Any]]

    def make_room(self) -> None:
        """Double the arrays of points and events that are half full."""
        for filled, room, names in (
            ("saved", "room", ("saved_t", "saved_x")),
            ("found", "event_room", ("found_t", "found_event", "found_x")),
        ):
            if 2 * self.course[filled] >= self.course[room]:
                for name in names:
                    self.arrays[name] = np.concatenate([self.arrays[name], np.zeros_like(self.arrays[name])])
                    self.course[name] = address(self.arrays[name])
                self.course[room] *= 2

    def save(self, t: float, x: NDArray[np.float64]) -> None:
        """Append a point, unless the last one is of this time."""
        place = int(self.course["saved"])
        if place == 0 or self.arrays["saved_t"][place - 1] < t:
            self.arrays["saved_t"][place], self.arrays["saved_x"][place] = t, x
            self.course["saved"] = place + 1


def integrate(problem: Problem, method: "Method", options: Options) -> Trajectory:
    """Integrate `problem` with method.pair; reads the options of adaptive methods, see `Options`.

    Saves options.refine points a step (the pair's own number by default), or at options.output_times by dense output,
    which changes no step. Events end up in extras["events"], an `EventLog`.
    Raises ValueError for a controller, an event or times that make no sense.
    """
    start = working_time()
    pair = method.pair
    if pair is None:
        raise ValueError(f"method {method.name!r} has no embedded pair, so it cannot control its step")
    rtol, atol = options.tolerances(len(problem.initial_state))
    control = control_for(
        options.controller or pair.controller, pair.error_order, float(rtol.min()), options.divergence_limit
    )
    space, space_arrays = space_for(problem, rtol, atol)
    coefficients, _ = pair_for(pair)
    watch, watch_arrays = watch_for(options.events, int(space["n"]))
    log = _log(problem, options, pair, int(space["n"]))
    course = log.course
    loop = _compiled_advance()
    most_steps = max(16, SLICE_WORK // (BLOCK * int(space["blocks"]) * pair.tableau.stages))

    def go() -> int:
        log.make_room()
        return loop(space, coefficients, control, course, watch, most_steps)

    status = drive(
        go,
        fraction_done=lambda: float((course["now"] - problem.t0) / (problem.t1 - problem.t0)),
        progress=options.progress,
        time_limit=options.time_limit,
    )
    log.save(float(course["now"]), state_of(space, space_arrays))
    del watch_arrays  # The loop knew them by address: they had to live until here.
    return _trajectory(log, status, names_of(options.events), working_time() - start)


def _log(problem: Problem, options: Options, pair: EmbeddedPair, n: int) -> Log:
    wanted = _wanted(options.output_times, problem.t0, problem.t1)
    room, event_room = FIRST_ROOM + 2 * len(wanted), 8 * (1 + len(options.events))
    arrays: dict[str, NDArray[Any]] = {
        "stops": _stops(problem.inputs.breakpoints, problem.t0, problem.t1),
        "wanted": wanted,
        "saved_t": np.zeros(room),
        "saved_x": np.zeros((room, n)),
        "found_t": np.zeros(event_room),
        "found_event": np.zeros(event_room, dtype=np.int64),
        "found_x": np.zeros((event_room, n)),
    }
    course = record(
        COURSE,
        **{name: address(array) for name, array in arrays.items()},
        n_stops=len(arrays["stops"]),
        n_wanted=len(wanted),
        room=room,
        event_room=event_room,
        refine=0 if options.output_times is not None else options.refine or pair.refine,
        max_steps=options.max_steps or 0,
        max_step=options.max_step or pair.longest_step * (problem.t1 - problem.t0),
        first_step=options.first_step or 0.0,
        longest_first=problem.longest_first_step,
        failed_state=-1,
        restart=1,
        now=problem.t0,
        size=np.inf,
    )
    log = Log(course, arrays)
    log.save(problem.t0, problem.initial_state)
    return log


def _wanted(times: NDArray[np.float64] | None, t0: float, t1: float) -> NDArray[np.float64]:
    """The output times after the start; the end is saved anyway."""
    if times is None:
        return np.empty(0)
    outside = times[(times < t0) | (times > t1)]
    if outside.size:
        raise ValueError(f"output time {outside[0]} is outside the span from {t0} to {t1}")
    return times[times > t0]


def _stops(breakpoints: NDArray[np.float64], t0: float, t1: float) -> NDArray[np.float64]:
    """The breakpoints within the span that are apart from each other and from its ends, then the end."""
    if not t0 < t1:
        raise ValueError(f"the span is from {t0} to {t1}, expected a start before the end")
    return np.append(between(breakpoints, t0, t1), t1)


def _trajectory(log: Log, status: Status, names: tuple[str, ...], wall_time: float) -> Trajectory:
    course, arrays = log.course, log.arrays
    points, found = int(course["saved"]), int(course["found"])
    failed = status in (Status.NON_FINITE, Status.STEP_UNDERFLOW)
    times, which, states = (arrays[name][:found].copy() for name in ("found_t", "found_event", "found_x"))
    return Trajectory(
        t=arrays["saved_t"][:points].copy(),
        states=arrays["saved_x"][:points].copy(),
        status=status,
        statistics=Statistics(
            steps=int(course["steps"]),
            failed_attempts=int(course["failed_attempts"]),
            evaluations=int(course["evaluations"]),
            wall_time=wall_time,
        ),
        failed_at=float(course["now"]) if failed else np.nan,
        failed_state=int(course["failed_state"]),
        extras={"events": EventLog(times, which, states, names)} if names else {},
    )
