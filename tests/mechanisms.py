"""Models with constraints for tests, and how far a solution is from them."""

import numpy as np
from sympy import Matrix, Rational, Symbol, cos, pi, sin, sqrt, symbols

from qddot.model import Constraint, Coordinate, Output, Parameter, Rolling, System
from qddot.model.frames import (
    Named,
    Point,
    about,
    carried,
    from_quaternion,
    kinetic_energy,
    norm,
    potential_energy,
    rates_of,
    velocity,
)
from qddot.runner.inputs.bind import bind
from qddot.runner.observe import observer

HALF = Rational(1, 2)


def coordinates(unit, names):
    return [Coordinate(Symbol(name), unit, f"coordinate {name}") for name in names.split()]


def parameters(**values):
    """name = (default, unit)."""
    return [Parameter(Symbol(name), value, unit, f"parameter {name}") for name, (value, unit) in values.items()]


def spherical_pendulum(**changes):
    """In Cartesian coordinates, z up."""
    x, y, z, m, L, g = symbols("x y z m L g")
    xdot, ydot, zdot = symbols("xdot ydot zdot")
    given = {
        "name": "spherical_pendulum",
        "title": "Spherical pendulum in Cartesian coordinates",
        "coordinates": coordinates("m", "x y z"),
        "parameters": parameters(m=(1.5, "kg"), L=(0.7, "m"), g=(9.81, "m/s^2")),
        "kinetic_energy": HALF * m * (xdot**2 + ydot**2 + zdot**2),
        "potential_energy": m * g * z,
        "constraints": [Constraint(Symbol("lam"), x**2 + y**2 + z**2 - L**2, "N/m", "the rod")],
    }
    return System(**given | changes)


def slider_crank():
    """Crank r, connecting rod l, slider at x; in line: it passes its dead points."""
    a, b, x, r, l_, m_1, m_2, m_3, c, M = symbols("alpha beta x r l m_1 m_2 m_3 c M")
    adot, bdot, xdot = symbols("alphadot betadot xdot")
    across = -r * sin(a) * adot - l_ / 2 * sin(b) * bdot
    up = r * cos(a) * adot + l_ / 2 * cos(b) * bdot
    return System(
        name="slider_crank",
        title="Slider-crank",
        coordinates=[*coordinates("rad", "alpha beta"), *coordinates("m", "x")],
        parameters=parameters(
            r=(0.1, "m"),
            l=(0.3, "m"),
            m_1=(1.0, "kg"),
            m_2=(0.8, "kg"),
            m_3=(0.6, "kg"),
            c=(20.0, "N s/m"),
            M=(2.0, "N m"),
        ),
        kinetic_energy=m_1 * r**2 * adot**2 / 6
        + HALF * m_2 * (across**2 + up**2)
        + m_2 * l_**2 * bdot**2 / 24
        + HALF * m_3 * xdot**2,
        dissipation=HALF * c * xdot**2,
        generalized_forces={a: M},
        constraints=[
            Constraint(Symbol("lam_x"), r * cos(a) + l_ * cos(b) - x, "N", "pin of the slider, along"),
            Constraint(Symbol("lam_y"), r * sin(a) + l_ * sin(b), "N", "pin of the slider, across"),
        ],
    )


def rolling_disc():
    """A thin disc on a rough plane: place of its centre, heading psi, lean theta, turn phi."""
    x, y, z, psi, theta, phi = q = symbols("x y z psi theta phi")
    m, R, g = symbols("m R g")
    rates = rates_of(*q)
    turned = about("z", psi) @ about("x", theta) @ about("y", phi)
    frame = about("z", psi) @ about("x", theta)  # leans with the disc, does not turn with it
    lowest = frame * (0, 0, -R)
    speed = velocity((x, y, z), rates)
    omega = turned.matrix * turned.angular_velocity
    slip = speed + Matrix(omega).cross(Matrix(lowest))
    return System(
        name="rolling_disc",
        title="Disc that rolls on a plane",
        coordinates=[*coordinates("m", "x y z"), *coordinates("rad", "psi theta phi")],
        parameters=parameters(m=(2.0, "kg"), R=(0.25, "m"), g=(9.81, "m/s^2")),
        kinetic_energy=kinetic_energy(m, (m * R**2 / 4, m * R**2 / 2, m * R**2 / 4), speed, turned.angular_velocity),
        potential_energy=m * g * z,
        constraints=[
            Rolling(Symbol("mu_x"), slip[0], "N", "no slip along x"),
            Rolling(Symbol("mu_y"), slip[1], "N", "no slip along y"),
            Constraint(Symbol("lam"), z - R * cos(theta), "N", "contact"),
        ],
    )


