"""Derivation and lowering beside SymPy's own LagrangesMethod on the same models."""

from collections.abc import Callable

import sympy
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

import model.chain
import model.m113
import model.pendulum
from benchmarks.timing import Timing, interleaved
from codegen.generate import artefacts
from codegen.lagrange import derive
from codegen.lower import lower, lower_rhs
from model.system import System


def groups(quick: bool) -> dict[str, list[Timing]]:
    """Timings by title; `quick` leaves out what takes minutes."""
    found = {"M113: from the model to all text": interleaved(_contenders("M113", model.m113.system()), 5)}
    for n in (10, 20) if quick else (10, 20, 40, 160):
        found[f"chain of {n}: derive and lower"] = _beside(model.chain.system(n), once=n > 40)
    for n in (2, 3) if quick else (2, 4, 8):
        found[f"pendulum of {n} links: derive and lower"] = _beside(model.pendulum.system(n), once=n > 4)
    return found


def _contenders(name: str, system: System) -> dict[str, Callable[[], object]]:
    return {
        f"{name}, derive": lambda: derive(system),
        f"{name}, derive and lower all kernels": lambda: lower(derive(system)),
        f"{name}, kernels and equations as text": lambda: artefacts(system, "model.py"),
    }


def _beside(system: System, once: bool) -> list[Timing]:
    """Ours five times, LagrangesMethod once where it takes long."""
    ours = interleaved(
        {
            "qddot, M and f": lambda: derive(system),
            "qddot, right-hand side, accelerations solved for and optimized": lambda: lower_rhs(derive(system)),
            "qddot, all kernels": lambda: lower(derive(system)),
        },
        5,
    )
    theirs = interleaved({"SymPy LagrangesMethod, M and f": lambda: _sympy(system)}, 1 if once else 2)
    return ours + theirs


def _sympy(system: System) -> object:
    q = [dynamicsymbols(coordinate.symbol.name) for coordinate in system.coordinates]
    moving = {c.symbol: a for c, a in zip(system.coordinates, q, strict=True)}
    moving |= {c.rate: a.diff(dynamicsymbols._t) for c, a in zip(system.coordinates, q, strict=True)}
    energy = (system.kinetic_energy - system.potential_energy).xreplace(moving)
    method = LagrangesMethod(sympy.sympify(energy), q)
    method.form_lagranges_equations()
    return method.mass_matrix, method.forcing
