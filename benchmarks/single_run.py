"""One run of the M113's single shot, beside what a Python user writes by hand: lambdify and solve_ivp."""

import numpy as np
import sympy
from scipy.integrate import solve_ivp

import qddot
from benchmarks.timing import Timing, interleaved
from model.m113 import system as m113

SHOT = {"times": [1.0], "duration": 0.1, "impulse": 605.0}


def groups(quick: bool) -> dict[str, list[Timing]]:
    """RK4 at 1e-4 for 10 s, and SciPy's RK45 and DOP853 over a lambdified right-hand side at rtol 1e-6."""
    model = qddot.load("m113")
    inputs = {"F": qddot.pulse_train(**SHOT)}
    start = qddot.equilibrium(model, "as_run_unloaded")

    def ours() -> object:
        case = {"parameters": "as_run_unloaded", "inputs": inputs, "initial": start}
        return qddot.simulate(model, (0, 10), method="rk4", step=1e-4, every=100, **case)

    rhs = lambdified(model, start)
    contenders = {"qddot rk4, step 1e-4, 100 000 steps": ours}
    for method in ("RK45", "DOP853"):
        contenders[f"SciPy {method} on lambdify, rtol 1e-6"] = lambda method=method: solve_ivp(
            rhs, (0, 10), start, method=method, rtol=1e-6, atol=1e-9, max_step=0.05
        )
    return {"M113, one shot, 10 s": interleaved(contenders, 1 if quick else 3)}


def lambdified(model, start):
    """The right-hand side of the M113 as SymPy's lambdify makes it, NumPy arrays in and out."""
    system = m113()
    q = [c.symbol for c in system.coordinates]
    v = [c.rate for c in system.coordinates]
    values = {p.symbol: p.default for p in system.parameters} | {s: 0.0 for s in sympy.symbols("z_1:6")}
    expand = system.written_out
    T, potential, phi = map(expand, (system.kinetic_energy, system.potential_energy, system.dissipation))
    rows = [
        (expand(system.force(c)) - potential.diff(c.symbol) - phi.diff(c.rate)) / T.diff(c.rate, 2)
        for c in system.coordinates
    ]
    force = sympy.Symbol("F")
    accelerations = sympy.lambdify([*q, *v, force], [row.subs(values) for row in rows], modules="math", cse=True)

    def rhs(t, x):
        inside = 0.0 <= t - 1.0 <= 0.1
        pulse = 605.0 * np.pi / 0.2 * np.sin(np.pi * (t - 1.0) / 0.1) if inside else 0.0
        return [*x[7:], *accelerations(*x, pulse)]

    return rhs
