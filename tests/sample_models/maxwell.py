"""Mass on a spring beside a Maxwell element, a spring and a damper in a row, by hand in the form of a generated module.

The extension s of the damper is a state of its own: b sdot = k_2 (q - s), m qddot = F - k_1 q - k_2 (q - s).
"""

from numba import njit

CONVENTION = 2
NAME = "maxwell"
TITLE = "Mass on a standard linear solid"

STATE = (
    ("q", "m", "displacement of the mass"),
    ("qdot", "m/s", "velocity of the mass"),
    ("s", "m", "extension of the damper"),
)
COORDINATES = 1
INPUT = (("F", "F", 0, "N", "force on the mass"),)
RHS_INPUTS = 1
OUTPUT = (("force", "N", "force of the Maxwell element"),)
PARAMETER = (
    ("m", 2.0, "kg", "mass"),
    ("k_1", 50.0, "N/m", "stiffness beside the damper"),
    ("k_2", 120.0, "N/m", "stiffness in a row with the damper"),
    ("b", 4.0, "N s/m", "damping"),
)
PARAMETER_SETS = {}
CONSTANT = ()
LINEAR = True
MASS_MATRIX = "constant"
JACOBIAN = ((1,), (0, 2), (0, 2))
INPUT_JACOBIAN = ((), (0,), ())
MASS = ((0,),)


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def constants(parameters, c):
    """Fill c with what the kernels read."""
    for k in range(4):
        c[k] = parameters[k]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def rhs(t, x, u, c, dx):
    """dx = [qdot, qddot, sdot]."""
    force = c[2] * (x[0] - x[2])

    dx[0] = x[1]
    dx[1] = (u[0] - c[1] * x[0] - force) / c[0]
    dx[2] = force / c[3]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def jacobian(t, x, u, c, values):
    """Derivative of rhs by the state."""
    values[0] = 1.0
    values[1] = -(c[1] + c[2]) / c[0]
    values[2] = c[2] / c[0]
    values[3] = c[2] / c[3]
    values[4] = -c[2] / c[3]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def input_jacobian(t, x, u, c, values):
    """Derivative of rhs by the input."""
    values[0] = 1.0 / c[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def mass(t, x, u, c, values):
    """Mass matrix."""
    values[0] = c[0]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def energy(t, x, u, c, E):
    """Kinetic energy, potential energy, dissipated power, power put in."""
    stretch = x[0] - x[2]

    E[0] = 0.5 * c[0] * x[1] * x[1]
    E[1] = 0.5 * (c[1] * x[0] * x[0] + c[2] * stretch * stretch)
    E[2] = (c[2] * stretch) * (c[2] * stretch) / c[3]
    E[3] = u[0] * x[1]


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def outputs(t, x, u, c, y):
    """Outputs in the order of OUTPUT."""
    y[0] = c[2] * (x[0] - x[2])
