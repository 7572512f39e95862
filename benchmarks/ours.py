"""qddot over the cases: one run, prepared beforehand, and batches from their starts to their final states."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit, prange

import qddot
from benchmarks.cases.case import Case, Floats, Run
from benchmarks.peers import THREADS, compiled
from qddot.model.system import System
from qddot.runner.load import Model


def derived(system: System, folder: Path) -> Model:
    """A model that is not checked in, generated into a folder."""
    return qddot.load(qddot.generate(system, folder))


def one(case: Case, method: str, **options: Any) -> Callable[[float], Run]:
    """The first run; the ends of its parts are found by qddot itself. options: those of `prepare`."""
    options = options or {"output_times": [case.end]}
    settings: dict[str, Any] = {"method": method, "initial": case.starts[0], **options, **case.one(case)}

    def at(tolerance: float) -> Run:
        free = not tolerance or method == "exact"
        tolerances: dict[str, Any] = {} if free else {"rtol": tolerance, "atol": tolerance * case.atol}
        simulation = qddot.prepare(case.model, (0.0, case.end), **settings, **tolerances)
        return lambda: simulation(case.starts[0]).states[-1:]

    return at


def many(case: Case, method: str, keywords: Any = None, step: float | None = None) -> Callable[[float], Run]:
    """All runs: in lanes, by exact propagation by the block. keywords(case): others than the case's own."""
    given: dict[str, Any] = {
        "method": method,
        "initial": case.starts,
        "threads": THREADS,
        **(keywords or case.many)(case),
    }
    steps: dict[str, Any] = {} if step is None else {"step": step}

    def at(tolerance: float) -> Run:
        free = step or method == "exact"
        tolerances: dict[str, Any] = {} if free else {"rtol": tolerance, "atol": tolerance * case.atol}

        def run() -> Floats:
            batch = qddot.simulate_batch(case.model, (0, case.end), **given, **steps, **tolerances)
            if not batch.success.all() or batch.in_lanes == (method == "exact"):
                raise RuntimeError("a run failed, or did not go the way it should")
            return batch.final

        return run

    return at


def scalar_rk4(case: Case, step: float) -> Run:
    """Our own scalar kernel in a loop over runs by numba's prange."""
    march, count = _march(case.model.kernel("rhs"), case.inputs), round(case.end / step)
    until, peaks = np.array([until for until, _ in case.parts]).T.copy(), np.array([peak for _, peak in case.parts])
    arrays = (case.starts, case.constants, case.given, until, peaks)
    return lambda: march(*arrays, compiled.channels(case), step, count)


def _march(rhs: Any, inputs: Any) -> Any:
    @njit(parallel=True, fastmath={"contract", "nsz"}, error_model="numpy")
    def march(starts, constants, given, until, peaks, channels, step, count):
        final = np.empty_like(starts)
        for run in prange(len(starts)):
            x, c, n, u = starts[run].copy(), constants[run], starts.shape[1], np.zeros(channels)
            k1, k2, k3, k4, y = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
            inputs(0.0, _peak(until[run], peaks, 0.0), given[run], u)
            for k in range(count):
                t = k * step
                rhs(t, x, u, c, k1)
                for i in range(n):
                    y[i] = x[i] + 0.5 * step * k1[i]
                inputs(t + 0.5 * step, _peak(until[run], peaks, t + 0.5 * step), given[run], u)
                rhs(t + 0.5 * step, y, u, c, k2)
                for i in range(n):
                    y[i] = x[i] + 0.5 * step * k2[i]
                rhs(t + 0.5 * step, y, u, c, k3)
                for i in range(n):
                    y[i] = x[i] + step * k3[i]
                inputs(t + step, _peak(until[run], peaks, t + step), given[run], u)
                rhs(t + step, y, u, c, k4)
                for i in range(n):
                    x[i] += step / 6 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
            final[run] = x
        return final

    return march


@njit
def _peak(until, peaks, t):
    """The recoil's peak in the part of a run that holds t."""
    part = 0
    while part < len(until) - 1 and t >= until[part]:
        part += 1
    return peaks[part]
