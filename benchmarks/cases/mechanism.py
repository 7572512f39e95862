"""Mechanisms held together by constraints, for every tool: M a + G' l = f, G a = gamma, derived apart by SymPy."""

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy
from numba import njit
from sympy import Rational, Symbol, cos, sin, sqrt, symbols

import qddot
from benchmarks.cases.case import Case, Floats
from benchmarks.cases.reference import by_scipy
from qddot.model import Constraint, Coordinate, Parameter
from qddot.model.system import System
from qddot.runner.load import Model

HALF = Rational(1, 2)
#: Where Andrews' mechanism starts, to the digits published.
SQUEEZER_START = {
    "beta": -0.0617138900142764496358948458001,
    "theta": 0.0,
    "gamma": 0.455279819163070380255912382449,
    "phi": 0.222668390165885884674473185609,
    "delta": 0.487364979543842550225598953530,
    "omega": -0.222668390165885884674473185609,
    "epsilon": 1.23054744454982119249735015568,
}


def held(model: Model, system: System, start: Floats, end: float) -> Case:
    """A run of a model with constraints on positions; other tools hold these by their second derivatives."""
    c = model.constants(model.parameter_values())
    return Case(
        model=model,
        starts=start[None],
        constants=c[None],
        given=np.zeros((1, 0)),
        parts=((np.full(1, end), 0.0),),
        equations=equations_of(system),
        inputs=_no_inputs,
        one=lambda case: {},
        many=lambda case: {},
        solution=by_scipy,
        atol=1.0,
    )


def andrews(folder_of: Callable[[System], Model]) -> Case:
    """Andrews' squeezing mechanism over its 0.03 s."""
    system = squeezer()
    model = folder_of(system)
    return held(model, system, qddot.assemble(model, SQUEEZER_START), 0.03)


def turning(system: System, model: Model) -> Case:
    """The four-bar over 5 s, in which its crank turns more than twice."""
    start = qddot.assemble(model, {"theta_1": 0.4, "thetadot_1": 9.0}, guess={"theta_2": 0.6, "theta_3": 1.5})
    return held(model, system, start, 5.0)


def equations_of(system: System) -> Callable[..., Any]:
    """Rows [M G'; G 0] and [f, gamma] of Lagrange's equations, in any tool's own expressions."""
    q, v = ([getattr(c, name) for c in system.coordinates] for name in ("symbol", "rate"))
    values = {p.symbol: p.default for p in system.parameters} | {u.symbol: 0 for u in system.inputs}
    T, Pi, *others = (
        system.written_out(each).subs(values)
        for each in (
            system.kinetic_energy,
            system.potential_energy,
            *map(system.force, system.coordinates),
            *(each.expression for each in system.constraints),
        )
    )
    Q, f = others[: len(q)], sympy.Matrix(others[len(q) :])
    momenta, G = sympy.Matrix([T.diff(each) for each in v]), f.jacobian(q)
    M, speeds = momenta.jacobian(v), sympy.Matrix(v)
    forces = sympy.Matrix(Q) - momenta.jacobian(q) * speeds + sympy.Matrix([(T - Pi).diff(each) for each in q])
    rows = sympy.Matrix([[M, G.T], [G, sympy.zeros(len(f))]])
    right = sympy.Matrix([forces, -(G * speeds).jacobian(q) * speeds])
    entries = sorted({(max(at), min(at)): each for at, each in rows.todok().items()}.items())
    values_of: dict[Any, Any] = {}

    def equations(t: Any, q_: Any, v_: Any, peak: Any, given: Any, f: Any) -> tuple[list[list[Any]], list[Any]]:
        if f not in values_of:
            functions = {"sin": f.sin, "cos": f.cos, "sqrt": f.sqrt}
            found = [[each for _, each in entries], list(right)]
            values_of[f] = sympy.lambdify([*q, *v], found, modules=[functions], cse=True)
        kept, forces = values_of[f](*q_, *v_)
        whole: list[list[Any]] = [[0.0] * len(forces) for _ in forces]
        for ((i, j), _), value in zip(entries, kept, strict=True):
            whole[i][j] = whole[j][i] = value
        return whole, forces

    return equations


