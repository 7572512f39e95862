"""Reference solutions that share no code with what is measured."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.cases.case import Case, Floats


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
