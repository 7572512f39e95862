"""A cart on a rail with a pole hinged to it, driven by a force on the cart."""

from sympy import Rational, Symbol, cos, sin, symbols

from qddot.model.scene import Arrow, Bar, Disc, Ground, Polygon, Wheel
from qddot.model.system import Coordinate, Input, Output, Parameter, System


def system() -> System:
    """The pole is a uniform rod; its angle counts from the upright position."""
    x, theta, xdot, thetadot = symbols("x theta xdot thetadot")
    m_c, m_p, length, c_x, c_theta, g, force = symbols("m_c m_p L c_x c_theta g F")
    half = Rational(1, 2)
    middle_x, middle_y = xdot + half * length * cos(theta) * thetadot, -half * length * sin(theta) * thetadot
    return System(
        name="cart_pole",
        title="Cart and pole, 2 degrees of freedom",
        coordinates=(Coordinate(x, "m", "position of the cart"), Coordinate(theta, "rad", "angle of the pole")),
        parameters=(
            Parameter(m_c, 1.0, "kg", "mass of the cart"),
            Parameter(m_p, 0.1, "kg", "mass of the pole"),
            Parameter(length, 1.0, "m", "length of the pole"),
            Parameter(c_x, 0.05, "N s/m", "viscous friction of the cart"),
            Parameter(c_theta, 0.001, "N m s/rad", "viscous friction of the hinge"),
            Parameter(g, 9.81, "m/s^2", "acceleration of gravity"),
        ),
        inputs=(Input(force, "N", "force on the cart"),),
        kinetic_energy=half * m_c * xdot**2
        + half * m_p * (middle_x**2 + middle_y**2)
        + Rational(1, 24) * m_p * length**2 * thetadot**2,
        potential_energy=half * m_p * g * length * cos(theta),
        dissipation=half * c_x * xdot**2 + half * c_theta * thetadot**2,
        generalized_forces={x: force},
        scene=(
            Ground([(x, -0.16)], depth=0.05, colour="grey"),
            Arrow((x, 0), (force, 0)),
            Polygon([(-0.25, -0.08), (0.25, -0.08), (0.25, 0.08), (-0.25, 0.08)], at=(x, 0)),
            Wheel((x - 0.15, -0.09), 0.07, angle=-x / 0.07),
            Wheel((x + 0.15, -0.09), 0.07, angle=-x / 0.07),
            Bar((x, 0), (x + length * sin(theta), length * cos(theta)), 0.05, colour="orange"),
            Disc((x, 0), 0.035, colour="dark"),
        ),
        outputs=(Output(Symbol("x_tip"), x + length * sin(theta), "m", "horizontal position of the pole's tip"),),
    )
