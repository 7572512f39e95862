"""DETEST classes A (single equations), B (small systems) and E (equations of higher order), all non-stiff.

Equations and numbering after T. E. Hull, W. H. Enright, B. M. Fellen, A. E. Sedgwick, "Comparing numerical methods for
ordinary differential equations", SIAM J. Numer. Anal. 9 (1972) 603-637, tables 1, 2 and 5.
"""

import numpy as np

from benchmarks.problems.problem import Problem, kernel

CITATION = (
    "T. E. Hull, W. H. Enright, B. M. Fellen, A. E. Sedgwick, SIAM J. Numer. Anal. 9 (1972) 603-637; end point as "
    "published with W. H. Enright, J. D. Pryce, Algorithm 648, ACM Trans. Math. Softw. 13 (1987) 28-34 (NSDTST, EVALU)"
)
SPAN = (0.0, 20.0)


@kernel
def a1(t, x, u, c, dx):
    """Exponential decay."""
    dx[0] = -x[0]


@kernel
def a2(t, x, u, c, dx):
    """A special Riccati-like equation, solution 1/sqrt(1 + t)."""
    dx[0] = -0.5 * x[0] ** 3


@kernel
def a3(t, x, u, c, dx):
    """An oscillating problem, solution exp(sin t)."""
    dx[0] = x[0] * np.cos(t)


@kernel
def a4(t, x, u, c, dx):
    """A logistic curve."""
    dx[0] = 0.25 * x[0] * (1.0 - x[0] / 20.0)


@kernel
def a5(t, x, u, c, dx):
    """A spiral curve."""
    dx[0] = (x[0] - t) / (x[0] + t)


@kernel
def b1(t, x, u, c, dx):
    """Growth of two conflicting populations."""
    dx[0] = 2.0 * (x[0] - x[0] * x[1])
    dx[1] = -(x[1] - x[0] * x[1])


@kernel
def b2(t, x, u, c, dx):
    """A linear chemical reaction."""
    dx[0] = -x[0] + x[1]
    dx[1] = x[0] - 2.0 * x[1] + x[2]
    dx[2] = x[1] - x[2]


@kernel
def b3(t, x, u, c, dx):
    """A nonlinear chemical reaction."""
    dx[0] = -x[0]
    dx[1] = x[0] - x[1] ** 2
    dx[2] = x[1] ** 2


@kernel
def b4(t, x, u, c, dx):
    """The integral surface of a torus."""
    r = np.sqrt(x[0] ** 2 + x[1] ** 2)
    dx[0] = -x[1] - x[0] * x[2] / r
    dx[1] = x[0] - x[1] * x[2] / r
    dx[2] = x[0] / r


@kernel
def b5(t, x, u, c, dx):
    """Euler's equations of a rigid body without external forces."""
    dx[0] = x[1] * x[2]
    dx[1] = -x[0] * x[2]
    dx[2] = -0.51 * x[0] * x[1]


@kernel
def e1(t, x, u, c, dx):
    """Bessel's equation of order 1/2, with the origin moved to t = -1."""
    dx[0] = x[1]
    dx[1] = -(x[1] / (t + 1.0) + (1.0 - 0.25 / (t + 1.0) ** 2) * x[0])


@kernel
def e2(t, x, u, c, dx):
    """Van der Pol's equation, not stiff."""
    dx[0] = x[1]
    dx[1] = (1.0 - x[0] ** 2) * x[1] - x[0]


@kernel
def e3(t, x, u, c, dx):
    """Duffing's equation."""
    dx[0] = x[1]
    dx[1] = x[0] ** 3 / 6.0 - x[0] + 2.0 * np.sin(2.78535 * t)


@kernel
def e4(t, x, u, c, dx):
    """A falling body with air resistance."""
    dx[0] = x[1]
    dx[1] = 0.032 - 0.4 * x[1] ** 2


@kernel
def e5(t, x, u, c, dx):
    """A linear pursuit."""
    dx[0] = x[1]
    dx[1] = np.sqrt(1.0 + x[1] ** 2) / (25.0 - t)


def _problem(name, rhs, x0, end):
    return Problem(f"DETEST {name}", f"DETEST {name[0]}", rhs, SPAN, x0, end, CITATION)


BESSEL_START = (0.79788456080286536 * 0.84147098480789651, 0.79788456080286536 * 0.11956681346419146)

PROBLEMS = (
    _problem("A1", a1, (1.0,), (2.061153353012535e-09,)),
    _problem("A2", a2, (1.0,), (2.182178902359887e-01,)),
    _problem("A3", a3, (1.0,), (2.491650271850414,)),
    _problem("A4", a4, (1.0,), (1.773016648131483e01,)),
    _problem("A5", a5, (4.0,), (-7.887826688964196e-01,)),
    _problem("B1", b1, (1.0, 3.0), (6.761876008576667e-01, 1.860816099640036e-01)),
    _problem("B2", b2, (2.0, 0.0, 1.0), (1.000000001030576, 1.0, 9.999999989694235e-01)),
    _problem("B3", b3, (1.0, 0.0, 0.0), (2.061153488557776e-09, 5.257228022048349e-02, 9.474277177183630e-01)),
    _problem("B4", b4, (3.0, 0.0, 0.0), (9.826950928005993e-01, 2.198447081694832, 9.129452507276399e-01)),
    _problem("B5", b5, (0.0, 1.0, 1.0), (-9.396570798729192e-01, -3.421177754000779e-01, 7.414126596199957e-01)),
    _problem("E1", e1, BESSEL_START, (1.456723600728308e-01, -9.883500195574063e-02)),
    _problem("E2", e2, (2.0, 0.0), (2.008149762174948, -4.250887527320057e-02)),
    _problem("E3", e3, (0.0, 0.0), (-1.004178858647128e-01, 2.411400132095954e-01)),
    _problem("E4", e4, (30.0, 0.0), (3.395091444646555e01, 2.767822659672869e-01)),
    _problem("E5", e5, (0.0, 0.0), (1.411797390542629e01, 2.400000000000002)),
)
