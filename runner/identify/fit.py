"""Bounded least squares over the model, by SciPy (Branch, Coleman, Li, SIAM J. Sci. Comput. 21 (1999) 1-23)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from qddot.runner.identify.problem import Problem
from qddot.runner.simulate import IntegrationError

Vector = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: Step of the differences, as a part of the range between the bounds.
DIFFERENCE = 1e-4
#: Distance from a bound, as a part of the range, within which it counts as active.
AT_BOUND = 1e-6
#: What a run that fails weighs: far more than any that does not, yet finite.
FAILED = 1e6


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the search ended: x (n,), residuals (m,), their Jacobian (m, n) by the unknowns over their range.

    at_lower, at_upper (n,): active bounds. runs: how many times all scenarios were run. message: why it stopped.
    """

    x: Vector
    residuals: Vector
    jacobian: Vector
    at_lower: Flags
    at_upper: Flags
    runs: int
    converged: bool
    message: str

    @property
    def free(self) -> Flags:
        """Which unknowns are at no bound (n,)."""
        return ~(self.at_lower | self.at_upper)


def fit(problem: Problem, progress: Callable[[float], None] | None = None) -> Fit:
    """The least-squares fit, the best of all starts. Errors of a start point that cannot be run are raised."""
    lower, upper = problem.column("lower"), problem.column("upper")
    counter = _Counter(problem, lower, upper)  # a study that cannot be run says so, whatever the search makes of it
    first = (problem.column("start") - lower) / (upper - lower)
    starts = [first]
    if problem.given.starts > 1:
        from scipy.stats import qmc  # noqa: PLC0415 - slow to import

        sampler = qmc.LatinHypercube(len(lower), rng=np.random.default_rng(problem.given.seed))
        starts += list(sampler.random(problem.given.starts - 1))
    found = []
    for k, start in enumerate(starts):
        found.append(least_squares(counter, start, jac=counter.jacobian, bounds=(0.0, 1.0), method="trf", xtol=1e-9))
        if progress is not None:
            progress((k + 1) / len(starts))
    best = min(found, key=lambda each: each.cost)
    return Fit(
        x=lower + best.x * (upper - lower),
        residuals=best.fun,
        jacobian=best.jac,
        at_lower=best.x <= AT_BOUND,
        at_upper=best.x >= 1.0 - AT_BOUND,
        runs=counter.runs,
        converged=bool(best.success),
        message=str(best.message).rstrip("."),
    )


class _Counter:
    """The residuals as a function of z (n,) from 0 at the lower bounds to 1 at the upper ones, and how often it ran."""

    def __init__(self, problem: Problem, lower: Vector, upper: Vector) -> None:
        self._problem, self._lower, self._range = problem, lower, upper - lower
        self._size = len(problem.residuals(problem.column("start")))
        self.runs = 0

    def __call__(self, z: Vector) -> Vector:
        self.runs += 1
        try:
            found = self._problem.residuals(self._lower + z * self._range)
        except (IntegrationError, ValueError):  # such as no static state: the start point had none of these
            return np.full(self._size, FAILED)
        return np.where(np.isfinite(found), found, FAILED)

    def jacobian(self, z: Vector) -> Vector:
        """Differences (m, n): central, and into the range at a bound."""
        columns = []
        for i in range(len(z)):
            above, below = z.copy(), z.copy()
            above[i], below[i] = min(z[i] + DIFFERENCE, 1.0), max(z[i] - DIFFERENCE, 0.0)
            columns.append((self(above) - self(below)) / (above[i] - below[i]))
        return np.array(columns).T
