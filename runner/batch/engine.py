"""Integrating a block of runs and sampling them: the one place that knows how runs are advanced."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from qddot.runner.batch.lanes_block import in_lanes, kind
from qddot.runner.batch.prepared import Run
from qddot.runner.batch.sampling import Sampling
from qddot.runner.lanes.kernel import lane_rhs
from qddot.runner.observe import Observer
from qddot.runner.options import Options
from qddot.runner.problem import Status, Trajectory
from qddot.runner.simulate import Simulation

#: A sample interval this close to a multiple of the step, relative to it, is one.
WHOLE = 1e-9
#: The status of a run whose settings are refused, and of one that was not run yet.
REFUSED, NOT_RUN = 100, -1


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


def run_block(runs: Sequence[Run | None], observer: Observer, sampling: Sampling) -> BlockResult:
    """Integrate the runs of a block, None where the settings were refused; releases the interpreter's lock.

    Runs of one method and its options go in lanes where the method and the model do, the others one by one. Lanes round
    otherwise than a run alone.
    """
    result = _empty(len(runs), len(observer.model.state_names), sampling.count, len(observer.places))
    kinds: dict[Hashable, list[int]] = {}
    for row, run in enumerate(runs):
        if run is not None:
            kinds.setdefault(kind(run) or row, []).append(row)
    for key, rows in kinds.items():
        if isinstance(key, tuple) and lane_rhs(observer.model) is not None:
            _integrate_together([(row, run) for row in rows if (run := runs[row])], observer, sampling, result)
        else:
            for row in rows:
                if run := runs[row]:
                    _integrate(run.simulation, row, observer, sampling, result)
    return result


def _empty(runs: int, n_states: int, count: int, quantities: int) -> BlockResult:
    return BlockResult(
        samples=np.full((runs, count, quantities), np.nan),
        final_states=np.full((runs, n_states), np.nan),
        status=np.full(runs, REFUSED, dtype=np.int8),
        failed_at=np.full(runs, np.nan),
        failed_state=np.full(runs, -1),
        steps=np.zeros(runs, dtype=np.int64),
        evaluations=np.zeros(runs, dtype=np.int64),
    )


def _integrate_together(
    runs: Sequence[tuple[int, Run]], observer: Observer, sampling: Sampling, result: BlockResult
) -> None:
    """Integrate runs of one kind in lanes, and leave their results in the rows given."""
    rows = [row for row, _ in runs]
    names = observer.names if observer.sees_states_and_outputs else observer.model.state_names
    try:
        batch = in_lanes(observer.model, [run for _, run in runs], sampling, names)
    except ValueError as error:
        result.refusals.update(dict.fromkeys(rows, str(error)))
        return
    result.status[rows], result.final_states[rows] = batch.status, batch.final
    places = {name: place for place, name in enumerate(observer.model.state_names)}
    result.failed_at[rows] = batch.failed_at
    result.failed_state[rows] = [places.get(name, -1) for name in batch.failed_state.tolist()]
    result.steps[rows], result.evaluations[rows] = batch.steps, batch.evaluations
    if observer.sees_states_and_outputs:
        result.samples[rows] = batch.samples
        return
    for (row, run), states in zip(runs, batch.samples, strict=True):
        kept = int(np.isfinite(states[:, 0]).sum())
        problem = run.simulation.problem
        result.samples[row, :kept] = observer(sampling.times[:kept], states[:kept], problem.inputs, problem.constants)


def _integrate(run: Simulation, row: int, observer: Observer, sampling: Sampling, result: BlockResult) -> None:
    try:
        trajectory = run.method.integrate(run.problem, run.method, sampled(run, sampling))
    except ValueError as error:
        result.refusals[row] = str(error)
        return
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
