"""The half car in side view: heave and pitch of the body, one wheel in front and one behind."""

from sympy import Rational, Symbol, symbols

from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, System

HALF = Rational(1, 2)
z_b, theta, z_f, z_r = symbols("z_b theta z_f z_r")
zdot_b, thetadot, zdot_f, zdot_r = symbols("zdot_b thetadot zdot_f zdot_r")
w_f, w_r, m_b, I_b, m_f, m_r = symbols("w_f w_r m_b I_b m_f m_r")
k_f, k_r, c_f, c_r, k_tf, k_tr, a_f, a_r = symbols("k_f k_r c_f c_r k_tf k_tr a_f a_r")
delta_f, delta_r, deltadot_f, deltadot_r = symbols("delta_f delta_r deltadot_f deltadot_r")

front = Quantity(delta_f, z_b + a_f * theta - z_f, "m", "front suspension deflection", rate=deltadot_f)
rear = Quantity(delta_r, z_b - a_r * theta - z_r, "m", "rear suspension deflection", rate=deltadot_r)

T = HALF * (m_b * zdot_b**2 + I_b * thetadot**2 + m_f * zdot_f**2 + m_r * zdot_r**2)
Pi = HALF * (k_f * delta_f**2 + k_r * delta_r**2 + k_tf * (z_f - w_f) ** 2 + k_tr * (z_r - w_r) ** 2)
Phi = HALF * (c_f * deltadot_f**2 + c_r * deltadot_r**2)

outputs = (
    Output(Symbol("heave_acceleration"), Symbol("zddot_b"), "m/s^2", "heave acceleration of the body"),
    Output(Symbol("pitch_acceleration"), Symbol("thetaddot"), "rad/s^2", "pitch acceleration of the body"),
    front,
    rear,
    Output(Symbol("tyre_force_f"), k_tf * (w_f - z_f), "N", "dynamic front tyre force"),
    Output(Symbol("tyre_force_r"), k_tr * (w_r - z_r), "N", "dynamic rear tyre force"),
)

parameters = (
    Parameter(m_b, 690.0, "kg", "mass of the body"),
    Parameter(I_b, 1222.0, "kg m^2", "pitch moment of inertia of the body"),
    Parameter(m_f, 40.5, "kg", "front unsprung mass"),
    Parameter(m_r, 45.4, "kg", "rear unsprung mass"),
    Parameter(k_f, 1.7e4, "N/m", "front suspension stiffness"),
    Parameter(k_r, 2.2e4, "N/m", "rear suspension stiffness"),
    Parameter(c_f, 1500.0, "N s/m", "front suspension damping"),
    Parameter(c_r, 1500.0, "N s/m", "rear suspension damping"),
    Parameter(k_tf, 1.92e5, "N/m", "front tyre stiffness"),
    Parameter(k_tr, 1.92e5, "N/m", "rear tyre stiffness"),
    Parameter(a_f, 1.3, "m", "centre of mass to the front axle"),
    Parameter(a_r, 1.5, "m", "centre of mass to the rear axle"),
)


def system() -> System:
    """Four degrees of freedom about the static position, small pitch angles; nose-up pitch is positive.

    The parameters are typical values of a small passenger car, of no particular one.
    """
    return System(
        name="half_car",
        title="Half car on a road, 4 degrees of freedom",
        coordinates=(
            Coordinate(z_b, "m", "heave of the body"),
            Coordinate(theta, "rad", "pitch of the body"),
            Coordinate(z_f, "m", "displacement of the front wheel"),
            Coordinate(z_r, "m", "displacement of the rear wheel"),
        ),
        inputs=(
            Input(w_f, "m", "road height under the front wheel", position=a_f),
            Input(w_r, "m", "road height under the rear wheel", position=-a_r),
        ),
        quantities=(front, rear),
        kinetic_energy=T,
        potential_energy=Pi,
        dissipation=Phi,
        outputs=outputs,
        parameters=parameters,
    )
