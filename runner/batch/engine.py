"""Integrating a block of runs and sampling them: the one place that knows how runs are advanced."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from runner.observe import Observer
from runner.options import Options
from runner.problem import Status, Trajectory
from runner.simulate import Simulation

#: A sample interval this close to a multiple of the step, relative to it, is one.
WHOLE = 1e-9
#: The status of a run whose settings are refused, and of one that was not run yet.
REFUSED, NOT_RUN = 100, -1


@dataclass(frozen=True)
class Sampling:
    """Uniform samples of a run, `count` of them, the first at t0 and the last at t1, in s."""

    t0: float
    t1: float
    count: int

    @property
    def interval(self) -> float:
        """Time between two samples, s."""
        return (self.t1 - self.t0) / (self.count - 1)

    @property
    def times(self) -> NDArray[np.float64]:
        """The times (count,) in s."""
        return np.linspace(self.t0, self.t1, self.count)


@dataclass(frozen=True, eq=False)
class BlockResult:
    """What became of a block of runs; rows of runs that were refused or left early hold NaN where there is nothing.

    samples (runs, count, n_quantities); final_states (runs, n_states); status (runs,): a Status or REFUSED;
    failed_at (runs,) s; failed_state (runs,): index or -1; steps, evaluations (runs,). refusals: row -> why a method
    refuses the run, such as a step too small for the time to advance.
    """

    samples: NDArray[np.float64]
    final_states: NDArray[np.float64]
    status: NDArray[np.int8]
    failed_at: NDArray[np.float64]
    failed_state: NDArray[np.int64]
    steps: NDArray[np.int64]
    evaluations: NDArray[np.int64]
    refusals: dict[int, str] = field(default_factory=dict)


def run_block(runs: Sequence[Simulation | None], observer: Observer, sampling: Sampling) -> BlockResult:
    """Integrate the runs of a block, None where the settings were refused; releases the interpreter's lock."""
    n, n_states = len(runs), len(observer.model.state_names)
    result = BlockResult(
        samples=np.full((n, sampling.count, len(observer.places)), np.nan),
        final_states=np.full((n, n_states), np.nan),
        status=np.full(n, REFUSED, dtype=np.int8),
        failed_at=np.full(n, np.nan),
        failed_state=np.full(n, -1),
        steps=np.zeros(n, dtype=np.int64),
        evaluations=np.zeros(n, dtype=np.int64),
    )
    for row, run in enumerate(runs):
        if run is not None:
            try:
                _integrate(run, row, observer, sampling, result)
            except ValueError as error:
                result.refusals[row] = str(error)
    return result


def _integrate(run: Simulation, row: int, observer: Observer, sampling: Sampling, result: BlockResult) -> None:
    trajectory = run.method.integrate(run.problem, run.method, sampled(run, sampling))
    result.status[row] = trajectory.status
    result.failed_at[row] = trajectory.failed_at
    result.failed_state[row] = trajectory.failed_state
    result.steps[row] = trajectory.statistics.steps
    result.evaluations[row] = trajectory.statistics.evaluations
    result.final_states[row] = trajectory.states[-1]
    kept = _on_grid(trajectory, sampling)
    t, states = trajectory.t[:kept], trajectory.states[:kept]
    result.samples[row, :kept] = observer(t, states, run.problem.inputs, run.problem.constants)


def sampled(run: Simulation, sampling: Sampling) -> Options:
    """The options of a run that is saved at the samples, at grid points where they fall on such: no step is cut.

    A step that an output time cuts rounds otherwise than the same step of a run that is not sampled.
    """
    if not run.method.adaptive and run.options.step is not None:
        every = round(sampling.interval / run.options.step)
        if every >= 1 and abs(every * run.options.step - sampling.interval) <= WHOLE * sampling.interval:
            return replace(run.options, every=every, output_times=None)
    return replace(run.options, every=None, output_times=sampling.times)


def _on_grid(trajectory: Trajectory, sampling: Sampling) -> int:
    """How many samples there are; a run that was cut short ends with a point that is none."""
    if trajectory.status == Status.FINISHED:
        return sampling.count
    near = 0.25 * sampling.interval
    wanted = sampling.times[: len(trajectory.t)]
    return int(np.count_nonzero(np.abs(trajectory.t[: len(wanted)] - wanted) <= near))
