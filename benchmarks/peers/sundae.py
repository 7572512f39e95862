"""scikit-sundae: SUNDIALS' IDA over M v' + G' l = f, G v' = gamma, by what SymPy's lambdify gives."""

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy
from sksundae.ida import IDA

from benchmarks.cases.case import Case, Floats, Run, in_parts


def one(case: Case) -> Callable[[float], Run]:
    """The first run, a differential-algebraic system in [q, v, multipliers]."""
    n, t, peak, x = case.n, sympy.Symbol("t"), sympy.Symbol("peak"), sympy.symbols(f"x_:{2 * case.n}")
    rows, right = case.equations(t, x[:n], x[n:], peak, case.given[0].tolist(), sympy)
    function = sympy.lambdify([t, peak, *x], [rows, right], modules="math", cse=True)
    multipliers = list(range(2 * n, n + len(right)))

    def residual(t: float, y: Floats, yp: Floats, res: Floats, peak: float) -> None:
        M, f = function(t, peak, *y[: 2 * n].tolist())
        res[:n] = yp[:n] - y[n : 2 * n]
        res[n:] = np.asarray(M) @ np.concatenate([yp[n : 2 * n], y[2 * n :]]) - f

    def at(tolerance: float) -> Run:
        def advance(x: Floats, t: float, until: float, peak: float) -> Floats:
            M, f = function(t, peak, *x.tolist())
            solved = np.linalg.solve(M, f)
            start = np.concatenate([x, solved[n:]])
            slopes = np.concatenate([x[n:], solved[:n], 0.0 * solved[n:]])
            options: dict[str, Any] = {"rtol": tolerance, "atol": tolerance * case.atol, "max_num_steps": 10_000_000}
            options |= {"algebraic_idx": multipliers} if multipliers else {}
            solver = IDA(lambda t, y, yp, res: residual(t, y, yp, res, peak), **options)
            found = solver.solve([t, until], start, slopes)
            if not found.success:
                raise RuntimeError(found.message)
            return np.array(found.y[-1][: 2 * n])

        return in_parts(case, advance)

    return at
