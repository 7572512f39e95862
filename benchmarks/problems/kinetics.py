"""Stiff chemical kinetics: ROBER, HIRES, OREGO, E5.

F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (2008), chapter II; E. Hairer,
G. Wanner, Solving Ordinary Differential Equations II, section IV.10.
"""

from benchmarks.problems.problem import Problem, kernel

CITATION = "F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers 2.4 (2008): equations and end point of "


@kernel
def robertson(t, x, u, c, dx):
    """Robertson's autocatalytic reaction (1966)."""
    dx[0] = -0.04 * x[0] + 1e4 * x[1] * x[2]
    dx[2] = 3e7 * x[1] ** 2
    dx[1] = -dx[0] - dx[2]


@kernel
def robertson_jacobian(t, x, u, c, J):
    """Of `robertson`."""
    J[0, 0], J[0, 1], J[0, 2] = -0.04, 1e4 * x[2], 1e4 * x[1]
    J[2, 0], J[2, 1], J[2, 2] = 0.0, 6e7 * x[1], 0.0
    for j in range(3):
        J[1, j] = -J[0, j] - J[2, j]


@kernel
def hires(t, x, u, c, dx):
    """High irradiance responses of photomorphogenesis (Schaefer 1975)."""
    dx[0] = -1.71 * x[0] + 0.43 * x[1] + 8.32 * x[2] + 0.0007
    dx[1] = 1.71 * x[0] - 8.75 * x[1]
    dx[2] = -10.03 * x[2] + 0.43 * x[3] + 0.035 * x[4]
    dx[3] = 8.32 * x[1] + 1.71 * x[2] - 1.12 * x[3]
    dx[4] = -1.745 * x[4] + 0.43 * (x[5] + x[6])
    dx[6] = 280.0 * x[5] * x[7] - 1.81 * x[6]
    dx[5] = -280.0 * x[5] * x[7] + 0.69 * x[3] + 1.71 * x[4] - 0.43 * x[5] + 0.69 * x[6]
    dx[7] = -dx[6]


@kernel
def hires_jacobian(t, x, u, c, J):
    """Of `hires`."""
    J[:] = 0.0
    J[0, 0], J[0, 1], J[0, 2] = -1.71, 0.43, 8.32
    J[1, 0], J[1, 1] = 1.71, -8.75
    J[2, 2], J[2, 3], J[2, 4] = -10.03, 0.43, 0.035
    J[3, 1], J[3, 2], J[3, 3] = 8.32, 1.71, -1.12
    J[4, 4], J[4, 5], J[4, 6] = -1.745, 0.43, 0.43
    J[5, 3], J[5, 4], J[5, 5], J[5, 6], J[5, 7] = 0.69, 1.71, -0.43 - 280.0 * x[7], 0.69, -280.0 * x[5]
    J[6, 5], J[6, 6], J[6, 7] = 280.0 * x[7], -1.81, 280.0 * x[5]
    for j in range(8):
        J[7, j] = -J[6, j]


@kernel
def orego(t, x, u, c, dx):
    """The Oregonator, a limit cycle (Field, Noyes 1974)."""
    dx[0] = 77.27 * (x[1] + x[0] * (1.0 - 8.375e-6 * x[0] - x[1]))
    dx[1] = (x[2] - (1.0 + x[0]) * x[1]) / 77.27
    dx[2] = 0.161 * (x[0] - x[2])


@kernel
def orego_jacobian(t, x, u, c, J):
    """Of `orego`."""
    J[0, 0], J[0, 1], J[0, 2] = 77.27 * (1.0 - 2.0 * 8.375e-6 * x[0] - x[1]), 77.27 * (1.0 - x[0]), 0.0
    J[1, 0], J[1, 1], J[1, 2] = -x[1] / 77.27, -(1.0 + x[0]) / 77.27, 1.0 / 77.27
    J[2, 0], J[2, 1], J[2, 2] = 0.161, 0.0, -0.161


@kernel
def pyrolysis(t, x, u, c, dx):
    """E5 of Enright, Hull, Lindberg (1975); the third line is written so that it does not cancel."""
    started, slow, fast, back = 7.89e-10 * x[0], 1.1e7 * x[0] * x[2], 1.13e9 * x[1] * x[2], 1.13e3 * x[3]
    dx[0] = -started - slow
    dx[1] = started - fast
    dx[3] = slow - back
    dx[2] = dx[1] - dx[3]


@kernel
def pyrolysis_jacobian(t, x, u, c, J):
    """Of `pyrolysis`."""
    J[0, 0], J[0, 1], J[0, 2], J[0, 3] = -7.89e-10 - 1.1e7 * x[2], 0.0, -1.1e7 * x[0], 0.0
    J[1, 0], J[1, 1], J[1, 2], J[1, 3] = 7.89e-10, -1.13e9 * x[2], -1.13e9 * x[1], 0.0
    J[3, 0], J[3, 1], J[3, 2], J[3, 3] = 1.1e7 * x[2], 0.0, 1.1e7 * x[0], -1.13e3
    for j in range(4):
        J[2, j] = J[1, j] - J[3, j]


# fmt: off
HIRES_END = (
    0.7371312573325668e-3, 0.1442485726316185e-3, 0.5888729740967575e-4, 0.1175651343283149e-2,
    0.2386356198831331e-2, 0.6238968252742796e-2, 0.2849998395185769e-2, 0.2850001604814231e-2,
)
# fmt: on

PROBLEMS = (
    Problem(
        name="ROBER",
        set="stiff",
        rhs=robertson,
        jacobian=robertson_jacobian,
        span=(0.0, 1e11),
        x0=(1.0, 0.0, 0.0),
        end=(0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050),
        scale=(1e-8, 1e-14, 1e-3),
        citation=CITATION + "rober",
    ),
    Problem(
        name="HIRES",
        set="stiff",
        rhs=hires,
        jacobian=hires_jacobian,
        span=(0.0, 321.8122),
        x0=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057),
        end=HIRES_END,
        scale=1e-4,
        citation=CITATION + "hires",
    ),
    Problem(
        name="OREGO",
        set="stiff",
        rhs=orego,
        jacobian=orego_jacobian,
        span=(0.0, 360.0),
        x0=(1.0, 2.0, 3.0),
        end=(0.1000814870318523e1, 0.1228178521549917e4, 0.1320554942846706e3),
        scale=1.0,
        citation=CITATION + "orego",
    ),
    Problem(
        name="E5",
        set="stiff",
        rhs=pyrolysis,
        jacobian=pyrolysis_jacobian,
        span=(0.0, 1e13),
        x0=(1.76e-3, 0.0, 0.0, 0.0),
        end=(0.0, 8.861233521291e-23, 8.861233521291e-23, 0.0),
        scale=1e-22,
        citation="W. H. Enright, T. E. Hull, B. Lindberg, BIT 15 (1975) 10-48, E5, over the span of F. Mazzia, C. "
        "Magherini, Test Set for Initial Value Problem Solvers 2.4 (2008), e5. End point computed in 60 decimal digits "
        "by Radau IIA of order 11: the published one (0.1152903278711829e-290, 0.8867655517642120e-22, "
        "0.8854814626268838e-22, 0) violates x_2 = x_3 + x_4 by 1.3e-25, a rounding error of double precision, so it "
        "has three digits",
    ),
)
