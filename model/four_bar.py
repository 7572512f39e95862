"""A four-bar linkage by its three angles, closed by two constraints: crank, coupler and rocker are uniform bars."""

from sympy import Rational, Symbol, cos, sin, symbols

from qddot.model.constraints import Constraint
from qddot.model.scene import Arrow, Bar, Disc, Polygon
from qddot.model.system import Coordinate, Input, Output, Parameter, System


def system() -> System:
    """Give the linkage: crank and rocker turn about pins a distance d apart, the coupler joins their ends."""
    theta, rate = symbols("theta_1:4"), symbols("thetadot_1:4")
    length, mass = symbols("l_1:4"), symbols("m_1:4")
    d, c, g, torque, lam_x, lam_y = symbols("d c g M_1 lam_x lam_y")
    half = Rational(1, 2)
    crank, coupler, rocker = zip(length, theta, rate, strict=True)
    starts = ((), (crank,), ())
    speeds = [_middle_speed_squared(before, bar) for before, bar in zip(starts, (crank, coupler, rocker), strict=True)]
    heights = [
        sum(l_1 * sin(angle) for l_1, angle, _ in before) + half * bar[0] * sin(bar[1])
        for before, bar in zip(starts, (crank, coupler, rocker), strict=True)
    ]
    pin = (length[0] * cos(theta[0]), length[0] * sin(theta[0]))
    end = (pin[0] + length[1] * cos(theta[1]), pin[1] + length[1] * sin(theta[1]))
    closing = (d + length[2] * cos(theta[2]), length[2] * sin(theta[2]))
    foot = [(0, 0), (0.06, -0.1), (-0.06, -0.1)]
    return System(
        name="four_bar",
        title="Four-bar linkage, closed by two constraints",
        coordinates=(
            Coordinate(theta[0], "rad", "angle of the crank"),
            Coordinate(theta[1], "rad", "angle of the coupler"),
            Coordinate(theta[2], "rad", "angle of the rocker"),
        ),
        parameters=(
            Parameter(length[0], 0.3, "m", "length of the crank"),
            Parameter(length[1], 0.8, "m", "length of the coupler"),
            Parameter(length[2], 0.6, "m", "length of the rocker"),
            Parameter(d, 0.9, "m", "distance of the fixed pins"),
            Parameter(mass[0], 1.0, "kg", "mass of the crank"),
            Parameter(mass[1], 2.0, "kg", "mass of the coupler"),
            Parameter(mass[2], 1.5, "kg", "mass of the rocker"),
            Parameter(c, 0.0, "N m s/rad", "viscous damping of the crank's pin"),
            Parameter(g, 9.81, "m/s^2", "acceleration of gravity"),
        ),
        inputs=(Input(torque, "N m", "torque on the crank"),),
        kinetic_energy=sum(
            half * m * (speed + bar[0] ** 2 * bar[2] ** 2 / 12)
            for m, speed, bar in zip(mass, speeds, (crank, coupler, rocker), strict=True)
        ),
        potential_energy=g * sum(m * height for m, height in zip(mass, heights, strict=True)),
        dissipation=half * c * rate[0] ** 2,
        generalized_forces={theta[0]: torque},
        constraints=(
            Constraint(lam_x, _closing(cos, length, theta) - d, "N", "force in the pin of the rocker, horizontal"),
            Constraint(lam_y, _closing(sin, length, theta), "N", "force in the pin of the rocker, vertical"),
        ),
        outputs=(
            Output(Symbol("x_pin"), pin[0], "m", "horizontal position of the crank's end"),
            Output(Symbol("y_pin"), pin[1], "m", "height of the crank's end over its pin"),
        ),
        scene=(
            Polygon(foot, colour="grey"),
            Polygon(foot, at=(d, 0), colour="grey"),
            Bar((d, 0), closing, 0.05, colour="olive"),
            Bar(pin, end, 0.05),
            Bar((0, 0), pin, 0.05, colour="orange"),
            *(Disc(place, 0.02, colour="dark") for place in ((0, 0), pin, closing, (d, 0))),
            Arrow(closing, (lam_x, lam_y)),  # on the rocker
        ),
    )


def _closing(wave, length, theta):  # type: ignore[no-untyped-def]
    return length[0] * wave(theta[0]) + length[1] * wave(theta[1]) - length[2] * wave(theta[2])


def _middle_speed_squared(before, bar):  # type: ignore[no-untyped-def]
    """The squared speed of the middle of a bar behind others."""
    bars = (*before, (bar[0] / 2, *bar[1:]))
    across = sum(length * sin(angle) * rate for length, angle, rate in bars)
    up = sum(length * cos(angle) * rate for length, angle, rate in bars)
    return across**2 + up**2
