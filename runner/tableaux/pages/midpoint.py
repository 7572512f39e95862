"""The explicit midpoint rule."""

from fractions import Fraction as Q

from qddot.runner.tableaux.butcher import ButcherTableau

METHOD = ButcherTableau(
    name="midpoint",
    order=2,
    c=[0, Q(1, 2)],
    A=[[], [Q(1, 2)]],
    b=[0, 1],
    citation="C. Runge, Math. Ann. 46 (1895) 167-178; HNW, equation II.1.4",
)
