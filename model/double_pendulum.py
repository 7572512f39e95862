"""Two point masses on massless rods with viscous joints; the mass matrix depends on the angles."""

from sympy import Rational, Symbol, cos, sin, symbols

from qddot.model.scene import Bar, Disc
from qddot.model.system import Coordinate, Output, Parameter, System


def system() -> System:
    """Angles from the downward vertical (Goldstein, Classical Mechanics, section 1.4, problem 22)."""
    theta_1, theta_2, thetadot_1, thetadot_2 = symbols("theta_1 theta_2 thetadot_1 thetadot_2")
    m_1, m_2, l_1, l_2, c_1, c_2, g = symbols("m_1 m_2 l_1 l_2 c_1 c_2 g")
    half = Rational(1, 2)
    height_1 = -l_1 * cos(theta_1)
    height_2 = height_1 - l_2 * cos(theta_2)
    upper = (l_1 * sin(theta_1), height_1)
    lower = (l_1 * sin(theta_1) + l_2 * sin(theta_2), height_2)
    return System(
        name="double_pendulum",
        title="Double pendulum, 2 degrees of freedom",
        coordinates=(
            Coordinate(theta_1, "rad", "angle of the upper rod"),
            Coordinate(theta_2, "rad", "angle of the lower rod"),
        ),
        parameters=(
            Parameter(m_1, 1.0, "kg", "upper mass"),
            Parameter(m_2, 1.0, "kg", "lower mass"),
            Parameter(l_1, 1.0, "m", "length of the upper rod"),
            Parameter(l_2, 1.0, "m", "length of the lower rod"),
            Parameter(c_1, 0.0, "N m s/rad", "viscous damping of the upper joint"),
            Parameter(c_2, 0.0, "N m s/rad", "viscous damping of the lower joint"),
            Parameter(g, 9.81, "m/s^2", "acceleration of gravity"),
        ),
        kinetic_energy=half * (m_1 + m_2) * l_1**2 * thetadot_1**2
        + half * m_2 * l_2**2 * thetadot_2**2
        + m_2 * l_1 * l_2 * thetadot_1 * thetadot_2 * cos(theta_1 - theta_2),
        potential_energy=m_1 * g * height_1 + m_2 * g * height_2,
        dissipation=half * c_1 * thetadot_1**2 + half * c_2 * (thetadot_2 - thetadot_1) ** 2,
        outputs=(
            Output(Symbol("x_2"), lower[0], "m", "horizontal position of the lower mass"),
            Output(Symbol("y_2"), height_2, "m", "height of the lower mass over the pivot"),
        ),
        scene=(
            Bar((0, 0), upper),
            Bar(upper, lower),
            Disc((0, 0), colour="dark"),
            Disc(upper, l_1 / 12),
            Disc(lower, l_2 / 12),
        ),
    )