def satellite():
    """A free rigid body by a quaternion; its angular momentum in space as outputs."""
    q = symbols("q_0:4")
    I_x, I_y, I_z = symbols("I_x I_y I_z")
    turned = from_quaternion(q)
    w = turned.angular_velocity
    momentum = turned * (I_x * w[0], I_y * w[1], I_z * w[2])
    return System(
        name="satellite",
        title="Satellite by a quaternion",
        coordinates=[Coordinate(each, "1", "component of the quaternion") for each in q],
        parameters=parameters(I_x=(1.0, "kg m^2"), I_y=(2.0, "kg m^2"), I_z=(2.6, "kg m^2")),
        kinetic_energy=HALF * (I_x * w[0] ** 2 + I_y * w[1] ** 2 + I_z * w[2] ** 2),
        constraints=[Constraint(Symbol("lam"), norm(q), "N m", "length of the quaternion")],
        outputs=[
            *(Output(Symbol(f"H_{k}"), h, "N m s", "angular momentum") for k, h in zip("xyz", momentum, strict=True)),
            *(Output(Symbol(f"w_{k}"), each, "rad/s", "angular velocity") for k, each in zip("xyz", w, strict=True)),
        ],
    )


def parallel_cranks():
    """A bar on three parallel cranks of one length: one constraint too many, wherever the cranks stand."""
    t1, t2, t3, a, m, g = symbols("theta_1 theta_2 theta_3 a m g")
    w1, w2, w3 = symbols("thetadot_1 thetadot_2 thetadot_3")
    pins = []
    for k, t in ((2, t2), (3, t3)):
        pins.append(Constraint(Symbol(f"lam_{k}x"), a * cos(t) - a * cos(t1), "N", f"bar and crank {k}, along"))
        pins.append(Constraint(Symbol(f"lam_{k}y"), a * sin(t) - a * sin(t1), "N", f"bar and crank {k}, across"))
    return System(
        name="parallel_cranks",
        title="A bar on three parallel cranks",
        coordinates=coordinates("rad", "theta_1 theta_2 theta_3"),
        parameters=parameters(a=(0.4, "m"), m=(2.0, "kg"), g=(9.81, "m/s^2")),
        kinetic_energy=m * a**2 * (w1**2 + w2**2 + w3**2) / 6 + HALF * m * a**2 * w1**2,
        potential_energy=m * g * a * (HALF * (sin(t1) + sin(t2) + sin(t3)) + sin(t1)),
        constraints=pins,
    )


