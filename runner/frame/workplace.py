"""What a run works with, made once for a prepared problem and used again by its next run: a workplace.

A workplace serves one run at a time; runs at the same time, in threads or begun by a `progress`, have one each. One in
which a run failed, or was interrupted, is left to the dust: nothing of it can reach another run.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.log import Log
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.slices import run_slices
from qddot.runner.machine.compiling import working_time
from qddot.runner.machine.memory import number_in
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Statistics, Trajectory, unchecked

if TYPE_CHECKING:
    from qddot.runner.method import Method


class Workplace(Protocol):
    """Arrays and records of one run at a time."""

    def run(self, problem: Problem) -> tuple[Trajectory, bool]:
        """The trajectory of a problem, and whether the workplace may be used again.

        All is as it was made for but problem.initial_state and problem.constants.
        """


@dataclass(frozen=True, eq=False)
class Marching:
    """Where a compiled loop goes on slice by slice, and saves into a log what it finds.

    course: the loop's record, with the time in `now` and the state that failed; `state` (n,) is the loop's own.
    counts: the statistics of the run so far, by name. take: see `taking`. failed_at: what in the course is the time of
    a failure. arrays: what the records know by address.
    """

    options: Options
    course: np.void
    log: Log
    state: NDArray[np.float64]
    one_slice: Callable[[], int]
    counts: Callable[[], dict[str, int]]
    restore: Callable[[], None]
    take: Callable[[NDArray[np.float64]], None]
    arrays: Any
    failed_at: str = "now"

    def run(self, problem: Problem) -> tuple[Trajectory, bool]:
        """See `Workplace`."""
        start, options, log = working_time(), self.options, self.log
        self.restore()
        self.take(problem.constants)
        self.state[:] = problem.initial_state
        log.begin(problem.initial_state)
        status = run_slices(
            self.one_slice,
            fraction_done=lambda: (self._now() - problem.t0) / (problem.t1 - problem.t0),
            progress=options.progress,
            time_limit=options.time_limit,
        )
        log.save(self._now(), self.state)
        counts = unchecked(Statistics, self.counts() | {"wall_time": working_time() - start})
        return log.trajectory(status, counts, self._failure, options.events), log.reusable(status)

    @cached_property
    def _now(self) -> Callable[[], float]:
        return number_in(self.course, "now")

    def _failure(self) -> tuple[float, int]:
        return float(self.course[self.failed_at]), int(self.course["failed_state"])


Make = Callable[[Problem, "Method", Options, Recorder | None], Workplace]


def run_in_place(
    make: Make, problem: Problem, method: "Method", options: Options, recorder: Recorder | None = None
) -> Trajectory:
    """The trajectory by a workplace that no run is using, a new one where there is none, or for a recorder."""
    if problem.workplaces is None or recorder is not None:
        return make(problem, method, options, recorder).run(problem)[0]
    idle = problem.workplaces.setdefault((make, method, options), [])
    try:
        place = idle.pop()
    except IndexError:
        place = make(problem, method, options, None)
    trajectory, again = place.run(problem)
    if again:
        idle.append(place)
    return trajectory


def counting(course: np.void, *names: str) -> Callable[[], dict[str, int]]:
    """What reads the statistics of these names in a record."""
    counts = {name: number_in(course, name) for name in names}
    return lambda: {name: count() for name, count in counts.items()}


def taking(problem: Problem, *copies: Callable[[NDArray[np.float64]], None]) -> Callable[[NDArray[np.float64]], None]:
    """What hands constants (n_constants,) to all that have a copy, where they are not those of the run before."""
    before = problem.constants

    def take(constants: NDArray[np.float64]) -> None:
        nonlocal before
        if constants is not before:
            for copy in copies:
                copy(constants)
            before = constants

    return take


def restorer(*places: Any) -> Callable[[], None]:
    """A function that gives records and arrays back what they hold now."""
    arrays: list[Any] = [place.base if isinstance(place, np.void) else place for place in places]
    pieces = [memoryview(array.view(np.uint8).reshape(-1)) for array in arrays]
    now = [(piece, bytes(piece)) for piece in pieces]

    def restore() -> None:
        for piece, then in now:
            piece[:] = then

    return restore
