"""A pendulum of n equal links: point masses on massless rods, viscous joints."""

from itertools import pairwise

from sympy import Add, Rational, Symbol, cos, sin, symbols

from qddot.model.scene import Bar, Disc
from qddot.model.system import Coordinate, Output, Parameter, System

#: The most links that are drawn: places of many are longer to derive than their equations.
DRAWN = 12


def system(n: int = 3) -> System:
    """Give a chain of n links, each angle from the downward vertical. Its name: pendulum, or pendulum_n."""
    theta, thetadot = symbols(f"theta_1:{n + 1}"), symbols(f"thetadot_1:{n + 1}")
    m, length, c, g = symbols("m L c g")
    half = Rational(1, 2)
    x = [length * Add(*(sin(angle) for angle in theta[: i + 1])) for i in range(n)]
    y = [-length * Add(*(cos(angle) for angle in theta[: i + 1])) for i in range(n)]
    speed_squared = [
        Add(*(cos(theta[i]) * thetadot[i] for i in range(j + 1))) ** 2
        + Add(*(sin(theta[i]) * thetadot[i] for i in range(j + 1))) ** 2
        for j in range(n)
    ]
    masses = list(zip(x, y, strict=True))
    joints = (thetadot[0], *(thetadot[i] - thetadot[i - 1] for i in range(1, n)))
    return System(
        name="pendulum" if n == 3 else f"pendulum_{n}",
        title=f"Pendulum of {n} links",
        coordinates=tuple(Coordinate(theta[i], "rad", f"angle of link {i + 1}") for i in range(n)),
        parameters=(
            Parameter(m, 1.0, "kg", "mass at the end of each link"),
            Parameter(length, 1.0, "m", "length of each link"),
            Parameter(c, 0.0, "N m s/rad", "viscous damping of each joint"),
            Parameter(g, 9.81, "m/s^2", "acceleration of gravity"),
        ),
        kinetic_energy=half * m * length**2 * Add(*speed_squared),
        potential_energy=m * g * Add(*y),
        dissipation=half * c * Add(*(rate**2 for rate in joints)),
        outputs=(
            Output(Symbol("x_tip"), x[-1], "m", "horizontal position of the tip"),
            Output(Symbol("y_tip"), y[-1], "m", "height of the tip over the pivot"),
        ),
        scene=()
        if n > DRAWN
        else (
            *(Bar(upper, lower) for upper, lower in pairwise([(0, 0), *masses])),
            Disc((0, 0), colour="dark"),
            *(Disc(mass, length / 10) for mass in masses),
        ),
    )
