"""The explicit methods that control their step."""

from qddot.runner.explicit.adaptive import integrate
from qddot.runner.explicit.tableau_adaptive import BOGACKI_SHAMPINE_32, DORMAND_PRINCE_54, TSIT5, EmbeddedPair
from qddot.runner.explicit.tableau_dop853 import DOP853
from qddot.runner.explicit.tableau_vern7 import VERN7
from qddot.runner.methods import Method


def adaptive_step(pair: EmbeddedPair) -> Method:
    """The method that advances with `pair` and controls its step."""
    tableau = pair.tableau
    return Method(
        name=tableau.name,
        family="adaptive",
        order=tableau.order,
        stages=tableau.stages,
        adaptive=True,
        stiff=False,
        citation=tableau.citation,
        integrate=integrate,
        tableau=tableau,
        pair=pair,
    )


METHODS = tuple(map(adaptive_step, (BOGACKI_SHAMPINE_32, DORMAND_PRINCE_54, TSIT5, DOP853, VERN7)))
