"""Consistent initial values of M x' = f(t, x) with a constant singular M of index 1.

With rows L of the left and R of the right null space of M, the algebraic equations L f(t, x) = 0 must hold at the start
and wherever an input jumps. The differential part of x is kept, the algebraic part is solved for: x + R' q. Shampine,
Reichelt, Kierzenka, "Solving index-1 DAEs in MATLAB and Simulink", SIAM Review 41 (1999) 538-552, section 4.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.problem import Problem

Array = NDArray[np.float64]

#: Newton iterations, and halvings of one correction, before the search is given up.
MOST_ITERATIONS, MOST_HALVINGS = 50, 30
#: The algebraic part is accurate to this part of the relative tolerance.
ACCURACY = 1e-3
#: Rounding in L J R' relative to its terms, where J is exact and where it comes from differences.
EXACT_NOISE, DIFFERENCE_NOISE = 1e-14, 1e-10


class InconsistentError(ValueError):
    """No state that satisfies the algebraic equations was found near the one given."""


@dataclass
class AlgebraicEquations:
    """The algebraic equations of a problem at one time t; `side` is a time on that side of a jump which is meant."""

    problem: Problem
    t: float
    side: float
    threshold: Array
    evaluations: int = 0
    jacobians: int = 0
    left: Array = field(init=False)
    right: Array = field(init=False)
    u: Array = field(init=False)

    def __post_init__(self) -> None:
        """Find the null spaces, and look up the inputs."""
        left, sizes, right = np.linalg.svd(mass_matrix(self.problem))
        rank = int(np.sum(sizes > sizes[0] * len(sizes) * np.finfo(np.float64).eps))
        self.left, self.right = left[:, rank:].T, right[rank:]
        inputs = self.problem.inputs
        self.u = np.zeros(max(1, len(inputs.first)))
        evaluate(inputs, reader_for(inputs), self.t, self.side, self.problem.n_inputs, self.u)

    @property
    def time(self) -> float:
        """The time t as a person counts it."""
        return self.t if self.problem.sense > 0 else 0.0 - self.t

    def f(self, x: Array) -> Array:
        """The right-hand side at x."""
        dx = np.empty(len(x))
        self.problem.rhs(self.t, x, self.u, self.problem.constants, dx)
        self.evaluations += 1
        return dx

    def inverse(self, x: Array) -> Array | None:
        """The inverse of L J R' at x; None where it has none, so that the index is not 1."""
        jacobian = self._jacobian(x)
        matrix = self.left @ jacobian @ self.right.T
        terms = np.abs(self.left) @ np.abs(jacobian) @ np.abs(self.right).T
        noise = (EXACT_NOISE if self.problem.jacobian is not None else DIFFERENCE_NOISE) * terms.max()
        if not np.isfinite(matrix).all() or np.linalg.svd(matrix, compute_uv=False)[-1] <= noise:
            return None
        return np.asarray(np.linalg.inv(matrix), dtype=np.float64)

    def _jacobian(self, x: Array) -> Array:
        self.jacobians += 1
        if self.problem.jacobian is not None:
            return self.problem.jacobian_at(self.t, x, self.u)
        steps = np.sqrt(np.finfo(np.float64).eps) * np.maximum(np.abs(x), self.threshold)
        return (np.array([self.f(x + step) for step in np.diag(steps)]) - self.f(x)).T / steps

    def size(self, x: Array, correction: Array) -> float:
        """Largest relative change of a state."""
        return float(np.max(np.abs(correction @ self.right) / np.maximum(np.abs(x), self.threshold)))


def consistent_state(equations: AlgebraicEquations, x: Array, rtol: float) -> Array:
    """The state near x that satisfies the algebraic equations, by a damped Newton iteration; x itself where it does.

    Raises InconsistentError where the index is not 1, or no such state is found.
    """
    for iteration in range(MOST_ITERATIONS):
        inverse = equations.inverse(x)
        if inverse is None and iteration == 0:
            raise InconsistentError(
                f"the mass matrix is singular and the algebraic equations do not determine the algebraic states at t = "
                f"{equations.time}: the index is higher than 1; differentiate the constraints or eliminate them"
            )
        if inverse is None:
            break
        correction = inverse @ (equations.left @ equations.f(x))
        size = equations.size(x, correction)
        if size <= ACCURACY * rtol:
            return x
        trial = _damped(equations, inverse, x, correction, size)
        if trial is None:
            break
        x = trial
    raise InconsistentError(
        f"the state does not satisfy the algebraic equations at t = {equations.time}, and Newton's method found no "
        f"state near it that does; give initial values closer to a consistent state"
    )


def _damped(equations: AlgebraicEquations, inverse: Array, x: Array, correction: Array, size: float) -> Array | None:
    """The state after as much of the correction as makes the next, simplified one smaller; None where none does.

    The natural monotonicity test: P. Deuflhard, Newton Methods for Nonlinear Problems (2004), section 3.1.
    """
    damping = 1.0
    for _ in range(MOST_HALVINGS):
        trial = x - damping * (correction @ equations.right)
        if equations.size(x, inverse @ (equations.left @ equations.f(trial))) <= (1.0 - 0.25 * damping) * size:
            return trial
        damping *= 0.5
    return None


def mass_matrix(problem: Problem) -> NDArray[np.float64]:
    """The mass matrix (n, n), of unity where none is given."""
    n = len(problem.initial_state)
    if problem.mass_matrix is None:
        return np.eye(n)
    mass = np.array(problem.mass_matrix, dtype=np.float64)
    if mass.shape != (n, n):
        raise ValueError(f"mass_matrix has shape {mass.shape}, expected ({n}, {n}) for {n} states")
    if not np.isfinite(mass).all():
        row, column = np.argwhere(~np.isfinite(mass))[0]
        raise ValueError(f"mass_matrix[{row}, {column}] is {mass[row, column]}, expected finite numbers")
    return mass
