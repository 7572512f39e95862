"""Kernels of a model with constraints, or of many coupled coordinates: M, f, G and gamma are written down, and a
function of the runner solves for accelerations and multipliers, which the rest of a kernel reads."""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import symengine as se

from qddot.codegen.drafts import Draft, Matrix, Write, balance, event_writes, matrix_writes, vector_writes
from qddot.codegen.kernel import Assignment, Slot
from qddot.codegen.lagrange import Equations
from qddot.codegen.nodes import symbols_of
from qddot.model.resting import MOST
from qddot.model.system import ModelError

#: What stands before the names of kernels that hold contacts which rest; kernels that are seen whether they do or not.
RESTING, SEEN = "resting_", ("energy", "outputs")
#: Arrays that a kernel fills before it solves.
SYSTEM = ("mass_matrix", "constraint_matrix", "right_side", "residuals", "coordinates")
#: Arrays whose columns become derivatives of accelerations.
COLUMNS = ("forces", "drifts")
#: Arrays of zeros whose items are written, or added to, in any order: before the equations are solved, or after.
STAGES = {**dict.fromkeys(SYSTEM, 0), **dict.fromkeys(COLUMNS, 1)}
#: Kernels that may read multipliers and reactions.
REPORTING = ("outputs", "scene")
#: Functions that a kernel calls, by the file of `runner/machine` that they are from.
_RUNTIME = {
    "constrained": frozenset(("equations", "blank", "outcome", "accelerations", "derivatives", "report", "solved")),
    "coupled": frozenset(("coupled", "blank", "decoupled", "slopes")),
}


