"""PyDy: its generated right-hand side, integrated by SciPy."""

from collections.abc import Callable

import numpy as np
import sympy
from pydy.codegen.ode_function_generators import generate_ode_function
from scipy.integrate import solve_ivp
from sympy.physics.mechanics import dynamicsymbols

from benchmarks.cases.case import Case, Floats, Run, in_parts


def one(case: Case, generator: str) -> Callable[[float], Run]:
    """The first run by DOP853; where there is a mass matrix, PyDy solves for the accelerations in every call."""
    q, v = (list(dynamicsymbols(f"{name}_:{case.n}")) for name in ("q", "v"))
    time, peak = dynamicsymbols("time"), dynamicsymbols("peak")
    M, forces = case.equations(time, q, v, peak, case.given[0].tolist(), sympy)
    settings = {
        "specifieds": [time, peak],
        "constants_arg_type": "array",
        "specifieds_arg_type": "array",
        "generator": generator,
    }
    unused = [sympy.Symbol("unused")]  # its Cython generator takes no array of no constants
    if M is None:
        rhs = generate_ode_function(sympy.Matrix([*v, *forces]), q, v, unused, **settings)
    else:
        settings |= {"mass_matrix": sympy.Matrix(M), "coordinate_derivatives": sympy.Matrix(v)}
        rhs = generate_ode_function(sympy.Matrix(forces), q, v, unused, **settings)
    none = np.zeros(1)

    def at(tolerance: float) -> Run:
        def advance(x: Floats, t: float, until: float, peak: float) -> Floats:
            def derivative(t: float, x: Floats) -> Floats:
                return rhs(x, t, np.array([t, peak]), none).copy()  # it fills one array over and over

            options = {"method": "DOP853", "rtol": tolerance, "atol": tolerance * case.atol}
            return solve_ivp(derivative, (t, until), x, **options).y[:, -1]

        return in_parts(case, advance)

    return at
