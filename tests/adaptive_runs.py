"""Right-hand sides with known solutions, and one way to run an adaptive method on them, for several test files."""

import numpy as np
from numba import njit

from runner.abi import VECTOR_KERNEL
from runner.inputs.signal import Signal, stack
from runner.methods import METHODS, find_method
from runner.options import Options
from runner.problem import Problem, Trajectory

ADAPTIVE = [name for name, method in METHODS.items() if method.family == "adaptive"]


@njit(VECTOR_KERNEL)
def circle(t, x, u, c, dx):
    """x = (cos t, sin t) from (1, 0); nonlinear, so that no order condition is met by accident."""
    r = x[0] * x[0] + x[1] * x[1]
    dx[0] = -x[1] * r
    dx[1] = x[0] * r


@njit(VECTOR_KERNEL)
def three(t, x, u, c, dx):
    """Three unrelated problems whose solution from (1, 1, 0, 1) is `three_at`."""
    dx[0] = x[0] * np.cos(t)
    dx[1] = -0.5 * x[1] ** 3
    dx[2] = x[3]
    dx[3] = -x[2]


def three_at(t):
    """(n, 4): exp(sin t), 1/sqrt(1 + t), sin t, cos t."""
    return np.stack([np.exp(np.sin(t)), 1 / np.sqrt(1 + t), np.sin(t), np.cos(t)], axis=-1)


@njit(VECTOR_KERNEL)
def axle(t, x, u, c, dx):
    """Equation (12) of the paper: c = (stiffness / mass, gravity)."""
    dx[0] = x[1]
    dx[1] = -c[0] * x[0] - c[1]


@njit(VECTOR_KERNEL)
def forced(t, x, u, c, dx):
    """x'' + 2 c1 c0 x' + c0^2 x = u0."""
    dx[0] = x[1]
    dx[1] = u[0] - 2.0 * c[1] * c[0] * x[1] - c[0] * c[0] * x[0]


@njit(VECTOR_KERNEL)
def falling(t, x, u, c, dx):
    """Free fall."""
    dx[0] = x[1]
    dx[1] = -9.81


@njit(VECTOR_KERNEL)
def exploding(t, x, u, c, dx):
    """The second state is 1/(1 - t)."""
    dx[0] = -x[0]
    dx[1] = x[1] * x[1]


@njit(VECTOR_KERNEL)
def arenstorf(t, x, u, c, dx):
    """The restricted three-body problem (HNW, equation II.0.1)."""
    m = 0.012277471
    n = 1.0 - m
    d1 = ((x[0] + m) ** 2 + x[1] ** 2) ** 1.5
    d2 = ((x[0] - n) ** 2 + x[1] ** 2) ** 1.5
    dx[0] = x[2]
    dx[1] = x[3]
    dx[2] = x[0] + 2.0 * x[3] - n * (x[0] + m) / d1 - m * (x[0] - n) / d2
    dx[3] = x[1] - 2.0 * x[2] - n * x[1] / d1 - m * x[1] / d2


@njit(VECTOR_KERNEL)
def pleiades(t, x, u, c, dx):
    """Seven stars in a plane with masses 1 to 7 (HNW, equation II.10.5): x_i, y_i, x_i', y_i'."""
    for i in range(14):
        dx[i] = x[14 + i]
        dx[14 + i] = 0.0
    for i in range(7):
        for j in range(7):
            if i != j:
                d = ((x[i] - x[j]) ** 2 + (x[7 + i] - x[7 + j]) ** 2) ** 1.5
                dx[14 + i] += (j + 1) * (x[j] - x[i]) / d
                dx[21 + i] += (j + 1) * (x[7 + j] - x[7 + i]) / d


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
    x0 = np.array(x0, dtype=float)
    names = tuple(f"x_{i + 1}" for i in range(len(x0)))
    table = stack(list(inputs), [0] * len(inputs))
    problem = Problem(kernel, *map(float, span), x0, np.array(c, dtype=float), table, len(inputs), names)
    chosen = find_method(method)
    return chosen.integrate(problem, chosen, Options(**options))


def slope(errors, steps) -> float:
    """Exponent of the power law through errors over steps."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
