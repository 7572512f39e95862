"""The pair of Dormand and Prince of order 5(4), run as MATLAB runs it."""

from fractions import Fraction as Q

from qddot.runner.tableaux.butcher import ButcherTableau
from qddot.runner.tableaux.embedded import EmbeddedPair

_TABLEAU = ButcherTableau(
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

METHOD = EmbeddedPair(tableau=_TABLEAU, dense=_TABLEAU, error_order=5, controller="matlab", refine=4, longest_step=0.1)
