"""Runs of a block one by one, each by its method's own driver."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from qddot.runner.batch.outcome import Outcome
from qddot.runner.batch.prepared import Run
from qddot.runner.batch.sampling import WHOLE, Sampling
from qddot.runner.frame.spans import integrate
from qddot.runner.frame.stretches import as_run
from qddot.runner.observe import Observer
from qddot.runner.options import Options
from qddot.runner.problem import Status, Trajectory
from qddot.runner.simulate import Simulation


def alone(runs: Sequence[tuple[int, Run]], observer: Observer, sampling: Sampling, outcome: Outcome) -> None:
    """Integrate run after run, and leave each in its row."""
    for row, run in runs:
        _integrate(run.simulation, row, observer, sampling, outcome)


def _integrate(run: Simulation, row: int, observer: Observer, sampling: Sampling, outcome: Outcome) -> None:
    try:
        trajectory = integrate(run.problem, run.method, _sampled(run, sampling))
    except ValueError as error:
        outcome.refusals[row] = str(error)
        return
    outcome.status[row] = trajectory.status
    outcome.failed_at[row] = trajectory.failed_at
    outcome.failed_state[row] = trajectory.failed_state
    outcome.steps[row] = trajectory.statistics.steps
    outcome.evaluations[row] = trajectory.statistics.evaluations
    outcome.final_states[row] = trajectory.states[-1]
    kept = _on_grid(trajectory, sampling)
    t, states = trajectory.t[:kept], trajectory.states[:kept]
    problem = as_run(run.problem, trajectory)
    outcome.samples[row, :kept] = observer(t, states, problem.inputs, problem.constants)


def _sampled(run: Simulation, sampling: Sampling) -> Options:
    """The options of a run that is saved at the samples, at grid points where they fall on such: no step is cut.

    A step that an output time cuts rounds otherwise than the same step of a run that is not sampled.
    """
    if not run.method.adaptive and run.options.step is not None and run.problem.acting is None:
        every = round(sampling.interval / run.options.step)
        if every >= 1 and abs(every * run.options.step - sampling.interval) <= WHOLE * sampling.interval:
            return replace(run.options, every=every, output_times=None)
    return replace(run.options, every=None, refine=None, output_times=sampling.times)


def _on_grid(trajectory: Trajectory, sampling: Sampling) -> int:
    """How many samples there are; a run that was cut short ends with a point that is none."""
    if trajectory.status == Status.FINISHED:
        return sampling.count
    near = 0.25 * sampling.interval
    wanted = sampling.times[: len(trajectory.t)]
    return int(np.count_nonzero(np.abs(trajectory.t[: len(wanted)] - wanted) <= near))
