"""SciPy's solve_ivp: over our generated right-hand side, and over what SymPy's lambdify gives a Python user."""

from collections.abc import Callable

import numpy as np
import sympy
from numba import njit
from scipy.integrate import solve_ivp

from benchmarks.cases.case import Case, Floats, Run, in_parts
from benchmarks.peers import compiled


def one(case: Case, method: str) -> Callable[[float], Run]:
    """A jitted right-hand side."""
    function, numbers = compiled.derivative(case), compiled.numbers(case)[0]

    @njit
    def derivative(t, x, p):
        dx = np.empty(len(x))
        function(t, x, p, dx)
        return dx

    by_peak = {peak: numbers[part] for part, (_, peak) in enumerate(case.parts)}
    return _solved(case, method, lambda peak: lambda t, x: derivative(t, x, by_peak[peak]))


def lambdified(case: Case, method: str) -> Callable[[float], Run]:
    """NumPy arrays in and out, from SymPy expressions with common subexpressions named."""
    n, t, peak, x = case.n, sympy.Symbol("t"), sympy.Symbol("peak"), sympy.symbols(f"x_:{2 * case.n}")
    M, forces = case.equations(t, x[:n], x[n:], peak, case.given[0].tolist(), sympy)
    function = sympy.lambdify([t, peak, *x], [M or [], forces], modules="math", cse=True)

    def derivative(t: float, x: Floats, peak: float) -> list[float]:
        M, forces = function(t, peak, *x.tolist())
        return [*x[n:], *(np.linalg.solve(M, forces)[:n] if M else forces)]

    return _solved(case, method, lambda peak: lambda t, x: derivative(t, x, peak))


def _solved(case: Case, method: str, derivative: Callable[[float], Callable[..., object]]) -> Callable[[float], Run]:
    def at(tolerance: float) -> Run:
        settings = {"method": method, "rtol": tolerance, "atol": tolerance * case.atol}

        def advance(x: Floats, t: float, until: float, peak: float) -> Floats:
            return solve_ivp(derivative(peak), (t, until), x, **settings).y[:, -1]

        return in_parts(case, advance)

    return at
