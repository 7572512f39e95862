"""Explicit Runge-Kutta methods, from their pages."""

from qddot.runner.method import Method
from qddot.runner.tableaux.butcher import ButcherTableau
from qddot.runner.tableaux.embedded import EmbeddedPair


def runge_kutta(page: ButcherTableau | EmbeddedPair) -> Method:
    """The method that marches a tableau with a constant step, or that advances with a pair and controls its step."""
    if isinstance(page, EmbeddedPair):
        from qddot.runner.explicit.adaptive import integrate  # noqa: PLC0415 - only the driver that is asked for

        tableau, pair = page.tableau, page
    else:
        from qddot.runner.explicit.fixed import integrate  # noqa: PLC0415

        tableau, pair = page, None
    return Method(
        name=tableau.name,
        family="fixed" if pair is None else "adaptive",
        order=tableau.order,
        stages=tableau.stages,
        adaptive=pair is not None,
        stiff=False,
        citation=tableau.citation,
        integrate=integrate,
        tableau=tableau,
        pair=pair,
    )