@njit
def _no_inputs(t, peak, given, u):
    pass


def squeezer():
    """Andrews' squeezing mechanism: Hairer & Wanner II, section VII.7, and the test set of Bari."""
    beta, theta, gamma, phi, delta, omega, epsilon = q = symbols("beta theta gamma phi delta omega epsilon")
    v = [Symbol(f"{name}dot") for name in map(str, q)]
    m = dict(zip(range(1, 8), (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498), strict=True))
    inertia = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
    i = dict(zip(range(1, 8), inertia, strict=True))
    xa, ya, xb, yb, xc, yc, c_0, l_0 = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072, 4530.0, 0.07785
    d, da, e, ea, rr, ra, ss, sa = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092, 0.035, 0.01874
    sb, sc, sd, ta, tb, u, ua, ub = 0.01043, 0.018, 0.02, 0.02308, 0.00916, 0.04, 0.01228, 0.00449
    zf, zt, fa = 0.02, 0.04, 0.01421
    mass = {
        (0, 0): m[1] * ra**2 + m[2] * (rr**2 - 2 * da * rr * cos(theta) + da**2) + i[1] + i[2],
        (1, 0): m[2] * (da**2 - da * rr * cos(theta)) + i[2],
        (1, 1): m[2] * da**2 + i[2],
        (2, 2): m[3] * (sa**2 + sb**2) + i[3],
        (3, 3): m[4] * (e - ea) ** 2 + i[4],
        (4, 3): m[4] * ((e - ea) ** 2 + zt * (e - ea) * sin(phi)) + i[4],
        (4, 4): m[4] * (zt**2 + 2 * zt * (e - ea) * sin(phi) + (e - ea) ** 2) + m[5] * (ta**2 + tb**2) + i[4] + i[5],
        (5, 5): m[6] * (zf - fa) ** 2 + i[6],
        (6, 5): m[6] * ((zf - fa) ** 2 - u * (zf - fa) * sin(omega)) + i[6],
        (6, 6): m[6] * ((zf - fa) ** 2 - 2 * u * (zf - fa) * sin(omega) + u**2) + m[7] * (ua**2 + ub**2) + i[6] + i[7],
    }
    xd, yd = sd * cos(gamma) + sc * sin(gamma) + xb, sd * sin(gamma) - sc * cos(gamma) + yb
    spring = sqrt((xd - xc) ** 2 + (yd - yc) ** 2)
    x, y = rr * cos(beta) - d * cos(beta + theta), rr * sin(beta) - d * sin(beta + theta)
    closed = (
        x - ss * sin(gamma) - xb,
        y + ss * cos(gamma) - yb,
        x - e * sin(phi + delta) - zt * cos(delta) - xa,
        y + e * cos(phi + delta) - zt * sin(delta) - ya,
        x - zf * cos(omega + epsilon) - u * sin(epsilon) - xa,
        y - zf * sin(omega + epsilon) + u * cos(epsilon) - ya,
    )
    names = symbols("lam_1:7")
    return System(
        name="squeezer",
        title="Andrews' squeezing mechanism",
        coordinates=[Coordinate(each, "rad", "angle") for each in q],
        parameters=[Parameter(Symbol("mom"), 0.033, "N m", "torque of the motor")],
        kinetic_energy=HALF * sum((1 if k == j else 2) * entry * v[k] * v[j] for (k, j), entry in mass.items()),
        potential_energy=HALF * c_0 * (spring - l_0) ** 2,
        generalized_forces={beta: Symbol("mom")},
        constraints=[Constraint(name, f, "N", "a pin") for name, f in zip(names, closed, strict=True)],
    )
