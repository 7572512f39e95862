"""How sure a fit is: covariance, correlation, what the data cannot tell, and whether it fits at all."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from qddot.runner.identify.fit import Fit
from qddot.runner.identify.problem import Problem
from qddot.words import counted

Vector = NDArray[np.float64]

#: Unknowns correlated more than this are named as a pair.
CORRELATED = 0.95
#: Share of a direction below which an unknown is not named in it.
NAMED = 0.1
#: Probability of a misfit as large as the one found, below which the model does not fit within the stated errors.
UNLIKELY = 0.01


@dataclass(frozen=True, eq=False)
class Judgement:
    """Statistics of a fit of n unknowns to m observations.

    covariance, correlation (n, n), standard_errors (n,): by the stated errors of the observations; rows of unknowns
    at a bound are 0, of those that nothing determines infinite. singular_values (n_free,): of the Jacobian of the
    weighted residuals by the free unknowns over their range: a step across the whole range along a direction changes
    the residuals by this much, so one below 1 is a direction that the data do not determine within the bounds.
    directions: (n_free, n_free) rows, one for each singular value. chi_squared: sum of squared residuals, with
    degrees_of_freedom; misfit: probability of one as large or larger if model and stated errors were right.
    """

    covariance: Vector
    correlation: Vector
    standard_errors: Vector
    singular_values: Vector
    directions: Vector
    chi_squared: float
    degrees_of_freedom: int
    misfit: float
    notes: tuple[str, ...]

    @property
    def fits(self) -> bool:
        """Whether the observations are met within their stated errors."""
        return not self.misfit < UNLIKELY


def judge(problem: Problem, fit: Fit) -> Judgement:
    """The statistics of a fit, linearized at its end."""
    span = problem.column("upper") - problem.column("lower")
    free = np.flatnonzero(fit.free)
    _, singular_values, directions = np.linalg.svd(fit.jacobian[:, free], full_matrices=False)
    covariance = np.zeros((len(span), len(span)))
    covariance[np.ix_(free, free)] = _inverse(singular_values, directions) * np.outer(span[free], span[free])
    errors = np.sqrt(np.diag(covariance))
    chi_squared = float(fit.residuals @ fit.residuals)
    freedom = len(fit.residuals) - len(free)
    misfit = float(chdtrc(freedom, chi_squared)) if freedom > 0 else np.nan
    correlation = _correlation(covariance, errors)
    notes = (
        *_bounds(problem, fit),
        *_undetermined(problem, free, singular_values, directions),
        *_pairs(problem, correlation),
        *_misfit(chi_squared, freedom, misfit),
    )
    found = (covariance, correlation, errors, singular_values, directions)
    return Judgement(*found, chi_squared, freedom, misfit, notes)


def _inverse(singular_values: Vector, directions: Vector) -> Vector:
    """(J^T J)^-1 from the singular value decomposition; infinite where a direction has no effect at all."""
    n = directions.shape[1]
    tiny = singular_values.max(initial=0.0) * 1e-14
    known = singular_values > max(tiny, 0.0)
    total = (directions[known].T / singular_values[known] ** 2) @ directions[known]
    lost = (directions[~known] ** 2).sum(axis=0) > 1e-12 if (~known).any() else np.zeros(n, dtype=bool)
    if len(singular_values) < n:  # fewer observations than unknowns
        lost |= (1.0 - (directions**2).sum(axis=0)) > 1e-12
    total[lost, lost] = np.inf
    return total


def _correlation(covariance: Vector, errors: Vector) -> Vector:
    scale = np.where((errors > 0) & np.isfinite(errors), errors, 1.0)
    correlation = np.where(np.isfinite(covariance), covariance, 0.0) / np.outer(scale, scale)
    np.fill_diagonal(correlation, np.where(errors > 0, 1.0, 0.0))
    return correlation


def _bounds(problem: Problem, fit: Fit) -> list[str]:
    """Unknowns at a bound: pressed against it by the data, or come there by chance."""
    notes = []
    for i, name in enumerate(problem.names):
        effect = float(np.linalg.norm(fit.jacobian[:, i]))
        if not fit.free[i] and effect < 1.0:
            notes.append(_untold(name, effect))
        elif not fit.free[i]:
            end = "lower" if fit.at_lower[i] else "upper"
            notes.append(f"{name} is at its {end} bound: its error is not estimated, and a better value may lie beyond")
    return notes


def _untold(what: str, effect: float) -> str:
    return (
        f"the data cannot tell {what}: a step across the whole range changes the residuals by {effect:.2g} "
        "standard errors in all"
    )


def _undetermined(problem: Problem, free: NDArray[np.intp], singular_values: Vector, directions: Vector) -> list[str]:
    notes = []
    missing = len(free) - len(singular_values)
    if missing > 0:
        notes.append(f"{len(free)} free unknowns but {len(singular_values)} observations: {missing} cannot be told")
    for value, direction in zip(singular_values, directions, strict=True):
        if value < 1.0:
            named = [i for i in np.argsort(-np.abs(direction)) if abs(direction[i]) > NAMED]
            names = [problem.names[free[i]] for i in named]
            notes.append(_untold(f"{' and '.join(names)} apart" if len(names) > 1 else names[0], value))
    return notes


def _pairs(problem: Problem, correlation: Vector) -> list[str]:
    n = len(correlation)
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n) if abs(correlation[i, j]) > CORRELATED]
    return [
        f"{problem.names[i]} and {problem.names[j]} are hard to tell apart: correlation {correlation[i, j]:+.3f}"
        for i, j in pairs
    ]


def _misfit(chi_squared: float, freedom: int, misfit: float) -> list[str]:
    if freedom <= 0:
        return ["as many unknowns as observations: the fit says nothing about whether the model is right"]
    if misfit < UNLIKELY:
        return [
            f"the observations are not met within their stated errors (chi squared {chi_squared:.3g} with "
            f"{counted(freedom, 'degree of freedom')}, probability {misfit:.2g}): the model, an assumption or an "
            "observation is wrong, and the standard errors are too small by a factor of about "
            f"{np.sqrt(chi_squared / freedom):.2g}"
        ]
    return []
