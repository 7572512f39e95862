"""CasADi: SUNDIALS' cvodes over SX expressions; and Lagrange's equations by its Jacobians."""

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import casadi
import numpy as np
import sympy

from benchmarks.cases.case import Case, Floats, Run, accelerations, in_parts
from qddot.model.system import System, t


def one(case: Case) -> Callable[[float], Run]:
    """The first run by cvodes, an integrator for each part."""
    n = case.n
    x, time, peak = casadi.SX.sym("x", 2 * n), casadi.SX.sym("t"), casadi.SX.sym("peak")
    rows = accelerations(case, time, casadi.vertsplit(x), peak, case.given[0].tolist(), casadi)
    equations = {"x": x, "t": time, "p": peak, "ode": casadi.vertcat(x[n:], *rows)}

    def at(tolerance: float) -> Run:
        options = {"reltol": tolerance, "abstol": tolerance * case.atol, "max_num_steps": 10_000_000}
        edges = [0.0, *(float(until[0]) for until, _ in case.parts)]
        by_start = {
            start: casadi.integrator("run", "cvodes", equations, start, [end], options)
            for start, end in pairwise(edges)
        }

        def advance(x: Floats, t: float, until: float, peak: float) -> Floats:
            return np.array(by_start[t](x0=x, p=peak)["xf"]).ravel()

        return in_parts(case, advance)

    return at


FUNCTIONS = {"sin": casadi.sin, "cos": casadi.cos}


class Energies:
    """T, Pi, Phi and Q of a system as SX expressions of t, its coordinates, rates, inputs, their rates, parameters.

    functions: CasADi's by SymPy's names, those in the energies at least. prepared(expression): what is translated.
    """

    def __init__(
        self,
        system: System,
        functions: Mapping[str, Any] = FUNCTIONS,
        prepared: Callable[[sympy.Expr], sympy.Expr] = lambda expression: expression,
    ) -> None:
        q, v = [c.symbol for c in system.coordinates], [c.rate for c in system.coordinates]
        u, udot = [i.symbol for i in system.inputs], [i.rate for i in system.inputs]
        symbols = [t, *q, *v, *u, *udot, *(p.symbol for p in system.parameters)]
        twins = {symbol: casadi.SX.sym(symbol.name) for symbol in symbols}
        self.arguments = list(twins.values())
        self.q, self.v, self.u, self.udot = (_column([twins[s] for s in row]) for row in (q, v, u, udot))
        self.t = twins[t]

        def translated(expression: sympy.Expr | float) -> casadi.SX:
            written = prepared(system.written_out(expression))
            return casadi.SX(sympy.lambdify(symbols, written, modules=[dict(functions)])(*self.arguments))

        self.kinetic, self.potential = translated(system.kinetic_energy), translated(system.potential_energy)
        self.dissipation = translated(system.dissipation)
        self.forces = _column([translated(system.force(c)) for c in system.coordinates])

    def equations(self) -> tuple[casadi.SX, casadi.SX]:
        """M and f of M a = f."""
        L = self.kinetic - self.potential
        momenta = casadi.gradient(L, self.v)
        drift = casadi.jtimes(momenta, self.q, self.v) + casadi.jacobian(momenta, self.t)
        if self.u.numel():
            drift += casadi.jtimes(momenta, self.u, self.udot)
        f = self.forces - casadi.gradient(self.dissipation, self.v) + casadi.gradient(L, self.q) - drift
        return casadi.jacobian(momenta, self.v), f

    def right_hand_side(self) -> casadi.Function:
        """Accelerations, solved for by the L D L^T of CasADi's symbols, as a function that CasADi can evaluate."""
        M, f = self.equations()
        return casadi.Function("a", self.arguments, [casadi.ldl_solve(f, *casadi.ldl(M))])


def operations(function: casadi.Function) -> int:
    """Arithmetic and function calls of an SX function."""
    moved = (casadi.OP_INPUT, casadi.OP_OUTPUT, casadi.OP_CONST, casadi.OP_PARAMETER, casadi.OP_NEG)
    return sum(function.instruction_id(k) not in moved for k in range(function.n_instructions()))


def _column(rows: list[casadi.SX]) -> casadi.SX:
    return casadi.vertcat(*rows) if rows else casadi.SX(0, 1)
