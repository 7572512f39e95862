"""What each kernel computes, written down plainly: assignments and writes before any optimization."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import symengine as se

from qddot.codegen.elimination import Factors, factorize, solve
from qddot.codegen.kernel import Assignment, Slot
from qddot.codegen.lagrange import Equations
from qddot.codegen.rewrite import Names

Matrix = dict[tuple[int, int], Any]


@dataclass(frozen=True)
class Draft:
    """Temporaries and writes of a kernel; temporaries may be more than it needs."""

    temporaries: tuple[Assignment, ...]
    writes: tuple[tuple[Slot, Any], ...]


class Drafts:
    """The drafts of all kernels of one system; accelerations come from one LDL^T of the mass matrix."""

    def __init__(self, equations: Equations, names: Names) -> None:
        self._equations = equations
        self._names = names
        self._n = len(equations.coordinates)
        self._factors: Factors = factorize(equations.mass, self._n, names.fresh)
        self._fixed_mass = equations.mass_matrix != "configuration-dependent"
        self._wishes = [str(acceleration) for acceleration in equations.accelerations]
        self._solution, accelerations = solve(self._factors, _sparse(equations.forces), names.fresh, self._wishes)
        still = [(names.fresh(wish), se.Integer(0)) for k, wish in enumerate(self._wishes) if k not in accelerations]
        self._solution += still
        self._accelerations = [accelerations.get(k, se.Integer(0)) for k in range(self._n)]

    @cached_property
    def parameter_assignments(self) -> tuple[Assignment, ...]:
        """Quantities that are constant during a run, and the factors of a constant mass matrix."""
        return tuple(item for item in self._definitions if self._equations.parameter_only(item[1])) + (
            self._factors.assignments if self._fixed_mass else ()
        )

    def rhs(self) -> Draft:
        """Dx = [qdot, M^-1 f]."""
        derivatives = (*self._equations.velocities, *self._accelerations)
        return Draft((*self._moving, *self._solution), _vector("derivative", derivatives))

    def others(self) -> Mapping[str, Draft]:
        """Every other kernel but `constants`; `linear` too where the equations are, which goes on from `jacobian`."""
        slopes = self._linear() or {"jacobian": self._jacobian()}
        return {"mass": self._mass(), "energy": self._energy(), "outputs": self._outputs(), **slopes}

    def positions(self) -> Draft:
        """Where the inputs that have a position act; read from the parameters, once a run."""
        return Draft(self.parameter_assignments, _vector("values", self._equations.positions.values()))

    @cached_property
    def _definitions(self) -> list[Assignment]:
        return list(self._equations.definitions.expressions.items())

    @cached_property
    def _moving(self) -> tuple[Assignment, ...]:
        """Quantities that move, and the factors of a mass matrix that does."""
        quantities = tuple(item for item in self._definitions if not self._equations.parameter_only(item[1]))
        return quantities + (() if self._fixed_mass else self._factors.assignments)

    @cached_property
    def _state_slopes(self) -> tuple[list[Assignment], Matrix]:
        return self._slopes((*self._equations.coordinates, *self._equations.velocities))

    def _slopes(self, variables: tuple[Any, ...]) -> tuple[list[Assignment], Matrix]:
        """Assignments and entries of d qddot / d variables: M^-1 (df/ds - dM/ds qddot), column by column."""
        equations = self._equations
        gradients = [equations.definitions.gradient(force, variables) for force in equations.forces]
        inertia = {pair: equations.definitions.gradient(entry, variables) for pair, entry in equations.mass.items()}
        assignments: list[Assignment] = []
        entries: Matrix = {}
        columns: dict[Any, dict[int, Any]] = {variable: {} for variable in variables}

        def add(row: int, variable: Any, value: Any) -> None:
            columns[variable][row] = columns[variable].get(row, se.Integer(0)) + value

        for row, gradient in enumerate(gradients):
            for variable, value in gradient.items():
                add(row, variable, value)
        for (k, j), gradient in inertia.items():
            for variable, value in gradient.items():
                add(k, variable, -value * equations.accelerations[j])
                if j != k:
                    add(j, variable, -value * equations.accelerations[k])
        for column, variable in enumerate(variables):
            steps, values = solve(self._factors, columns[variable], self._names.fresh)
            assignments += steps
            entries.update({(row, column): value for row, value in values.items()})
        return assignments, entries

    def _jacobian(self) -> Draft:
        steps, entries = self._state_slopes
        return Draft((*self._moving, *self._solution, *steps), _matrix("matrix", self._with_velocities(entries)))

    def _with_velocities(self, entries: Matrix) -> Matrix:
        """The lower half of a state matrix below the rows that say d q / d t = qdot."""
        upper: Matrix = {(k, self._n + k): se.Integer(1) for k in range(self._n)}
        return upper | {(self._n + row, column): value for (row, column), value in entries.items()}

    def _mass(self) -> Draft:
        lower = dict(self._equations.mass)
        upper = {(j, k): value for (k, j), value in lower.items()}
        return Draft(self._moving, _matrix("matrix", lower | upper))

    def _energy(self) -> Draft:
        equations = self._equations
        powers = (equations.dissipated_power, equations.input_power)
        return self._values((equations.kinetic, equations.potential, *powers))

    def _outputs(self) -> Draft:
        return self._values(self._equations.outputs)

    def _values(self, values: Iterable[Any]) -> Draft:
        return Draft((*self._moving, *self._solution), _vector("values", values))

    def _linear(self) -> dict[str, Draft] | None:
        """A and [B, b] of dx = A x + B u + b; None where an entry is not constant during a run.

        A is the Jacobian; `linear` begins with it and adds [B, b].
        """
        equations = self._equations
        if not self._fixed_mass:
            return None
        channels = (*equations.inputs, *equations.rates)
        steps, entries = self._state_slopes
        input_steps, input_entries = self._slopes(channels)
        known = set(equations.parameters) | {
            symbol for symbol, _ in (*self.parameter_assignments, *steps, *input_steps)
        }
        slopes = (*entries.values(), *input_entries.values(), *(e for _, e in (*steps, *input_steps)))
        nothing = dict.fromkeys((*equations.coordinates, *equations.velocities, *channels), se.Integer(0))
        if any(not value.free_symbols <= known for value in slopes):
            return None
        rest = equations.definitions.substitute(equations.forces, nothing)
        if rest is None:
            return None
        rest_steps, offsets = solve(self._factors, _sparse(rest), self._names.fresh)
        last = {(row, len(channels)): value for row, value in offsets.items()}
        temporaries = (*steps, *input_steps, *rest_steps)
        known |= {symbol for symbol, _ in rest_steps}
        if any(not value.free_symbols <= known for value in (*last.values(), *(e for _, e in rest_steps))):
            return None
        below = {(self._n + row, column): value for (row, column), value in (input_entries | last).items()}
        return {
            "jacobian": Draft(temporaries, _matrix("matrix", self._with_velocities(entries))),
            "linear": Draft(temporaries, _matrix("input_matrix", below)),
        }


def _sparse(values: Iterable[Any]) -> dict[int, Any]:
    return {index: value for index, value in enumerate(values) if value != 0}


def _vector(argument: str, values: Iterable[Any]) -> tuple[tuple[Slot, Any], ...]:
    return tuple((Slot(argument, (index,)), value) for index, value in enumerate(values))


def _matrix(argument: str, entries: Matrix) -> tuple[tuple[Slot, Any], ...]:
    return tuple((Slot(argument, index), entries[index]) for index in sorted(entries))
