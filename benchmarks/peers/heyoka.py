"""heyoka.py: Taylor's method, compiled for one run and for a batch of as many runs as a SIMD register holds."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import heyoka as hy
import numpy as np

from benchmarks.cases.case import Case, Floats, Run, accelerations, in_parts
from benchmarks.peers import THREADS

#: Coordinates from which on the step is compiled as loops: written out it takes LLVM minutes.
COMPACT = 20


def one(case: Case) -> Callable[[float], Run]:
    """taylor_adaptive; the numbers of the run are written into its equations."""
    equations = _equations(case, case.given[0].tolist())
    pulsed, compact = len(case.parts) > 1, case.n > COMPACT or bool(case.model.tables.constraints)

    def at(tolerance: float) -> Run:
        settings = {"tol": tolerance, "compact_mode": compact, "pars": [0.0] if pulsed else []}
        integrator = hy.taylor_adaptive(equations, case.starts[0], **settings)

        def advance(x: Floats, t: float, until: float, peak: float) -> Floats:
            integrator.time = t
            integrator.state[:] = x
            if pulsed:
                integrator.pars[0] = peak
            integrator.propagate_until(until)
            return integrator.state

        return in_parts(case, advance)

    return at


def many(case: Case) -> Callable[[float], Run]:
    """taylor_adaptive_batch, a batch a thread at a time; every lane restarts at the ends of its own parts."""
    columns = case.given.shape[1]
    equations = _equations(case, [hy.par[1 + i] for i in range(columns)])
    width, pulsed = hy.recommended_simd_size(), len(case.parts) > 1
    chunks = [np.arange(i, i + width) % case.runs for i in range(0, case.runs, width)]
    final = np.empty_like(case.starts)

    def at(tolerance: float) -> Run:
        pars = np.zeros((1 + columns if pulsed else 0, width))
        first = hy.taylor_adaptive_batch(equations, np.zeros((2 * case.n, width)), tol=tolerance, pars=pars)
        copies = [first.__copy__() for _ in range(THREADS)]

        def work(thread: int) -> None:
            integrator = copies[thread]
            for chosen in chunks[thread::THREADS]:
                integrator.set_time(0.0)
                integrator.state[:] = case.starts[chosen].T
                for until, peak in case.parts:
                    if pulsed:
                        integrator.pars[0], integrator.pars[1:] = peak, case.given[chosen].T
                    integrator.propagate_until(until[chosen])
                final[chosen] = integrator.state.T

        pool = ThreadPoolExecutor(THREADS)

        def run() -> Floats:
            list(pool.map(work, range(THREADS)))
            return final

        return run

    return at


def _equations(case: Case, given: list[Any]) -> list[tuple[Any, Any]]:
    x = hy.make_vars(*(f"x_{i}" for i in range(2 * case.n)))
    rows = [*x[case.n :], *accelerations(case, hy.time, x, hy.par[0], given, hy)]
    return [(left, hy.expression(0.0) + right) for left, right in zip(x, rows, strict=True)]
