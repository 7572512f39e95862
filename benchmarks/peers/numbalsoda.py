"""numbalsoda: dop853 in C++ over our generated right-hand side, called from a compiled loop over runs."""

from collections.abc import Callable
from typing import Any

import numba
import numbalsoda
import numpy as np
from numba import cfunc, njit, prange

from benchmarks.cases.case import Case, Floats, Run
from benchmarks.peers import THREADS, compiled


def one(case: Case) -> Callable[[float], Run]:
    """The first run."""
    return _prepared(case.first(1), parallel=False)


def many(case: Case) -> Callable[[float], Run]:
    """All runs by numba's prange."""
    return _prepared(case, parallel=True)


def _prepared(case: Case, parallel: bool) -> Callable[[float], Run]:
    march, address = njit(parallel=parallel)(_march), _callback(case).address
    numbers, until = compiled.numbers(case), np.array([until for until, _ in case.parts]).T.copy()

    def at(tolerance: float) -> Run:
        def run() -> Floats:
            numba.set_num_threads(THREADS)
            final = march(address, case.starts, until, numbers, tolerance, tolerance * case.atol)
            if np.isnan(final).any():
                raise RuntimeError("a run failed")
            return final

        return run

    return at


def _callback(case: Case) -> Any:
    derivative = compiled.by_pointers(case)

    @cfunc(numbalsoda.lsoda_sig)
    def callback(t, x, dx, p):
        derivative(t, x, p, dx)

    return callback


def _march(address, starts, until, numbers, rtol, atol):
    final = np.empty_like(starts)
    for run in prange(len(starts)):
        x, t = starts[run].copy(), 0.0
        for part in range(until.shape[1]):
            times = np.array([t, until[run, part]])
            points, success = numbalsoda.dop853(address, x, times, numbers[run, part], rtol, atol, 10_000_000)
            x[:] = points[-1]
            if not success:
                x[:] = np.nan
            t = until[run, part]
        final[run] = x
    return final
