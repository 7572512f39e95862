"""Mechanisms of the library of computational benchmark problems: M. González, D. Dopico, U. Lugrís, J. Cuadrado,
Multibody System Dynamics 16 (2006) 179-190, now kept by IFToMM's committee for multibody dynamics; A01 to A05 there."""

from mechanisms import HALF, coordinates, parameters
from sympy import Matrix, Rational, Symbol, cos, pi, sin, sqrt, symbols

from qddot.model import Constraint, System
from qddot.model.frames import (
    Named,
    Point,
    about,
    carried,
    kinetic_energy,
    potential_energy,
    rates_of,
    velocity,
)


def planar_pendulum():
    """A01: a point of 1 kg on a massless rod of 1 m, in Cartesian coordinates."""
    x, y, xdot, ydot, m, L, g = symbols("x y xdot ydot m L g")
    return System(
        name="planar_pendulum",
        title="Planar pendulum",
        coordinates=coordinates("m", "x y"),
        parameters=parameters(m=(1.0, "kg"), L=(1.0, "m"), g=(9.81, "m/s^2")),
        kinetic_energy=HALF * m * (xdot**2 + ydot**2),
        potential_energy=m * g * y,
        constraints=[Constraint(Symbol("lam"), x**2 + y**2 - L**2, "N/m", "the rod")],
    )


def four_bars(count):
    """A02: `count` four-bar linkages in a row, of links of 1 m and 1 kg: cranks a_0, a_1, ..., bars b_1, ... on them.

    Lying flat it may go on in many ways: all cranks together or bent.
    """
    cranks, bars = symbols(f"a_0:{count + 1}"), symbols(f"b_1:{count + 1}")
    rates, (m, L, g) = rates_of(*cranks, *bars), symbols("m L g")
    kinetic = sum(m * L**2 * rates[a] ** 2 for a in cranks) / 6
    potential = sum(m * g * L * sin(a) for a in cranks) / 2
    held = []
    for k, b in enumerate(bars):
        left, right = cranks[k], cranks[k + 1]
        along = rates[left] ** 2 + rates[left] * rates[b] * cos(left - b) + rates[b] ** 2 / 3
        kinetic += HALF * m * L**2 * along
        potential += m * g * L * (sin(left) + sin(b) / 2)
        closed = (cos(left) + cos(b) - cos(right) - 1, sin(left) + sin(b) - sin(right))
        held += [
            Constraint(Symbol(f"lam_{k + 1}{way}"), L * f, "N", f"pin {k + 1}, {way}")
            for way, f in zip("xy", closed, strict=True)
        ]
    return System(
        name=f"four_bars_{count}",
        title=f"{count} four-bar linkages in a row",
        coordinates=coordinates("rad", " ".join(map(str, (*cranks, *bars)))),
        parameters=parameters(m=(1.0, "kg"), L=(1.0, "m"), g=(9.81, "m/s^2")),
        kinetic_energy=kinetic,
        potential_energy=potential,
        constraints=held,
    )


#: Of Bricard's mechanism: the axis of each hinge, and the way from it to the next one, at the start.
HINGES = (("y", (1, 0, 0)), ("z", (0, -1, 0)), ("x", (0, 0, 1)), ("y", (-1, 0, 0)), ("z", (0, 1, 0)))


def bricard():
    """A04: five rods of 1 m, 1 kg and a section of 0.1 m x 0.1 m on six hinges, one of them too many; y points up.

    Angles of five hinges, from one end on; the sixth, along x at (0, 0, 1 m), closes the loop by five equations of
    which four are independent.
    """
    q, (m, L, g) = symbols("a_1:6"), symbols("m L g")
    named = Named()
    turned, hinge = about("x", 0, 0), Point(Matrix([0, 0, 0]), Matrix([0, 0, 0]))
    kinetic = potential = 0
    for k, (axis, way) in enumerate(HINGES, 1):
        turned = named.rotation(f"{k}", turned @ about(axis, q[k - 1]))
        middle = carried(hinge, turned, HALF * L * Matrix(way))
        middle = Point(middle.position, named.vector(f"v_{k}", middle.velocity, "m/s"))
        hinge = carried(middle, turned, HALF * L * Matrix(way))
        inertia = [m * L**2 * (Rational(1, 600) if each else Rational(101, 1200)) for each in way]
        kinetic += kinetic_energy(m, inertia, middle.velocity, turned.angular_velocity)
        potential += potential_energy(m, middle.position, (0, -g, 0))
    closed = (*(hinge.position - L * Matrix([0, 0, 1])), turned.matrix[1, 0], turned.matrix[2, 0])
    units = ("N", "N", "N", "N m", "N m")
    return System(
        name="bricard",
        title="Bricard's mechanism",
        coordinates=coordinates("rad", " ".join(map(str, q))),
        parameters=parameters(m=(1.0, "kg"), L=(1.0, "m"), g=(9.81, "m/s^2")),
        quantities=named.quantities,
        kinetic_energy=kinetic,
        potential_energy=potential,
        constraints=[
            Constraint(Symbol(f"lam_{j}"), f, unit, "the last hinge")
            for j, (f, unit) in enumerate(zip(closed, units, strict=True), 1)
        ],
    )


def governor():
    """A05: a shaft turns, two rods with balls hang on it, and springs and dampers from their middles hold a slider."""
    phi, b_1, b_2, s = q = symbols("phi b_1 b_2 s")
    rates = rates_of(*q)
    m_rod, m_ball, m_slider, K, C, g = symbols("m_rod m_ball m_slider K C g")
    side, height, L, rest = Rational(1, 20), 1, 1, HALF
    section = Rational(1, 100) ** 2
    kinetic = (
        HALF * (m_rod * section / 6 + m_slider * side**2 * 4 / 6) * rates[phi] ** 2 + HALF * m_slider * rates[s] ** 2
    )
    potential, dissipation = m_slider * g * s, 0
    for way, b in ((0, b_1), (pi, b_2)):
        shaft = about("z", phi) @ about("z", way, 0)
        rod = shaft @ about("y", b)
        pin = shaft * (side, 0, height)
        for share, mass in ((HALF, m_rod), (1, m_ball)):
            at = Matrix(pin) + rod * (share * L, 0, 0)
            slim = [mass * section / 6, *2 * [mass * (L**2 + section) / 12]] if share == HALF else [0, 0, 0]
            kinetic += kinetic_energy(mass, slim, velocity(at, rates), rod.angular_velocity)
            potential += potential_energy(mass, at, (0, 0, -g))
        length = sqrt((L * cos(b) / 2) ** 2 + (height - L * sin(b) / 2 - s) ** 2)
        potential += HALF * K * (length - rest) ** 2
        dissipation += HALF * C * (length.diff(b) * rates[b] + length.diff(s) * rates[s]) ** 2
    return System(
        name="governor",
        title="Stiff flyball governor",
        coordinates=[*coordinates("rad", "phi b_1 b_2"), *coordinates("m", "s")],
        parameters=parameters(
            m_rod=(0.3, "kg"),
            m_ball=(5.0, "kg"),
            m_slider=(3.0, "kg"),
            K=(8e5, "N/m"),
            C=(4e4, "N s/m"),
            g=(9.81, "m/s^2"),
        ),
        kinetic_energy=kinetic,
        potential_energy=potential,
        dissipation=dissipation,
    )
