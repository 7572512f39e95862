"""Embedded Runge-Kutta pairs: two methods on the same stages, whose difference estimates the error.

Notation as in `butcher`.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.tableaux.butcher import ButcherTableau


@dataclass(frozen=True, eq=False)
class EmbeddedPair:
    """An embedded pair and its dense output.

    tableau: the stages of a step, b and b_hat. dense: the same stages, then those that only dense output needs, with P.
    Where the last stage of a step is not the first of the next (FSAL), dense continues with that one: c = 1, row b.
    second_hat (s,), second_order: a second embedded method; the two estimates are combined as in DOP853.
    error_order: the error estimate is O(h^error_order). controller, refine: what the method
    is run with by default; longest_step: longest step by default, as a part of the span.
    Raises ValueError where a condition fails.
    """

    tableau: ButcherTableau
    dense: ButcherTableau
    error_order: int
    controller: str
    refine: int = 1
    longest_step: float = 1.0
    second_hat: ArrayLike | None = None
    second_order: int = 0

    def __post_init__(self) -> None:
        """Check that the parts belong together."""
        name, s = self.tableau.name, self.tableau.stages
        if self.tableau.b_hat is None or self.dense.P is None:
            raise ValueError(f"pair {name}: b_hat or the dense output is missing")
        if not np.array_equal(self.dense.A[:s, :s], self.tableau.A):
            raise ValueError(f"pair {name}: dense output stands on other stages than the step")
        if not self.tableau.first_same_as_last and not np.array_equal(self.dense.A[s, :s], self.tableau.b):
            raise ValueError(f"pair {name}: stage {s + 1} is not the slope at the end of the step")
        if self.second_hat is not None:
            replace(self.tableau, b=self.second_hat, order=self.second_order, b_hat=None, P=None)

    @property
    def next_slope(self) -> int:
        """Index of the stage that is the first of the next step."""
        return self.tableau.stages - self.tableau.first_same_as_last

    @property
    def error_weights(self) -> NDArray[np.float64]:
        """Weights of the slopes in the error estimates, (1 or 2, s)."""
        others = [self.tableau.b_hat] if self.second_hat is None else [self.tableau.b_hat, self.second_hat]
        return np.array([self.tableau.b - np.array(other, dtype=np.float64) for other in others])


def sparse(weights: dict[int, float], length: int) -> list[float]:
    """The row (length,) that has these weights at these stages, counted from 0, and zeros elsewhere."""
    return [weights.get(i, 0.0) for i in range(length)]
