"""One axle of the M113 under a fixed hull, released from rest: equation (12) of paper 2116, solved there by (13)."""

from sympy import Rational, Symbol, symbols

from qddot.model.scene import Ground, Polygon, Spring, Wheel
from qddot.model.system import Coordinate, Output, Parameter, System


def system() -> System:
    """m_2 q'' + (k_2 + k_7) q = -m_2 g; the stiffness as the paper ran it and as it is printed."""
    q, qdot, m, k_2, k_7, g = symbols("q_2 qdot_2 m_2 k_2 k_7 g")
    half = Rational(1, 2)
    place = 0.56 + 100 * q  # of the wheel: the scene shows a hundred times what the axle moves
    return System(
        name="one_axle",
        title="Second axle of the M113 under a fixed hull",
        coordinates=(Coordinate(q, "m", "vertical displacement of axle 2"),),
        parameters=(
            Parameter(m, 120.0, "kg", "unsprung mass, axle 2"),
            Parameter(k_2, 2.15e6, "N/m", "tyre stiffness, axle 2"),
            Parameter(k_7, 6.5e4, "N/m", "suspension stiffness, axle 2"),
            Parameter(g, 9.81, "m/s^2", "acceleration of gravity"),
        ),
        kinetic_energy=half * m * qdot**2,
        potential_energy=half * (k_2 + k_7) * q**2,
        generalized_forces={q: -m * g},
        outputs=(Output(Symbol("axle_force"), (k_2 + k_7) * q, "N", "force of both springs on the axle"),),
        scene=(
            Ground([(0, 0)]),
            Polygon([(-0.7, 1.2), (0.7, 1.2), (0.6, 1.5), (-0.6, 1.5)], colour="olive"),
            Spring((0, place), (0, 1.2), 0.16),
            Wheel((0, place), 0.3, angle=0),
            Spring((0, 0), (0, place - 0.3), 0.16),
        ),
        parameter_sets={"as_run": {k_2: 2.15e6}, "as_printed": {k_2: 2.15e7}},
    )