class ConstrainedDrafts:
    """The drafts of all kernels of a system that is solved at run time."""

    def __init__(self, equations: Equations) -> None:
        self._equations = equations
        self._n = len(equations.coordinates)
        self._places = _places(equations)

    @property
    def parameter_assignments(self) -> tuple[Assignment, ...]:
        """Quantities that are constant during a run."""
        return self._equations.fixed_quantities

    def rhs(self) -> Draft:
        """Dx = [qdot, qddot, zdot]."""
        equations = self._equations
        slopes = (*equations.velocities, *equations.accelerations, *equations.state_rates)
        return self._draft(vector_writes("derivative", slopes))

    def others(self) -> Mapping[str, Draft]:
        """Every other kernel but `constants`."""
        equations = self._equations
        return {
            "jacobian": self._draft((*self._unit_rows(), *self._slopes(equations.state))),
            "input_jacobian": self._draft(tuple(self._slopes(equations.channels))),
            "mass": self._draft(matrix_writes(equations.mass)),
            **self.seen(),
            **({"events": self.events()} if equations.events else {}),
            **({"scene": self._draft(vector_writes("values", equations.scene))} if equations.scene else {}),
            **self._on_constraints(),
        }

    def at_rest(self) -> Mapping[str, Draft]:
        """What takes the place of other kernels while a contact rests, where it is among the constraints."""
        velocities, matrix = self._unit_rows(), dict(self._equations.mass) | self._residuals()
        kernels = {
            "rhs": self.rhs(),
            "jacobian": self._draft((*velocities, *self._slopes(self._equations.state))),
            "constraints": self._draft(matrix_writes(matrix)),
            "events": self.events(),
        }
        return {f"{RESTING}{name}": draft for name, draft in kernels.items()}

    def seen(self) -> Mapping[str, Draft]:
        """What is told of a state: the kernels in SEEN."""
        equations = self._equations
        energies = (equations.kinetic, equations.potential, equations.dissipated_power, equations.input_power)
        return {
            name: self._draft(vector_writes("values", values))
            for name, values in zip(SEEN, (energies, equations.outputs), strict=True)
        }

    def events(self) -> Draft:
        """Functions of the events, then the values that they give."""
        return self._draft(event_writes(self._equations))

    def _on_constraints(self) -> Mapping[str, Draft]:
        if not self._equations.constraints:
            return {}
        matrices = {"constraints": dict(self._equations.mass) | self._residuals(), "tangent": self._tangent()}
        return {name: self._draft(matrix_writes(entries)) for name, entries in matrices.items()}

    def _unit_rows(self) -> tuple[Write, ...]:
        """The derivatives of qdot."""
        return matrix_writes({(k, self._n + k): se.Integer(1) for k in range(self._n)})

    def balance(self) -> Draft:
        """As that of `Drafts`, with G, gamma and the residuals of positions; see `recurrences`."""
        constraints, draft = self._equations.constraints, balance(self._equations)
        held = (
            *matrix_writes(constraints.matrix, "constraint"),
            *vector_writes("drift", constraints.drifts),
            *vector_writes("residual", constraints.residuals),
        )
        return replace(draft, writes=(*draft.writes, *held))

    @property
    def linear(self) -> bool:
        """Exact propagation knows no constraints, and no mass matrix that moves."""
        return False

    def _draft(self, writes: tuple[Write, ...]) -> Draft:
        """A draft that solves for what it reads of accelerations, multipliers and reactions, if it does."""
        read = frozenset().union(*(symbols_of(expression) for _, expression in writes))
        solves = read & self._equations.solution or any(slot.argument in COLUMNS for slot, _ in writes)
        return Draft(self._equations.moving_quantities, (*self._system, *writes) if solves else writes)

    @cached_property
    def _system(self) -> tuple[Write, ...]:
        """M, G, [f, gamma], the residuals and q, what vanishes left out."""
        equations, constraints = self._equations, self._equations.constraints
        right = dict(zip(self._places, equations.forces, strict=True))
        right |= dict(enumerate(constraints.drifts, self._n))
        forces = [(Slot("right_side", (k,)), right[k]) for k in sorted(right) if right[k] != 0]
        if not constraints:
            placed = {tuple(self._places[k] for k in pair): entry for pair, entry in equations.mass.items()}
            upper = {(min(pair), max(pair)): entry for pair, entry in placed.items()}
            return (*matrix_writes(upper, "mass_matrix"), *forces)
        return (
            *matrix_writes(equations.mass, "mass_matrix"),
            *matrix_writes(constraints.matrix, "constraint_matrix"),
            *forces,
            *((Slot("residuals", (j,)), value) for j, value in enumerate(constraints.residuals) if value != 0),
            *vector_writes("coordinates", equations.coordinates),
        )

    def _residuals(self) -> Matrix:
        """G below M, and beside it the residuals of positions and of velocities."""
        constraints, n = self._equations.constraints, self._n
        found = {(n + j, k): value for (j, k), value in constraints.matrix.items()}
        for column, values in ((n, constraints.residuals), (n + 1, constraints.rates)):
            found |= {(n + j, column): value for j, value in enumerate(values) if value != 0}
        return found

    def _tangent(self) -> Matrix:
        """The derivatives of the residuals of positions by the state, then of those of velocities."""
        constraints, n = self._equations.constraints, self._n
        on_positions = [j for j, residual in enumerate(constraints.residuals) if residual != 0]
        found = {(on_positions.index(j), k): v for (j, k), v in constraints.matrix.items() if j in on_positions}
        first = len(on_positions)
        found |= {(first + j, k): value for (j, k), value in constraints.slopes.items()}
        return found | {(first + j, n + k): value for (j, k), value in constraints.matrix.items()}

    def _slopes(self, variables: tuple[Any, ...]) -> Iterator[Write]:
        """Columns of forces and drifts by variables, from which those of accelerations come.

        M da/ds + G' dlambda/ds = df/ds - dM/ds a - dG'/ds lambda and G da/ds = dgamma/ds - dG/ds a, for each s.
        """
        equations, constraints = self._equations, self._equations.constraints
        columns = {variable: column for column, variable in enumerate(variables)}
        forces, drifts = Matrix(), Matrix()

        def add(found: Matrix, row: int, expression: Any, factor: Any = 1) -> None:
            for variable, value in equations.definitions.gradient(expression, columns.keys()).items():
                at = row, columns[variable]
                found[at] = found.get(at, se.Integer(0)) + factor * value

        for k, force in enumerate(equations.forces):
            add(forces, self._places[k], force)
        for (k, j), entry in equations.mass.items():
            add(forces, self._places[k], entry, -equations.accelerations[j])
            if j != k:
                add(forces, self._places[j], entry, -equations.accelerations[k])
        for (j, k), entry in constraints.matrix.items():
            add(forces, self._places[k], entry, -constraints.multipliers[j])
            add(drifts, j, entry, -equations.accelerations[k])
        for j, drift in enumerate(constraints.drifts):
            add(drifts, j, drift)
        yield from matrix_writes(forces, "forces")
        yield from matrix_writes(drifts, "drifts")
        rates = Matrix()
        for i, rate in enumerate(equations.state_rates):
            add(rates, 2 * self._n + i, rate)
        yield from matrix_writes(rates)


