"""Computing one block of a batch: prepare its runs, integrate and sample them, measure them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from qddot.runner.batch.engine import run_block
from qddot.runner.batch.job import Job
from qddot.runner.batch.prepared import Run
from qddot.runner.batch.probe import probe
from qddot.runner.batch.sampling import Sampling
from qddot.runner.metrics.table import compiled_metric
from qddot.runner.problem import Status
from qddot.runner.study.read import StudyError


@dataclass(frozen=True, eq=False)
class Block:
    """The rows of a block as they go into the store: variable -> (runs, ...); and why runs were refused, by run."""

    index: int
    runs: range
    rows: dict[str, NDArray[np.generic]]
    reasons: dict[int, str]

    @property
    def failed(self) -> int:
        """How many runs did not reach their end."""
        return int(np.count_nonzero(self.rows["status"] != Status.FINISHED))

    @property
    def steps(self) -> int:
        """Steps of all runs."""
        return int(self.rows["steps"].sum())


def compute(job: Job, index: int) -> Block:
    """The block of this index. A run that is refused or fails is a row with a status; its metrics are NaN."""
    runs, reasons = job.runs(index), dict[int, str]()
    prepared: list[Run | None] = []
    for run in runs:
        try:
            prepared.append(job.prepared(run))
        except ValueError as error:
            reasons[run] = str(error).removeprefix(f"{job.path}: ")
            prepared.append(None)
    result = run_block(prepared, job.observer, job.sampling)
    reasons |= {runs[row]: reason for row, reason in result.refusals.items()}
    rows: dict[str, NDArray[np.generic]] = {
        "status": result.status,
        "failed_at": result.failed_at,
        "failed_state": result.failed_state,
        "steps": result.steps,
        "evaluations": result.evaluations,
        "final_state": result.final_states,
    }
    finished = np.flatnonzero(result.status == Status.FINISHED)
    for measure in job.measures:
        rows[measure.name] = np.full(len(runs), np.nan)
        for row in finished:
            rows[measure.name][row] = measure(result.samples[row])
    for place in job.keep:
        rows[job.observer.quantities[place].name] = result.samples[:, :: job.every, place]
    return Block(index, runs, rows, reasons)


def warm_up(job: Job) -> None:
    """Compile, or load from the cache, all that the runs need: by a run of two samples.

    Raises StudyError where the study cannot be run, see `probe`, or where its method refuses it.
    """
    run = probe(job)
    few = Sampling(job.sampling.t0, job.sampling.t0 + job.sampling.interval, 2)
    short = replace(run.simulation, problem=replace(run.simulation.problem, t1=few.t1))
    result = run_block([replace(run, simulation=short)], job.observer, few)
    if result.refusals:
        raise StudyError(f"{job.path}: {result.refusals[0]}")
    for measure in job.measures:
        compiled_metric(measure.kind)
