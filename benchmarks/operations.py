"""How many floating-point operations there are in what is timed."""

from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower_rhs
from qddot.codegen.sources import shipped


def of_rk4_step(name: str) -> int:
    """Of a step of the classical Runge-Kutta method over a shipped model; finding the inputs is not counted."""
    system = shipped(name)
    return 4 * lower_rhs(derive(system)).operations + 2 * len(system.coordinates) * (3 * 2 + 6)
