"""Heun's method: predict by Euler's, correct by the trapezoidal rule once."""

from fractions import Fraction as Q

from qddot.runner.tableaux.butcher import ButcherTableau

METHOD = ButcherTableau(
    name="heun",
    order=2,
    c=[0, 1],
    A=[[], [1]],
    b=[Q(1, 2), Q(1, 2)],
    citation="K. Heun, Neue Methoden zur approximativen Integration, Z. Math. Phys. 45 (1900) 23-38",
)
