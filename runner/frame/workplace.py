"""What a run works with, made once for a prepared problem and used again by its next run: a workplace.

A workplace serves one run at a time; runs at the same time, in threads or begun by a `progress`, have one each. One in
which a run failed, or was interrupted, is left to the dust: nothing of it can reach another run.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory

if TYPE_CHECKING:
    from qddot.runner.method import Method


class Workplace(Protocol):
    """Arrays and records of one run at a time."""

    def run(self, problem: Problem) -> tuple[Trajectory, bool]:
        """The trajectory from problem.initial_state, all else as it was made for, and whether it may be used again."""


Make = Callable[[Problem, "Method", Options], Workplace]


def run_in_place(make: Make, problem: Problem, method: "Method", options: Options) -> Trajectory:
    """The trajectory by a workplace that no run is using, a new one where there is none."""
    if problem.workplaces is None:
        return make(problem, method, options).run(problem)[0]
    idle = problem.workplaces.setdefault((make, method, options), [])
    try:
        place = idle.pop()
    except IndexError:
        place = make(problem, method, options)
    trajectory, again = place.run(problem)
    if again:
        idle.append(place)
    return trajectory


def restorer(*places: Any) -> Callable[[], None]:
    """A function that gives records and arrays back what they hold now."""
    arrays: list[Any] = [place.base if isinstance(place, np.void) else place for place in places]
    bytes_of = [array.view(np.uint8) for array in arrays]
    now = [each.copy() for each in bytes_of]

    def restore() -> None:
        for each, then in zip(bytes_of, now, strict=True):
            each[...] = then

    return restore
