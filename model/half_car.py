"""The half car in side view: heave and pitch of the body, one wheel in front and one behind."""

from sympy import Rational, Symbol, symbols

from qddot.model.part import Part
from qddot.model.scene import Damper, Ground, Polygon, Spring, Wheel
from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, System

HALF = Rational(1, 2)
z_b, theta, zdot_b, thetadot, m_b, I_b, a_f, a_r = symbols("z_b theta zdot_b thetadot m_b I_b a_f a_r")
z, zdot, w, m, k, c, k_t = symbols("z zdot w m k c k_t{}")
delta, deltadot, ahead = symbols("delta deltadot ahead")

deflection = Quantity(delta, z_b + ahead * theta - z, "m", "{} suspension deflection", rate=deltadot)

axle = Part(
    "axle",
    coordinates=(Coordinate(z, "m", "displacement of the {} wheel"),),
    inputs=(Input(w, "m", "road height under the {} wheel", position=ahead),),
    quantities=(deflection,),
    kinetic_energy=HALF * m * zdot**2,
    potential_energy=HALF * (k * delta**2 + k_t * (z - w) ** 2),
    dissipation=HALF * c * deltadot**2,
    scene=(
        Wheel((ahead, z + 0.3), 0.3),
        Spring((ahead - 0.06, z + 0.3), (ahead - 0.06, z_b + ahead * theta + 0.82), 0.1),
        Damper((ahead + 0.07, z_b + ahead * theta + 0.82), (ahead + 0.07, z + 0.3), 0.07),
    ),
    outputs=(deflection, Output(Symbol("tyre_force"), k_t * (w - z), "N", "dynamic {} tyre force")),
    parameters=(
        Parameter(m, 40.0, "kg", "{} unsprung mass"),
        Parameter(k, 2e4, "N/m", "{} suspension stiffness"),
        Parameter(c, 1500.0, "N s/m", "{} suspension damping"),
        Parameter(k_t, 1.92e5, "N/m", "{} tyre stiffness"),
        Parameter(ahead, 1.4, "m", "{} axle ahead of the centre of mass"),
    ),
)

SIDE = [
    (-2.1, 0.4),
    (2.0, 0.4),
    (2.05, 0.68),
    (1.85, 0.83),
    (1.0, 0.95),
    (0.35, 1.38),
    (-1.05, 1.4),
    (-1.75, 1.0),
    (-2.1, 0.92),
]
GLASS = [(0.78, 0.97), (0.27, 1.29), (-0.95, 1.31), (-1.45, 0.99)]

body = Part(
    "body",
    coordinates=(Coordinate(z_b, "m", "heave of the body"), Coordinate(theta, "rad", "pitch of the body")),
    kinetic_energy=HALF * (m_b * zdot_b**2 + I_b * thetadot**2),
    scene=(
        Ground([(-a_r, Symbol("w_r")), (a_f, Symbol("w_f"))]),
        Polygon([(x, y - 0.55) for x, y in SIDE], at=(0, z_b + 0.55), angle=theta),
        Polygon([(x, y - 0.55) for x, y in GLASS], at=(0, z_b + 0.55), angle=theta, colour="grey"),
    ),
    outputs=(
        Output(Symbol("heave_acceleration"), Symbol("zddot_b"), "m/s^2", "heave acceleration of the body"),
        Output(Symbol("pitch_acceleration"), Symbol("thetaddot"), "rad/s^2", "pitch acceleration of the body"),
    ),
    parameters=(
        Parameter(m_b, 690.0, "kg", "mass of the body"),
        Parameter(I_b, 1222.0, "kg m^2", "pitch moment of inertia of the body"),
    ),
)

wheelbase = Part(
    "wheelbase",
    parameters=(
        Parameter(a_f, 1.3, "m", "centre of mass to the front axle"),
        Parameter(a_r, 1.5, "m", "centre of mass to the rear axle"),
    ),
)


def system() -> System:
    """Four degrees of freedom about the static position, small pitch angles; nose-up pitch is positive.

    The parameters are typical values of a small passenger car, of no particular one.
    """
    front = axle("f", "front", ahead=a_f, m=40.5, k=1.7e4)
    rear = axle("r", "rear", ahead=-a_r, m=45.4, k=2.2e4)
    car = body + front + rear + wheelbase
    return car.system("half_car", "Half car on a road, 4 degrees of freedom")
