"""Reference solutions that share no code with what is measured."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.cases.case import Case, Floats, accelerations

#: Coordinates of one run up to which its reference is taken in long double, by more digits than any tool has.
FEW = 8
#: Midpoint steps of the extrapolation, which makes it of order 16; least steps of it, and what halving them may change.
_ROUNDS, _STEPS, _AGREED = range(2, 17, 2), 32, 1e-15


def precisely(case: Case) -> Floats:
    """Final states (runs, 2n): of one run of few coordinates to the last digit, of others to some 1e-12."""
    longer = np.finfo(np.longdouble).eps < np.finfo(np.float64).eps
    return by_extrapolation(case) if longer and case.runs == 1 and case.n <= FEW else by_scipy(case)


def by_extrapolation(case: Case) -> Floats:
    """Final states (1, 2n) of one run by Gragg's midpoint rule, extrapolated, in long double.

    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.9. Steps are halved
    until that changes nothing. SciPy's own tightest tolerance leaves an error of 1e-12.
    """
    n, x, t = case.n, case.starts[0].astype(np.longdouble), np.longdouble(0.0)
    for until, peak in case.parts:

        def derivative(t: Any, x: Any, peak: float = peak) -> Any:
            found = accelerations(case, t, x, peak, case.given[0], np)
            return np.concatenate([x[n:], np.array(found, dtype=np.longdouble)])

        x = _converged(derivative, t, np.longdouble(until[0]), x)
        t = np.longdouble(until[0])
    return x[None].astype(np.float64)


def _converged(derivative: Callable[[Any, Any], Any], t: Any, end: Any, x: Any) -> Any:
    steps, found = _STEPS, None
    while True:
        before, found = found, _extrapolated(derivative, t, end, x, steps)
        if before is not None and np.abs(found - before).max() <= _AGREED * np.abs(found).max():
            return found
        steps *= 2


def _extrapolated(derivative: Callable[[Any, Any], Any], t: Any, end: Any, x: Any, steps: int) -> Any:
    H = (end - t) / steps
    for k in range(steps):
        rows: list[Any] = []
        for count in _ROUNDS:
            row = [_midpoint(derivative, t + k * H, H, x, count)]
            for j, before in enumerate(rows, 1):
                row.append(row[-1] + (row[-1] - before) / ((count / _ROUNDS[len(rows) - j]) ** 2 - 1.0))
            rows = row
        x = rows[-1]
    return x


def _midpoint(derivative: Callable[[Any, Any], Any], t: Any, H: Any, x: Any, count: int) -> Any:
    h = H / count
    older, newer = x, x + h * derivative(t, x)
    for m in range(1, count):
        older, newer = newer, older + 2 * h * derivative(t + m * h, newer)
    return (older + newer + h * derivative(t + H, newer)) / 2


def by_scipy(case: Case) -> Floats:
    """Final states (runs, 2n) by SciPy's DOP853 at the tightest tolerance it takes, over `case.equations`."""
    return np.array([_one(case, run) for run in range(case.runs)])


def _one(case: Case, run: int) -> Floats:
    n, given, x, t = case.n, case.given[run].tolist(), case.starts[run], 0.0
    for until, peak in case.parts:

        def derivative(t: float, x: Floats, peak: float = peak) -> Floats:
            state = x.tolist()
            M, forces = case.equations(t, state[:n], state[n:], peak, given, math)
            return np.concatenate([x[n:], forces if M is None else np.linalg.solve(M, forces)[:n]])

        span = (t, float(until[run]))
        x = solve_ivp(derivative, span, x, method="DOP853", rtol=3e-14, atol=1e-13 * case.atol).y[:, -1]
        t = span[1]
    return x
