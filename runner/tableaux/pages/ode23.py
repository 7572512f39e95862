"""The pair of Bogacki and Shampine of order 3(2), run as MATLAB runs it."""

from fractions import Fraction as Q

from qddot.runner.tableaux.butcher import ButcherTableau
from qddot.runner.tableaux.embedded import EmbeddedPair

_TABLEAU = ButcherTableau(
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

METHOD = EmbeddedPair(tableau=_TABLEAU, dense=_TABLEAU, error_order=3, controller="matlab", longest_step=0.1)
