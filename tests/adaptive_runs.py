"""Right-hand sides with known solutions, and one way to run an adaptive method on them, for several test files."""

import numpy as np
import runs
from numba import njit

from qddot.runner.inputs.signal import Signal, stack
from qddot.runner.methods import METHODS
from qddot.runner.problem import Trajectory

ADAPTIVE = [name for name, method in METHODS.items() if method.family == "adaptive"]


@njit
def circle(t, x, u, c, dx):
    """x = (cos t, sin t) from (1, 0); nonlinear, so that no order condition is met by accident."""
    r = x[0] * x[0] + x[1] * x[1]
    dx[0] = -x[1] * r
    dx[1] = x[0] * r


@njit
def three(t, x, u, c, dx):
    """Three unrelated problems whose solution from (1, 1, 0, 1) is `three_at`."""
    dx[0] = x[0] * np.cos(t)
    dx[1] = -0.5 * x[1] ** 3
    dx[2] = x[3]
    dx[3] = -x[2]


def three_at(t):
    """(n, 4): exp(sin t), 1/sqrt(1 + t), sin t, cos t."""
    return np.stack([np.exp(np.sin(t)), 1 / np.sqrt(1 + t), np.sin(t), np.cos(t)], axis=-1)


@njit
def axle(t, x, u, c, dx):
    """Equation (12) of the paper: c = (stiffness / mass, gravity)."""
    dx[0] = x[1]
    dx[1] = -c[0] * x[0] - c[1]


@njit
def forced(t, x, u, c, dx):
    """x'' + 2 c1 c0 x' + c0^2 x = u0."""
    dx[0] = x[1]
    dx[1] = u[0] - 2.0 * c[1] * c[0] * x[1] - c[0] * c[0] * x[0]


@njit
def falling(t, x, u, c, dx):
    """Free fall."""
    dx[0] = x[1]
    dx[1] = -9.81


def plain(kernel, c=()):
    """f(t, x) for SciPy."""
    constants, u = np.array(c, dtype=float), np.zeros(1)

    def f(t, x):
        dx = np.empty_like(x)
        kernel(t, x, u, constants, dx)
        return dx

    return f


def run(kernel, span, x0, method="ode45", c=(), inputs: tuple[Signal, ...] = (), **options) -> Trajectory:
    """Integrate without the front door."""
    table = stack(list(inputs), [0] * len(inputs))
    return runs.run(method, runs.problem(kernel, span[1], x0, c=c, inputs=table, t0=span[0]), **options)


def slope(errors, steps) -> float:
    """Exponent of the power law through errors over steps."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
