"""Runs of a batch one by one, for methods and models that do not go in lanes; the results are laid out the same."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.acting import acting_of
from qddot.runner.frame.hold import switching_of
from qddot.runner.frame.spans import integrate
from qddot.runner.frame.stretches import as_run
from qddot.runner.lanes.starts import repeated, table_of
from qddot.runner.machine.compiling import working_time
from qddot.runner.manifold import held_by, resting_of
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Status, Trajectory
from qddot.runner.result import outputs_of

if TYPE_CHECKING:
    from qddot.runner.lanes.task import Task


def run_one_by_one(task: "Task", progress: Callable[[float], None] | None, time_limit: float | None) -> None:
    """Integrate run after run, each as `simulate` does, into the arrays of the task."""
    arrays, started, alike, shared = task.arrays, working_time(), _alike(task), None
    for run in range(task.runs):
        left = None if time_limit is None else time_limit - (working_time() - started)
        if left is not None and left <= 0:
            arrays["status"][run:] = int(Status.TIME_LIMIT)
            return
        if shared is None or left is not None or not alike[run]:
            shared = _Alike(problem_of(task, run), _options_of(task, run, left))
        problem, options = shared.of(task, run)
        trajectory = integrate(problem, task.method, options)
        _write(task, run, as_run(problem, trajectory), trajectory)
        if trajectory.status is Status.INTERRUPTED:
            arrays["status"][run:] = int(Status.INTERRUPTED)
            return
        if progress is not None:
            progress((run + 1) / task.runs)


@dataclass(frozen=True)
class _Alike:
    """What runs share that follow each other and differ by start and parameters alone."""

    problem: Problem
    options: Options
    workplaces: dict[Any, list[Any]] = field(default_factory=dict)

    def of(self, task: "Task", run: int) -> tuple[Problem, Options]:
        """The problem of a run, and its options."""
        initial, constants = task.arrays["initial"][run], task.arrays["constants"][run]
        return self.problem.started_from(initial, self.workplaces, constants), self.options


def _alike(task: "Task") -> NDArray[np.bool_]:
    """Which runs (runs,) share what they work with with the run before; none where parameters are in all of that."""
    spans = (task.arrays[name] for name in ("t0", "t1", "times"))
    return repeated(*spans, task.inputs.table, task.inputs.rate, task.inputs.offset) & (task.method.family != "exact")


def _options_of(task: "Task", run: int, time_limit: float | None) -> Options:
    """The options of one run."""
    times, t0, t1 = (task.arrays[name][run] for name in ("times", "t0", "t1"))
    wanted = times[(times >= t0) & (times <= t1)]
    return replace(task.options, output_times=wanted if len(wanted) else np.array([t1]), time_limit=time_limit)


def problem_of(task: "Task", run: int) -> Problem:
    """One run of a batch, as its method takes it alone."""
    model, arrays = task.model, task.arrays
    return Problem(
        rhs=model.kernel("rhs"),
        t0=float(arrays["t0"][run]),
        t1=float(arrays["t1"][run]),
        initial_state=arrays["initial"][run],
        constants=arrays["constants"][run],
        inputs=table_of(task.inputs, run),
        n_inputs=model.tables.rhs_inputs,
        state_names=model.state_names,
        jacobian=model.matrix("jacobian") if task.method.stiff else None,
        recurrences=model.series if task.method.family == "taylor" else None,
        by_item=True,
        held=held_by(model),
        acting=acting_of(model, resting_of(model, stiff=task.method.stiff)),
        **switching_of(model, task.method, task.options),
    )


def _write(task: "Task", run: int, problem: Problem, trajectory: Trajectory) -> None:
    arrays = task.arrays
    arrays["final"][run] = trajectory.states[-1]
    arrays["status"][run] = int(trajectory.status)
    arrays["failed_at"][run], arrays["failed_state"][run] = trajectory.failed_at, trajectory.failed_state
    for name in ("steps", "failed_attempts", "evaluations"):
        arrays[name][run] = getattr(trajectory.statistics, name)
    if not arrays["times"].shape[1]:
        return
    values = trajectory.states
    if task.needs_outputs:
        kernel, count = task.model.kernel("outputs"), len(task.model.tables.outputs)
        values = np.hstack([values, outputs_of(kernel, count, problem, trajectory.t, trajectory.states)[1]])
    places = np.searchsorted(trajectory.t, arrays["times"][run] - 1e-12 * max(1.0, abs(problem.t1)))
    near = np.minimum(places, len(trajectory.t) - 1)
    reached = np.abs(trajectory.t[near] - arrays["times"][run]) <= 1e-9 * (problem.t1 - problem.t0)
    found = values[near][:, arrays["columns"]]
    arrays["samples"][run] = np.where(reached[:, None], found, np.nan)
