"""A chain of n equal masses joined by springs and dampers, shaken at one end."""

from itertools import pairwise

from sympy import Add, Rational, Symbol, symbols

from qddot.model.scene import Damper, Disc, Polygon, Spring
from qddot.model.system import Coordinate, Input, Output, Parameter, System

#: The most masses that are drawn: more are finer than a page shows.
DRAWN = 40


def system(n: int = 10) -> System:
    """Give a row of n masses: the first hangs on the shaken base, the last is free. Its name: chain, or chain_n."""
    q, qdot = symbols(f"q_1:{n + 1}"), symbols(f"qdot_1:{n + 1}")
    m, k, c, w, wdot = symbols("m k c w wdot")
    half = Rational(1, 2)
    left, left_rate = (w, *q[:-1]), (wdot, *qdot[:-1])
    places = [_place(i, displacement) for i, displacement in enumerate((w, *q[:DRAWN]))]
    links = list(pairwise(places))
    return System(
        name="chain" if n == 10 else f"chain_{n}",
        title=f"Chain of {n} masses shaken at one end",
        coordinates=tuple(Coordinate(q[i], "m", f"displacement of mass {i + 1}") for i in range(n)),
        parameters=(
            Parameter(m, 1.0, "kg", "mass of each link"),
            Parameter(k, 1000.0, "N/m", "stiffness of each spring"),
            Parameter(c, 1.0, "N s/m", "damping of each damper"),
        ),
        inputs=(Input(w, "m", "displacement of the base"),),
        kinetic_energy=Add(*(half * m * v**2 for v in qdot)),
        potential_energy=Add(*(half * k * (q[i] - left[i]) ** 2 for i in range(n))),
        dissipation=Add(*(half * c * (qdot[i] - left_rate[i]) ** 2 for i in range(n))),
        outputs=(
            Output(Symbol("base_force"), k * (w - q[0]) + c * (wdot - qdot[0]), "N", "force of the base on the chain"),
        ),
        scene=()
        if n > DRAWN
        else (
            Polygon([(-0.03, -0.12), (0, -0.12), (0, 0.12), (-0.03, 0.12)], at=(places[0], 0), colour="grey"),
            *(Spring((start, 0.025), (end, 0.025), 0.03) for start, end in links),
            *(Damper((start, -0.025), (end, -0.025), 0.02) for start, end in links),
            *(Disc((place, 0), 0.035, colour="blue") for place in places[1:]),
        ),
    )


def _place(i, displacement):  # type: ignore[no-untyped-def]
    """Where the scene shows a mass: a fifth of a metre apart, five times what they move."""
    return Rational(i, 5) + 5 * displacement
