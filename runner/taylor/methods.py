"""Taylor's method."""

from qddot.runner.machine.series_memory import HIGHEST
from qddot.runner.method import Method
from qddot.runner.taylor.run import integrate

METHODS = (
    Method(
        name="taylor",
        family="taylor",
        order=HIGHEST,
        stages=0,
        adaptive=True,
        stiff=False,
        citation="A. Jorba, M. Zou, A software package for the numerical integration of ODEs by means of high-order "
        "Taylor methods, Experimental Mathematics 14 (2005) 99-117",
        integrate=integrate,
    ),
)