def bicycle():
    """The benchmark bicycle: J. P. Meijaard et al., Proc. R. Soc. A 463 (2007) 1955-1982, table 1; z points down."""
    x, y, z, psi, phi, theta, delta, theta_R, theta_F = q = symbols("x y z psi phi theta delta theta_R theta_F")
    w, c, tilt, g, r_R, r_F = symbols("w c tilt g r_R r_F")
    x_B, z_B, x_H, z_H, m_R, m_B, m_H, m_F = symbols("x_B z_B x_H z_H m_R m_B m_H m_F")
    rates, named = rates_of(*q), Named()
    frame = named.rotation("B", about("z", psi) @ about("x", phi) @ about("y", theta))
    fork = named.rotation("H", frame @ about("y", tilt, 0) @ about("z", delta) @ about("y", -tilt, 0))

    def point(name, origin, turned, arm):
        found = carried(origin, turned, arm)
        return Point(found.position, named.vector(f"v_{name}", found.velocity, "m/s"))

    rear = Point((x, y, z), velocity((x, y, z), rates))
    rider = point("B", rear, frame, (x_B, 0, z_B + r_R))
    head = carried(rear, frame, (w + c, 0, r_R))  # where the steering axis meets the road
    bars = point("H", head, fork, (x_H - w - c, 0, z_H))
    front = point("F", head, fork, (-c, 0, -r_F))
    spin_R = frame.angular_velocity + Matrix([0, rates[theta_R], 0])
    spin_F = fork.angular_velocity + Matrix([0, rates[theta_F], 0])
    bodies = (
        (m_R, (0.0603, 0.12, 0.0603), rear, spin_R),
        (m_B, Matrix([[9.2, 0, 2.4], [0, 11.0, 0], [2.4, 0, 2.8]]), rider, frame.angular_velocity),
        (m_H, Matrix([[0.05892, 0, -0.00756], [0, 0.06, 0], [-0.00756, 0, 0.00708]]), bars, fork.angular_velocity),
        (m_F, (0.1405, 0.28, 0.1405), front, spin_F),
    )
    constraints = []
    for name, wheel, turned, radius, spin in (("R", rear, frame, r_R, spin_R), ("F", front, fork, r_F, spin_F)):
        axle = turned.matrix[:, 1]
        size = sqrt(1 - axle[2] ** 2)
        lowest = named.vector(f"low_{name}", radius * (Matrix([0, 0, 1]) - axle[2] * axle) / size, "m")
        turning = named.vector(f"spin_{name}", turned * spin, "rad/s")
        slip = Matrix(wheel.velocity) + Matrix(turning).cross(Matrix(lowest))
        constraints += [
            Constraint(Symbol(f"lam_{name}"), wheel.position[2] + radius * size, "N", f"contact, {name}"),
            Rolling(Symbol(f"mu_{name}x"), slip[0], "N", f"no slip along x, {name}"),
            Rolling(Symbol(f"mu_{name}y"), slip[1], "N", f"no slip along y, {name}"),
        ]
    lengths = {"w": 1.02, "c": 0.08, "r_R": 0.3, "r_F": 0.35, "x_B": 0.3, "z_B": -0.9, "x_H": 0.9, "z_H": -0.7}
    masses = {"m_R": 2.0, "m_B": 85.0, "m_H": 4.0, "m_F": 3.0}
    given = {name: (value, "m") for name, value in lengths.items()} | {n: (m, "kg") for n, m in masses.items()}
    return System(
        name="bicycle",
        title="Benchmark bicycle",
        coordinates=[*coordinates("m", "x y z"), *coordinates("rad", "psi phi theta delta theta_R theta_F")],
        parameters=parameters(**given, tilt=(float(pi) / 10, "rad"), g=(9.81, "m/s^2")),
        quantities=named.quantities,
        kinetic_energy=sum(kinetic_energy(m, inertia, at.velocity, spin) for m, inertia, at, spin in bodies),
        potential_energy=sum(potential_energy(m, at.position, (0, 0, g)) for m, _, at, _ in bodies),
        constraints=constraints,
    )


def off(model, solution, parameters_=None):
    """The greatest residuals of positions and of velocities at the saved points."""
    constraints, c = model.matrix("constraints"), model.constants(model.parameter_values(parameters_))
    n, greatest = model.tables.coordinates, np.zeros(2)
    states = np.array([solution[name] for name in model.state_names]).T
    for t, x in zip(solution.t, np.ascontiguousarray(states), strict=True):
        whole = constraints(t, x, np.zeros(1), c)
        greatest = np.maximum(greatest, np.abs(whole[n:, n:]).max(axis=0))
    return greatest


def energy(model, solution, parameters_=None):
    """Kinetic and potential energy together (n,) at the saved points, in J, of a model without inputs."""
    states = np.array([solution[name] for name in model.state_names]).T
    observe = observer(model, ["kinetic_energy", "potential_energy"])
    c = model.constants(model.parameter_values(parameters_))
    return observe(solution.t.copy(), np.ascontiguousarray(states), bind(model.tables, {}), c).sum(axis=1)
