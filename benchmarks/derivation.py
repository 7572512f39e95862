"""Derivation and lowering beside SymPy's own LagrangesMethod and CasADi's Jacobians, on the same models."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import sympy
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

import qddot.model.chain
import qddot.model.m113
import qddot.model.pendulum
from benchmarks.contest import reason, say
from benchmarks.peers import peer
from benchmarks.timing import Table, Timing, interleaved
from qddot.codegen.generate import artefacts
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower, lower_rhs
from qddot.model.system import System

OURS = "qddot, right-hand side, accelerations solved for and optimized"
CASADI = "CasADi, right-hand side, accelerations solved for, as its function"
SYMPY = "SymPy LagrangesMethod, M and f"


def groups(quick: bool) -> Iterator[Table]:
    """The M113, then chains and pendulums over n; `quick` leaves out what takes minutes."""
    m113 = qddot.model.m113.system()
    contenders = {
        "M113, derive": lambda: derive(m113),
        "M113, right-hand side, accelerations solved for and optimized": lambda: lower_rhs(derive(m113)),
        "M113, derive and lower all kernels": lambda: lower(derive(m113)),
        "M113, kernels and equations as text": lambda: artefacts(m113, "model.py"),
    }
    yield Table("M113: from the model to all text", tuple(interleaved(contenders, 5)))
    for n in (10, 20) if quick else (10, 20, 40, 160):
        yield Table(f"Chain of {n}: derive and lower", tuple(_beside(qddot.model.chain.system(n))))
    for n in (2, 3) if quick else (2, 4, 8):
        yield Table(f"Pendulum of {n} links: derive and lower", tuple(_beside(qddot.model.pendulum.system(n))))


def _beside(system: System) -> list[Timing]:
    """All in turn; LagrangesMethod, which may take minutes, once and without a turn that does not count."""
    say(f"  {system.title}")
    contenders: dict[str, Callable[[], object]] = {
        OURS: lambda: lower_rhs(derive(system)),
        "qddot, M and f": lambda: derive(system),
        "qddot, all kernels": lambda: lower(derive(system)),
        "qddot, kernels and equations as text": lambda: artefacts(system, "model.py"),
    }
    notes = {OURS: f"{lower_rhs(derive(system)).operations} operations", SYMPY: "once"}
    missing = []
    try:
        energies = peer("casadi", "Energies")(system)
        contenders |= {"CasADi, M and f": energies.equations, CASADI: energies.right_hand_side}
        notes[CASADI] = f"{peer('casadi', 'operations')(energies.right_hand_side())} operations"
    except Exception as problem:  # whatever a foreign tool does, the others still run
        missing.append(Timing("CasADi", note=f"does not take part: {reason(problem)}"))
    rows = interleaved(contenders, 5) + interleaved({SYMPY: lambda: _sympy(system)}, 1, warm=True)
    return [replace(row, note=notes.get(row.name, "")) for row in rows] + missing


def _sympy(system: System) -> object:
    q = [dynamicsymbols(coordinate.symbol.name) for coordinate in system.coordinates]
    moving = {c.symbol: a for c, a in zip(system.coordinates, q, strict=True)}
    moving |= {c.rate: a.diff(dynamicsymbols._t) for c, a in zip(system.coordinates, q, strict=True)}
    energy = (system.kinetic_energy - system.potential_energy).xreplace(moving)
    method = LagrangesMethod(sympy.sympify(energy), q)
    method.form_lagranges_equations()
    return method.mass_matrix, method.forcing
