"""Runs of a block at once, in SIMD lanes or exactly: they differ in parameters, inputs and starts, not in method."""

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from qddot.runner.batch.outcome import Outcome
from qddot.runner.batch.prepared import Run
from qddot.runner.batch.sampling import Sampling
from qddot.runner.lanes.batch import Batch, simulate_batch
from qddot.runner.observe import Observer
from qddot.runner.options import MANY
from qddot.runner.takers import taken


def alike(run: Run) -> Hashable:
    """What runs that go together have in common: the method and the options that such runs take."""
    options = run.simulation.options
    values = (getattr(options, name) for name in MANY)
    return run.simulation.method.name, *(v.tobytes() if isinstance(v, np.ndarray) else v for v in values)


def together(runs: Sequence[tuple[int, Run]], observer: Observer, sampling: Sampling, outcome: Outcome) -> None:
    """Integrate runs that are alike, and leave each in its row."""
    rows = [row for row, _ in runs]
    try:
        batch = _simulated([run for _, run in runs], observer, sampling)
    except ValueError as error:
        outcome.refusals.update(dict.fromkeys(rows, str(error)))
        return
    outcome.status[rows], outcome.final_states[rows] = batch.status, batch.final
    places = {name: place for place, name in enumerate(observer.model.state_names)}
    outcome.failed_at[rows] = batch.failed_at
    outcome.failed_state[rows] = [places.get(name, -1) for name in batch.failed_state.tolist()]
    outcome.steps[rows], outcome.evaluations[rows] = batch.steps, batch.evaluations
    if observer.sees_states_and_outputs:
        outcome.samples[rows] = batch.samples
        return
    for (row, run), states in zip(runs, batch.samples, strict=True):
        kept = int(np.isfinite(states[:, 0]).sum())
        problem = run.simulation.problem
        outcome.samples[row, :kept] = observer(sampling.times[:kept], states[:kept], problem.inputs, problem.constants)


def _simulated(runs: Sequence[Run], observer: Observer, sampling: Sampling) -> Batch:
    """These runs, sampled; of what is observed the states and outputs, or the states, from which the rest follows."""
    simulations = [run.simulation for run in runs]
    first = simulations[0]
    given: dict[str, Any] = {name: getattr(first.options, name) for name in taken(first.method, many=True)}
    return simulate_batch(
        observer.model,
        (sampling.t0, sampling.t1),
        method=first.method.name,
        runs=len(runs),
        parameters=np.array([list(each.subject.parameters.values()) for each in simulations]),
        initial=np.array([each.problem.initial_state for each in simulations]),
        inputs=[run.signals for run in runs],
        output_times=sampling.count,
        names=observer.names if observer.sees_states_and_outputs else observer.model.state_names,
        threads=1,
        **given,
    )
