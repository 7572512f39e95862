"""Runs of a block in SIMD lanes: those that differ in parameters, inputs and initial states, not in their method."""

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from qddot.runner.batch.prepared import Run
from qddot.runner.batch.sampling import Sampling
from qddot.runner.lanes.batch import IN_LANES, Batch, simulate_batch
from qddot.runner.load import Model
from qddot.runner.options import Options

#: Options that runs in lanes take, and those of which they take the default only.
TAKEN = ("step", "rtol", "max_step", "first_step", "max_steps", "divergence_limit")
DEFAULT = ("time_limit", "refine", "controller", "max_order", "bdf", "events")


def kind(run: Run) -> Hashable:
    """What runs that may share lanes have in common; None where a run must go alone."""
    options, plain = run.simulation.options, Options()
    if run.simulation.method.name not in IN_LANES:
        return None
    if any(getattr(options, name) != getattr(plain, name) for name in DEFAULT):
        return None
    taken = tuple(getattr(options, name) for name in TAKEN)
    return (run.simulation.method.name, *taken, np.asarray(options.atol).tobytes())


def in_lanes(model: Model, runs: Sequence[Run], sampling: Sampling, names: Sequence[str]) -> Batch:
    """These runs, of one kind, sampled; `names` are states and outputs. On the calling thread alone."""
    options = runs[0].simulation.options
    given: dict[str, Any] = {name: getattr(options, name) for name in TAKEN}
    return simulate_batch(
        model,
        (sampling.t0, sampling.t1),
        method=runs[0].simulation.method.name,
        runs=len(runs),
        parameters=np.array([list(run.simulation.subject.parameters.values()) for run in runs]),
        initial=np.array([run.simulation.problem.initial_state for run in runs]),
        inputs=[run.signals for run in runs],
        output_times=sampling.count,
        names=names,
        threads=1,
        atol=options.atol,
        **given,
    )
