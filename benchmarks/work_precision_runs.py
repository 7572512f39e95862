"""Runs for work-precision diagrams: one problem, one method, a row of tolerances."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.problems import Problem
from qddot.runner.problem import Status

#: A run: rtol to the final state (n,) and the number of evaluations of the right-hand side.
Run = Callable[[float], tuple[NDArray[np.float64], int]]

NON_STIFF_METHODS = ("ode23", "ode45", "tsit5", "dop853", "vern7")
STIFF_METHODS = ("ode15s", "rodas5p")
SCIPY = "SciPy "
NON_STIFF_PEERS = (SCIPY + "RK45", SCIPY + "DOP853", SCIPY + "LSODA")
STIFF_PEERS = (SCIPY + "Radau", SCIPY + "BDF", SCIPY + "LSODA")


@dataclass(frozen=True)
class Point:
    """One run: significant correct digits, evaluations, seconds; `failure` says why there is no result."""

    problem: str
    method: str
    rtol: float
    digits: float = np.nan
    evaluations: int = 0
    least: float = np.nan
    median: float = np.nan
    failure: str = ""


class FailureError(RuntimeError):
    """A run that did not reach the end."""


def points(problem: Problem, method: str, rtols: Iterable[float], repeats: int, longest: float) -> list[Point]:
    """Points from loose to tight tolerances, after one run that does not count.

    A run of more than longest/8 seconds is not repeated. Tolerances tighter than that of a run longer than `longest`
    are left out.
    """
    run = _scipy(problem, method.removeprefix(SCIPY), longest) if method.startswith(SCIPY) else _ours(problem, method)
    found: list[Point] = []
    for rtol in sorted(rtols, reverse=True):
        try:
            if not found:
                _timed(run, rtol, 1, longest)
            state, evaluations, seconds = _timed(run, rtol, repeats, longest / 8)
        except FailureError as failure:
            found.append(Point(problem.name, method, rtol, failure=str(failure)))
            if str(failure) == Status.TIME_LIMIT.name:
                break
            continue
        digits = problem.significant_digits(state)
        found.append(Point(problem.name, method, rtol, digits, evaluations, min(seconds), median(seconds)))
        if seconds[0] > longest:
            break
    return found


def _timed(run: Run, rtol: float, repeats: int, long: float) -> tuple[NDArray[np.float64], int, list[float]]:
    seconds: list[float] = []
    while len(seconds) < repeats:
        start = time.perf_counter()
        state, evaluations = run(rtol)
        seconds.append(time.perf_counter() - start)
        if seconds[0] > long:
            break
    return state, evaluations, seconds


def _ours(problem: Problem, method: str) -> Run:
    def run(rtol: float) -> tuple[NDArray[np.float64], int]:
        trajectory = problem.solve(method, rtol)
        if trajectory.status != Status.FINISHED:
            raise FailureError(trajectory.status.name)
        return trajectory.states[-1], trajectory.statistics.evaluations

    return run


def _scipy(problem: Problem, method: str, longest: float) -> Run:
    f, jacobian = problem.function(), problem.jacobian_function()
    options: dict[str, Any] = {} if jacobian is None or method in ("RK45", "DOP853") else {"jac": jacobian}

    def run(rtol: float) -> tuple[NDArray[np.float64], int]:
        # Compilation of f in the first run may take a second.
        end = time.perf_counter() + 2.0 * longest + 1.0

        def within_time(t: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
            if time.perf_counter() > end:
                raise FailureError(Status.TIME_LIMIT.name)
            return f(t, x)

        atol = problem.atol(rtol)
        result = solve_ivp(within_time, problem.span, problem.x0, method=method, rtol=rtol, atol=atol, **options)
        if not result.success:
            raise FailureError(result.message)
        return result.y[:, -1], result.nfev

    return run
