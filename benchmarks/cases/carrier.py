"""A tracked carrier in space: a hull on wheels, each turning at the end of an arm that swings; no angle is small.

Of 16 wheels it has 38 degrees of freedom. Its mass matrix is an arrow: the hull is coupled with all wheels, these with
their own arms alone.
"""

from sympy import Matrix, Rational, Symbol, cos, sin, symbols

from qddot.model.frames import Named, about, kinetic_energy, potential_energy, rates_of
from qddot.model.part import Part
from qddot.model.system import Coordinate, Output, Parameter, Quantity, System

HALF = Rational(1, 2)
COORDINATES = x, y, z, psi, theta, phi = symbols("x y z psi theta phi")
M, I_x, I_y, I_z, g = symbols("M I_x I_y I_z g")
m, J, r, length, k, c, k_t, c_t, alpha_0 = symbols("m J r length k c k_t c_t alpha_0")
alpha, spin, alphadot, spindot, ahead, aside = symbols("alpha spin alphadot spindot ahead aside")


def _hull() -> tuple[Part, Matrix, Matrix, Matrix]:
    """The part, and by name its rotation's matrix, its angular velocity and its velocity in its own axes."""
    named, rates = Named(), rates_of(*COORDINATES)
    turned = named.rotation("H", about("z", psi) @ about("y", theta) @ about("x", phi))
    along = named.vector("u", turned.matrix.T * Matrix([rates[each] for each in (x, y, z)]), "m/s")
    part = Part(
        "hull",
        coordinates=(
            *(Coordinate(each, "m", f"place of the hull along {each}") for each in (x, y, z)),
            *(Coordinate(each, "rad", f"{what} of the hull") for each, what in ((psi, "yaw"), (theta, "pitch"))),
            Coordinate(phi, "rad", "roll of the hull"),
        ),
        quantities=named.quantities,
        kinetic_energy=kinetic_energy(M, (I_x, I_y, I_z), along, turned.angular_velocity),
        potential_energy=potential_energy(M, COORDINATES[:3], (0, 0, -g)),
        parameters=(
            Parameter(M, 9000.0, "kg", "mass of the hull"),
            Parameter(I_x, 6000.0, "kg m^2", "moment of inertia of the hull in roll"),
            Parameter(I_y, 18000.0, "kg m^2", "moment of inertia of the hull in pitch"),
            Parameter(I_z, 20000.0, "kg m^2", "moment of inertia of the hull in yaw"),
            Parameter(g, 9.81, "m/s^2", "acceleration of gravity"),
        ),
        outputs=(Output(Symbol("rise"), Symbol("zddot"), "m/s^2", "acceleration of the hull upwards"),),
    )
    return part, Matrix(turned.matrix), Matrix(turned.angular_velocity), Matrix(along)


def _station(matrix: Matrix, omega: Matrix, along: Matrix) -> Part:
    """A wheel on its arm; it stands on level ground by a spring, and slips on it against a damper."""
    arm = Matrix([ahead - length * cos(alpha), aside, -length * sin(alpha)])
    swing = alphadot * Matrix([length * sin(alpha), 0, -length * cos(alpha)])
    speeds = Named()
    velocity = Matrix(speeds.vector("w", along + omega.cross(arm) + swing, "m/s"))
    depth, depthdot = symbols("depth depthdot")
    height = Quantity(depth, (z + (matrix * arm)[2]) - r, "m", "height of the {} over the ground", rate=depthdot)
    turning = omega[1] + spindot
    return Part(
        "wheel",
        shared=(m, J, r, length, k, c, alpha_0, k_t, c_t),
        coordinates=(
            Coordinate(alpha, "rad", "angle of the arm of the {}"),
            Coordinate(spin, "rad", "angle of the {}"),
        ),
        quantities=(*speeds.quantities, height),
        kinetic_energy=HALF * m * velocity.dot(velocity) + HALF * J * turning**2,
        potential_energy=m * g * depth + HALF * k * (alpha - alpha_0) ** 2 + HALF * k_t * depth**2,
        dissipation=HALF * c * alphadot**2 + HALF * c_t * (velocity[0] - r * turning) ** 2,
        parameters=(
            Parameter(ahead, 0.0, "m", "the {} is ahead of the centre of mass"),
            Parameter(aside, 0.0, "m", "the {} is left of the centre of mass"),
            Parameter(m, 120.0, "kg", "mass of a wheel"),
            Parameter(J, 5.0, "kg m^2", "moment of inertia of a wheel"),
            Parameter(r, 0.3, "m", "radius of a wheel"),
            Parameter(length, 0.35, "m", "length of an arm"),
            Parameter(k, 2.5e4, "N m/rad", "stiffness of the bar of an arm"),
            Parameter(c, 600.0, "N m s/rad", "damping of an arm"),
            Parameter(alpha_0, 0.6, "rad", "angle of an arm whose bar is at rest"),
            Parameter(k_t, 4e5, "N/m", "stiffness of the ground under a wheel"),
            Parameter(c_t, 2000.0, "N s/m", "resistance of the ground to slip"),
        ),
    )


def system(stations: int = 16) -> System:
    """Give a carrier of so many wheels, half of them on either side: 6 + 2 stations degrees of freedom."""
    hull, *frame = _hull()
    station, half = _station(*frame), stations // 2
    whole = hull
    for side, sign in (("l", 1.2), ("r", -1.2)):
        for n in range(half):
            place = 2.0 - 4.0 * n / max(1, half - 1)
            mark = f"{side}{n + 1}"
            whole += station(mark, f"wheel {mark}", ahead=place, aside=sign)
    name = f"carrier_{6 + 2 * stations}"
    return whole.system(name, f"Carrier on {stations} wheels, {6 + 2 * stations} degrees of freedom")
