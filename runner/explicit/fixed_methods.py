"""The methods that march with a constant step."""

from qddot.runner.explicit.fixed import integrate
from qddot.runner.explicit.tableau import EULER, HEUN, MIDPOINT, RK4, ButcherTableau
from qddot.runner.methods import Method


def fixed_step(tableau: ButcherTableau, name: str | None = None) -> Method:
    """The method that marches `tableau` with a constant step."""
    return Method(
        name=name or tableau.name,
        family="fixed",
        order=tableau.order,
        stages=tableau.stages,
        adaptive=False,
        stiff=False,
        citation=tableau.citation,
        integrate=integrate,
        tableau=tableau,
    )


METHODS = tuple(map(fixed_step, (EULER, HEUN, MIDPOINT, RK4)))
