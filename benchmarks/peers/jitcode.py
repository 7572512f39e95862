"""JiTCODE: C from SymEngine's expressions, compiled and integrated by SciPy's dop853."""

import contextlib
import tempfile
from collections.abc import Callable
from typing import Any

import jitcode
import symengine

from benchmarks.cases.case import Case, Floats, Run, accelerations, in_parts


def one(case: Case) -> Callable[[float], Run]:
    """The first run; what is used twice becomes a helper, which JiTCODE computes once."""
    peak = symengine.Symbol("peak")
    helpers: list[tuple[Any, Any]] = []

    def keep(expression: Any) -> Any:
        helpers.append((symengine.Symbol(f"helper_{len(helpers)}"), expression))
        return helpers[-1][0]

    x = [jitcode.y(i) for i in range(2 * case.n)]
    rows = [*x[case.n :], *accelerations(case, jitcode.t, x, peak, case.given[0].tolist(), symengine, keep)]
    pulsed = len(case.parts) > 1
    settings = {"helpers": helpers, "control_pars": [peak] if pulsed else [], "verbose": False}
    ode = jitcode.jitcode(rows, n=2 * case.n, **settings)
    with tempfile.TemporaryDirectory() as elsewhere, contextlib.chdir(elsewhere):
        ode.compile_C()  # setuptools would take a pyproject.toml here for the extension's own

    def at(tolerance: float) -> Run:
        def advance(x: Floats, t: float, until: float, peak: float) -> Floats:
            ode.set_integrator("dop853", rtol=tolerance, atol=tolerance * case.atol, nsteps=1_000_000)
            if pulsed:
                ode.set_parameters(peak)
            ode.set_initial_value(x, t)
            return ode.integrate(until)

        return in_parts(case, advance)

    return at
