"""Damped driven oscillator, written by hand in the form of a generated module."""

from numba import njit

CONVENTION = 2
NAME = "oscillator"
TITLE = "Damped driven oscillator on a moving support"

STATE = (
    ("q_1", "m", "displacement of the mass"),
    ("qdot_1", "m/s", "velocity of the mass"),
)
COORDINATES = 1
INPUT = (
    ("F", "F", 0, "N", "force on the mass"),
    ("z_1", "z_1", 0, "m", "displacement of the support"),
    ("zdot_1", "z_1", 1, "m/s", "velocity of the support"),
)
RHS_INPUTS = 3
OUTPUT = (
    ("qddot_1", "m/s^2", "acceleration of the mass"),
    ("F_spring", "N", "force of the spring on the mass"),
)
PARAMETER = (
    ("m_1", 2.0, "kg", "mass"),
    ("k_1", 50.0, "N/m", "spring stiffness"),
    ("b_1", 1.5, "N s/m", "damping"),
    ("g", 9.81, "m/s^2", "gravitational acceleration"),
)
PARAMETER_SETS = {
    "weightless": {"g": 0.0},
    "undamped": {"b_1": 0.0, "g": 0.0},
}
CONSTANT = ("one_over_m_1",)
LINEAR = True
MASS_MATRIX = "constant"
JACOBIAN = ((1,), (0, 1))
INPUT_JACOBIAN = ((), (0, 1, 2))
MASS = ((0,),)


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def constants(parameters, c):
    """Fill c with what the kernels read."""
    for k in range(4):
        c[k] = parameters[k]
    c[4] = 1.0 / parameters[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def rhs(t, x, u, c, dx):
    """dx = [qdot, qddot]."""
    deflection = x[0] - u[1]
    deflection_rate = x[1] - u[2]

    dx[0] = x[1]
    dx[1] = (u[0] - c[1] * deflection - c[2] * deflection_rate) * c[4] - c[3]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def jacobian(t, x, u, c, values):
    """Derivative of rhs by the state."""
    values[0] = 1.0
    values[1] = -c[1] * c[4]
    values[2] = -c[2] * c[4]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def input_jacobian(t, x, u, c, values):
    """Derivative of rhs by the inputs."""
    values[0] = c[4]
    values[1] = c[1] * c[4]
    values[2] = c[2] * c[4]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def mass(t, x, u, c, values):
    """Mass matrix."""
    values[0] = c[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def energy(t, x, u, c, E):
    """Kinetic energy, potential energy, dissipated power, power put in."""
    deflection = x[0] - u[1]
    deflection_rate = x[1] - u[2]

    E[0] = 0.5 * c[0] * x[1] * x[1]
    E[1] = 0.5 * c[1] * deflection * deflection + c[0] * c[3] * x[0]
    E[2] = c[2] * deflection_rate * deflection_rate
    E[3] = u[0] * x[1] - (c[1] * deflection + c[2] * deflection_rate) * u[2]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def outputs(t, x, u, c, y):
    """Outputs in the order of OUTPUT."""
    spring = c[1] * (u[1] - x[0])

    y[0] = (u[0] + spring - c[2] * (x[1] - u[2])) * c[4] - c[3]
    y[1] = spring