def _places(equations: Equations) -> Sequence[int]:
    """Where the row of each coordinate stands: in the order of elimination, with constraints in that of the author."""
    return range(len(equations.coordinates)) if equations.constraints else equations.elimination.places


def solution_slots(kernel: str, equations: Equations) -> dict[Any, Slot]:
    """Where a kernel reads accelerations, multipliers and reactions once they are solved for."""
    constraints, n = equations.constraints, len(equations.coordinates)
    slots = {a: Slot("right_side", (k,)) for k, a in zip(_places(equations), equations.accelerations, strict=True)}
    for j, symbol in enumerate(constraints.multipliers):
        slots[symbol] = Slot("multipliers", (j,)) if kernel in REPORTING else Slot("right_side", (n + j,))
    return slots | {symbol: Slot("reactions", (k,)) for k, symbol in constraints.reactions.items()}


@dataclass(frozen=True)
class Calls:
    """Lines of a kernel that solves: those that make the arrays, that solve, and that stand at its end."""

    made: tuple[str, ...]
    solved: tuple[str, ...]
    last: tuple[str, ...]


def calls(kernel: str, n: int, m: int, columns: int, *, reports: bool) -> Calls:
    """What a kernel calls for n coordinates and m constraints.

    columns: of the derivatives that it gives, 0 where it gives none. reports: it reads multipliers or reactions.
    """
    first = n if kernel == "jacobian" else 0
    if not m:
        made, last = [f"mass_matrix, right_side, factors = coupled({n}, FACTORS)"], []
        if columns:
            made.append(f"forces = blank({n}, {columns})")
            last.append(f"slopes(mass_matrix, factors, forces, values, {first})")
        return Calls(tuple(made), ("decoupled(mass_matrix, factors, right_side)",), tuple(last))
    arrays = "mass_matrix, constraint_matrix, right_side, residuals, coordinates, workspace"
    factors = bool(columns) or (kernel in REPORTING and reports)
    solve = f"accelerations({arrays})" if factors else f"solved({n}, {m}, {arrays})"
    made, solved, last = [f"{arrays} = equations({n}, {m})"], [solve], []
    if columns:
        made += [f"forces = blank({n}, {columns})", f"drifts = blank({m}, {columns})"]
        last.append(f"derivatives(constraint_matrix, workspace, forces, drifts, values, {first})")
    if kernel in REPORTING and reports:
        made.append(f"multipliers, reactions = outcome({n}, {m})")
        solved.append("report(constraint_matrix, right_side, workspace, multipliers, reactions)")
    return Calls(tuple(made), tuple(solved), tuple(last))


@cache
def solving_names() -> frozenset[str]:
    """Names that a kernel which solves uses beside a model's symbols."""
    asked = (("rhs", 0), ("jacobian", 1), ("outputs", 1))
    found = (calls(kernel, 1, m, columns, reports=True) for kernel, columns in asked for m in (0, 1))
    lines = [line for each in found for line in (*each.made, *each.solved, *each.last)]
    return frozenset(node.id for line in lines for node in ast.walk(ast.parse(line)) if isinstance(node, ast.Name))


def runtime_names(text: str, equations: Equations) -> dict[str, list[str]]:
    """The functions of the runner that the text of a module calls, in order, by the files that they are from."""
    held = bool(equations.resting)
    homes = ["constrained"] * held + ["coupled"] * (equations.solved_at_run_time and not equations.constraints)
    found: dict[str, list[str]] = {}
    for home in homes:
        others = {name for names in found.values() for name in names}
        found[home] = sorted(name for name in _RUNTIME[home] - others if re.search(rf"\b{name}\(", text))
    return found


def refuse_size(equations: Equations) -> None:
    """ModelError where the equations would not fit on the stack."""
    n, m = len(equations.coordinates), len(equations.constraints)
    if equations.solved_at_run_time and n + m > MOST:
        count = f"{n} coordinates and {m} constraints" if m else f"{n} coordinates, all coupled with each other,"
        raise ModelError(f"model {equations.system.name}: {count} are too many: {MOST} together can be solved")
