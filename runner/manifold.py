"""The constraints of a model at a point: what they say there, in arrays of NumPy, for what happens once a run."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.load import Model
from qddot.runner.problem import Held, Resting
from qddot.runner.tables import Constraint

Vector = NDArray[np.float64]

#: Sine of the smallest angle between independent constraints.
DEPENDENT = 1e-9


@dataclass(frozen=True)
class Point:
    """The constraints at a state: G (m, n), residuals of positions (n_positions,) and of velocities (m,).

    masses (n,): the diagonal of the mass matrix.
    """

    masses: Vector
    G: Vector
    positions: Vector
    velocities: Vector


@dataclass(frozen=True)
class Manifold:
    """The constraints of a model with constants c, at time t with inputs u; those on positions first."""

    model: Model
    c: Vector
    t: float
    u: Vector

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """Their names, units and meanings."""
        return self.model.tables.constraints

    @property
    def n_positions(self) -> int:
        """How many are on positions."""
        return self.model.tables.n_positions

    def at(self, x: Vector) -> Point:
        """What they say of a state x (n_states,)."""
        n = self.model.tables.coordinates
        whole = self.model.matrix("constraints")(self.t, x, self.u, self.c)
        return Point(whole[:n].diagonal(), whole[n:, :n], whole[n : n + self.n_positions, n], whole[n:, n + 1])

    def holds(self, x: Vector, nothing: float) -> bool:
        """Whether a state is on the constraints, positions and velocities, but for a part of the terms, see `terms`."""
        n = self.model.tables.coordinates
        of_constraints = self.model.matrix("constraints")(self.t, x, self.u, self.c)[n:]
        allowed = nothing * terms(of_constraints[:, :n], x[: 2 * n].reshape(2, n).T)
        return bool((np.abs(of_constraints[:, n:]) <= allowed).all())

    def tangent(self, x: Vector) -> Vector:
        """Columns (n_states, k), orthonormal, of the directions in which a state on the constraints may change."""
        return null_space(self.model.matrix("tangent")(self.t, x, self.u, self.c))


def terms(G: Vector, values: Vector) -> Vector:
    """How large the terms are that residuals are sums of, the states being of order 1; values (n,) or (n, k)."""
    found: Vector = np.abs(G) @ (np.abs(values) + 1.0)
    return found


def held_by(model: Model) -> Held | None:
    """The constraints on which a run of a model is kept after each step."""
    tables = model.tables
    if not tables.projected:
        return None
    return Held(model.matrix("constraints"), tables.coordinates, len(tables.constraints), tables.n_positions)


def resting_of(model: Model, *, stiff: bool) -> Callable[[], Resting]:
    """What takes the place of a model's kernels while contacts rest, compiled when it is called for.

    stiff: for a method that takes Jacobians. The gaps are among the constraints, after those on positions.
    """
    tables = model.tables
    m, positions = (count + len(tables.contacts) for count in (len(tables.constraints), tables.n_positions))

    def found() -> Resting:
        matrix = model.matrix("resting_constraints")
        kept = tables.projected or not tables.constraints
        return Resting(
            rhs=model.kernel("resting_rhs"),
            jacobian=model.matrix("resting_jacobian") if stiff else None,
            events=model.kernel("resting_events"),
            held=Held(matrix, tables.coordinates, m, positions) if kept else None,
        )

    return found


def null_space(rows: Vector) -> Vector:
    """Columns (n, k), orthonormal, on which rows (m, n) vanish; each row counts by its direction alone."""
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    _, values, V = np.linalg.svd(rows / np.where(sizes > 0, sizes, 1.0))
    rank = int(np.count_nonzero(values > DEPENDENT))
    directions: Vector = V[rank:].T
    return directions
