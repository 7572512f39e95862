"""The classical method of Runge and Kutta, of order 4."""

from fractions import Fraction as Q

from qddot.runner.tableaux.butcher import ButcherTableau

METHOD = ButcherTableau(
    name="rk4",
    order=4,
    c=[0, Q(1, 2), Q(1, 2), 1],
    A=[[], [Q(1, 2)], [0, Q(1, 2)], [0, 0, 1]],
    b=[Q(1, 6), Q(1, 3), Q(1, 3), Q(1, 6)],
    citation="W. Kutta, Z. Math. Phys. 46 (1901) 435-453; HNW, table II.1.2",
)
