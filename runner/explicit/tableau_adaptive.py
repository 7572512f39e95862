"""Embedded Runge-Kutta pairs of order 3 and 5: two methods on the same stages, whose difference estimates the error.

Notation as in `tableau`; those of order 7 and 8 have pages of their own.
"""

from dataclasses import dataclass, replace
from fractions import Fraction as Q

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.explicit.tableau import ButcherTableau


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


_BS32 = ButcherTableau(
    name="ode23",
    order=3,
    c=[0, Q(1, 2), Q(3, 4), 1],
    A=[[], [Q(1, 2)], [0, Q(3, 4)], [Q(2, 9), Q(1, 3), Q(4, 9)]],
    b=[Q(2, 9), Q(1, 3), Q(4, 9), 0],
    b_hat=[Q(7, 24), Q(1, 4), Q(1, 3), Q(1, 8)],
    order_hat=2,
    P=[[1, Q(-4, 3), Q(5, 9)], [0, 1, Q(-2, 3)], [0, Q(4, 3), Q(-8, 9)], [0, -1, 1]],
    order_dense=3,
    citation="P. Bogacki, L. F. Shampine, A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989) 321-325; "
    "dense output: cubic Hermite",
)

BOGACKI_SHAMPINE_32 = EmbeddedPair(tableau=_BS32, dense=_BS32, error_order=3, controller="matlab", longest_step=0.1)

_DP54 = ButcherTableau(
    name="ode45",
    order=5,
    c=[0, Q(1, 5), Q(3, 10), Q(4, 5), Q(8, 9), 1, 1],
    A=[
        [],
        [Q(1, 5)],
        [Q(3, 40), Q(9, 40)],
        [Q(44, 45), Q(-56, 15), Q(32, 9)],
        [Q(19372, 6561), Q(-25360, 2187), Q(64448, 6561), Q(-212, 729)],
        [Q(9017, 3168), Q(-355, 33), Q(46732, 5247), Q(49, 176), Q(-5103, 18656)],
        [Q(35, 384), 0, Q(500, 1113), Q(125, 192), Q(-2187, 6784), Q(11, 84)],
    ],
    b=[Q(35, 384), 0, Q(500, 1113), Q(125, 192), Q(-2187, 6784), Q(11, 84), 0],
    b_hat=[Q(5179, 57600), 0, Q(7571, 16695), Q(393, 640), Q(-92097, 339200), Q(187, 2100), Q(1, 40)],
    order_hat=4,
    P=[
        [1, Q(-183, 64), Q(37, 12), Q(-145, 128)],
        [0, 0, 0, 0],
        [0, Q(1500, 371), Q(-1000, 159), Q(1000, 371)],
        [0, Q(-125, 32), Q(125, 12), Q(-375, 64)],
        [0, Q(9477, 3392), Q(-729, 106), Q(25515, 6784)],
        [0, Q(-11, 7), Q(11, 3), Q(-55, 28)],
        [0, Q(3, 2), -4, Q(5, 2)],
    ],
    order_dense=4,
    citation="J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980) "
    "19-26; dense output: L. F. Shampine, M. W. Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1-22",
)

DORMAND_PRINCE_54 = EmbeddedPair(
    tableau=_DP54, dense=_DP54, error_order=5, controller="matlab", refine=4, longest_step=0.1
)

_TSIT54 = ButcherTableau(
    name="tsit5",
    order=5,
    c=[0, 0.161, 0.327, 0.9, 0.9800255409045097, 1, 1],
    A=[
        [],
        [0.161],
        [-0.008480655492356989, 0.335480655492357],
        [2.8971530571054935, -6.359448489975075, 4.3622954328695815],
        [5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525],
        [5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383],
        [0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081, 2.324710524099774],
    ],
    b=[0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081, 2.324710524099774, 0],
    b_hat=[
        0.09468075576583945,
        0.009183565540343254,
        0.4877705284247616,
        1.234297566930479,
        -2.7077123499835256,
        1.866628418170587,
        Q(1, 66),
    ],
    order_hat=4,
    P=[
        [1, -2.763706197274826, 2.9132554618219126, -1.0530884977290216],
        [0, 0.1317, -0.2234, 0.1017],
        [0, 3.9302962368947516, -5.941033872131505, 2.490627285651253],
        [0, -12.411077166933676, 30.33818863028232, -16.548102889244902],
        [0, 37.50931341651104, -88.1789048947664, 47.37952196281928],
        [0, -27.896526289197286, 65.09189467479366, -34.87065786149661],
        [0, 1.5, -4, 2.5],
    ],
    order_dense=4,
    citation="Ch. Tsitouras, Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying assumption, "
    "Comput. Math. Appl. 62 (2011) 770-775",
)

TSIT5 = EmbeddedPair(tableau=_TSIT54, dense=_TSIT54, error_order=5, controller="pi")
