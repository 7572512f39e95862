"""The stiff methods."""

from qddot.runner.method import Method
from qddot.runner.stiff.ndf import integrate as integrate_ndf
from qddot.runner.stiff.ndf_formulas import HIGHEST_ORDER
from qddot.runner.stiff.rosenbrock import integrate as integrate_rosenbrock
from qddot.runner.stiff.tableau_rosenbrock import RODAS5P

METHODS = (
    Method(
        name="ode15s",
        family="stiff",
        order=HIGHEST_ORDER,
        stages=0,
        adaptive=True,
        stiff=True,
        citation="L. F. Shampine, M. W. Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1-22",
        integrate=integrate_ndf,
    ),
    Method(
        name=RODAS5P.name,
        family="stiff",
        order=RODAS5P.order,
        stages=RODAS5P.stages,
        adaptive=True,
        stiff=True,
        citation=RODAS5P.citation,
        integrate=integrate_rosenbrock,
    ),
)
