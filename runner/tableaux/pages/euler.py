"""Euler's method."""

from qddot.runner.tableaux.butcher import ButcherTableau

METHOD = ButcherTableau(
    name="euler",
    order=1,
    c=[0],
    A=[[]],
    b=[1],
    citation="L. Euler, Institutionum Calculi Integralis I (1768), section 650; HNW, equation I.7.3",
)
