"""A loop over SciPy's solve_ivp on runs of studies/terrain_monte_carlo.toml, beside the blocks of a batch."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from qddot.runner.batch.block import compute, warm_up
from qddot.runner.batch.job import Job, read_job
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.simulate import Simulation

STUDY = Path(__file__).parent.parent / "studies" / "terrain_monte_carlo.toml"


def by_scipy(simulation: Simulation, times: np.ndarray) -> np.ndarray:
    """States (n, n_states) at times by RK45, rtol 1e-6, with our compiled right-hand side and inputs, a call each."""
    problem = simulation.problem
    reader, u, dx = reader_for(problem.inputs), np.zeros(len(problem.inputs.first)), np.zeros(len(problem.state_names))

    def rhs(t: float, x: np.ndarray) -> np.ndarray:
        evaluate(problem.inputs, reader, t, t, problem.n_inputs, u)
        problem.rhs(t, x, u, problem.constants, dx)
        return dx.copy()

    span, start = (problem.t0, problem.t1), problem.initial_state
    return solve_ivp(rhs, span, start, rtol=1e-6, atol=1e-9, max_step=0.01, t_eval=times).y.T


def timed(job: Job, runs: int, by_hand: int) -> str:
    """Runs per second of one core in a block, and in the loop; and how far their final states are apart."""
    job = replace(job, block=runs)
    warm_up(job)
    start = time.process_time()
    block = compute(job, 1)
    ours = runs / (time.process_time() - start)
    by_scipy(job.prepared(runs).simulation, job.sampling.times)
    start = time.process_time()
    theirs = [by_scipy(job.prepared(runs + i).simulation, job.sampling.times) for i in range(by_hand)]
    loop = by_hand / (time.process_time() - start)
    apart = max(np.abs(x[-1] - y).max() for x, y in zip(theirs, block.rows["final_state"], strict=False))
    return (
        f"a block {ours:.3g} runs/s of one core, solve_ivp {loop:.3g} runs/s: {ours / loop:.3g} times as fast; "
        f"final states {apart:.1e} apart"
    )


if __name__ == "__main__":
    print(timed(read_job(STUDY), 128, 3))
