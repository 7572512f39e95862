"""The exact method."""

from qddot.runner.exact.run import integrate
from qddot.runner.method import Method

METHODS = (
    Method(
        name="exact",
        family="exact",
        order=0,
        stages=0,
        adaptive=False,
        stiff=False,
        citation="C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404; "
        "A. H. Al-Mohy, N. J. Higham, SIAM J. Sci. Comput. 33 (2011) 488-511",
        integrate=integrate,
    ),
)
