"""Runs of drawn models by nothing of qddot's: SymPy's LagrangesMethod for the equations, SciPy's DOP853 for the motion.

python tests/reference_runs.py  writes them anew.
"""

import hashlib
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from random_models import COUNT, SPAN, Case, case
from scipy.integrate import solve_ivp
from sympy import Dummy, Matrix, Symbol, lambdify, symbols, sympify
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

FILE = Path(__file__).parent / "reference_runs.json"
#: When the states are compared, s.
TIMES = (0.3, 0.65, 1.0)
RTOL, ATOL = 1e-12, 1e-13


def digest(case: Case) -> str:
    """Of all that the run depends on."""
    s = case.system
    said = (s.kinetic_energy, s.potential_energy, s.dissipation, sorted(map(str, s.generalized_forces.items())))
    return hashlib.sha256(repr((*map(str, said), case.values, case.drives, case.initial)).encode()).hexdigest()[:16]


def right_side(case: Case) -> Callable[[float, Any], Any]:
    """x' = f(t, x), x = [q, v], from Lagrange's equations as SymPy derives them."""
    s, n = case.system, len(case.system.coordinates)
    plain_q = [coordinate.symbol for coordinate in s.coordinates]
    plain_v = [Symbol(f"qdot_{i + 1}") for i in range(n)]
    q = [dynamicsymbols(str(symbol), real=True) for symbol in plain_q]
    v = [each.diff(dynamicsymbols._t) for each in q]
    values = {Symbol(name): value for name, value in case.values.items()}
    moving = dict(zip([*plain_q, *plain_v], [*q, *v], strict=True))
    T, Pi = (sympify(each).subs(values).xreplace(moving) for each in (s.kinetic_energy, s.potential_energy))
    method = LagrangesMethod(T - Pi, q)
    method.form_lagranges_equations()
    real = {old: Dummy(str(old), real=True) for old in (*plain_q, *plain_v)}
    Phi = sympify(s.dissipation).subs(values).xreplace(real)
    back = {new: moving[old] for old, new in real.items()}
    others = [
        sympify(s.generalized_forces.get(plain_q[i], 0)).subs(values) - Phi.diff(real[plain_v[i]]).xreplace(back)
        for i in range(n)
    ]
    names, time = list(case.drives), Symbol("t")
    M, f = method.mass_matrix.doit(), (method.forcing + Matrix(others)).doit()
    for moved, plain in ((v, plain_v), (q, plain_q), ([dynamicsymbols._t], [time])):  # rates first: they hold the rest
        M, f = (each.xreplace(dict(zip(moved, plain, strict=True))) for each in (M, f))
    arguments = (time, plain_q, plain_v, symbols(names) if len(names) > 1 else [Symbol(names[0])])
    known = [
        {"Heaviside": lambda x, at_zero=0.5: 0.0 if x < 0 else 1.0 if x > 0 else at_zero, "sign": np.sign},
        "numpy",
    ]
    equations = lambdify(arguments, (M, f), modules=known, cse=True)

    def slopes(t: float, x: Any) -> Any:
        u = [case.drives[name].at(t)[0] for name in names]
        mass, force = equations(t, x[:n], x[n:], u)
        return np.concatenate([x[n:], np.linalg.solve(mass, np.asarray(force, dtype=float)[:, 0])])

    return slopes


def reference(case: Case) -> tuple[Any, Any]:
    """States (3, 2n) at TIMES, and the first acceleration there, (3,); the run stops at each corner of an input."""
    slopes, names = right_side(case), [str(coordinate.symbol) for coordinate in case.system.coordinates]
    x = np.array([case.initial[name] for name in (*names, *(f"qdot{name.removeprefix('q')}" for name in names))])
    corners = {time for drive in case.drives.values() for time in drive.breaks}
    found = []
    for start, end in pairwise(sorted({*SPAN, *TIMES, *corners})):
        inside = lambda t, x, start=start, end=end: slopes(min(max(t, start), end - 1e-12), x)  # noqa: E731
        x = solve_ivp(inside, (start, end), x, method="DOP853", rtol=RTOL, atol=ATOL, max_step=0.02).y[:, -1]
        if end in TIMES:
            found.append(x)
    accelerations = [slopes(t - 1e-12, x)[len(names)] for t, x in zip(TIMES, found, strict=True)]
    return np.array(found), np.array(accelerations)


def stored() -> dict[str, Any]:
    """What was written: number -> digest, states, accelerations."""
    content: dict[str, Any] = json.loads(FILE.read_text())
    return content


def write() -> None:
    """Write the runs of all models."""
    lines = {}
    for number in range(COUNT):
        one = case(number)
        states, accelerations = reference(one)
        lines[str(number)] = {"digest": digest(one), "x": states.tolist(), "a": accelerations.tolist()}
    body = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in lines.items())
    FILE.write_text(f"{{\n{body}\n}}\n")


if __name__ == "__main__":
    write()
