"""A load that swings a little below a trolley with a prescribed way s(t), by hand in the form of a generated module.

L phiddot + g phi + d phidot = -sddot: the motion of the trolley comes in by its second rate.
"""

from numba import njit

CONVENTION = 2
NAME = "trolley"
TITLE = "Load below a moving trolley, small angles"

STATE = (
    ("phi", "rad", "angle of the rope"),
    ("phidot", "rad/s", "rate of change of: angle of the rope"),
)
COORDINATES = 1
INPUT = (
    ("s", "s", 0, "m", "way of the trolley"),
    ("sddot", "s", 2, "m/s^2", "acceleration of the trolley"),
    ("sdot", "s", 1, "m/s", "speed of the trolley"),
)
RHS_INPUTS = 2
OUTPUT = (("speed", "m/s", "speed of the load"),)
PARAMETER = (
    ("L", 2.0, "m", "length of the rope"),
    ("g", 9.81, "m/s^2", "acceleration of gravity"),
    ("d", 0.3, "m/s", "damping"),
)
PARAMETER_SETS = {}
CONSTANT = ()
LINEAR = True
MASS_MATRIX = "constant"
JACOBIAN = ((1,), (0, 1))
INPUT_JACOBIAN = ((), (1,))
MASS = ((0,),)


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def constants(parameters, c):
    """The parameters themselves."""
    for k in range(3):
        c[k] = parameters[k]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def rhs(t, x, u, c, dx):
    """dx = [qdot, qddot]."""
    dx[0] = x[1]
    dx[1] = -(u[1] + c[1] * x[0] + c[2] * x[1]) / c[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def jacobian(t, x, u, c, values):
    """Derivative of rhs by the state."""
    values[0] = 1.0
    values[1] = -c[1] / c[0]
    values[2] = -c[2] / c[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def input_jacobian(t, x, u, c, values):
    """Derivative of rhs by the inputs."""
    values[0] = -1.0 / c[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def mass(t, x, u, c, values):
    """Mass matrix, of a load of 1 kg."""
    values[0] = c[0] * c[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def energy(t, x, u, c, E):
    """Energies in the frame of the trolley, powers there."""
    E[0] = 0.5 * c[0] * c[0] * x[1] * x[1]
    E[1] = 0.5 * c[1] * c[0] * x[0] * x[0]
    E[2] = c[2] * c[0] * x[1] * x[1]
    E[3] = -u[1] * c[0] * x[1]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def outputs(t, x, u, c, y):
    """Outputs in the order of OUTPUT."""
    y[0] = u[2] + c[0] * x[1]
