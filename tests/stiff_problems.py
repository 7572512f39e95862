"""Stiff test problems that nobody here wrote, as kernels of the calling convention, with published end points.

F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (2008): HIRES, OREGO, the transistor
amplifier, Robertson, Van der Pol; E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.10.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from runner.inputs.signal import InputTable, Signal, stack
from runner.methods import find_method
from runner.options import Options
from runner.problem import Problem, Trajectory

NO_INPUTS = stack([], [])


@dataclass(frozen=True, eq=False)
class Reference:
    """A problem and its state at the end."""

    problem: Problem
    end: NDArray[np.float64]


def problem(
    rhs: Any, t1: float, x0: Any, jacobian: Any = None, mass: Any = None, c: Any = (), inputs: InputTable = NO_INPUTS
) -> Problem:
    x = np.array(x0, dtype=np.float64)
    return Problem(
        rhs=rhs,
        t0=0.0,
        t1=t1,
        initial_state=x,
        constants=np.array(c, dtype=np.float64),
        inputs=inputs,
        n_inputs=len(inputs.first),
        state_names=tuple(f"x_{i + 1}" for i in range(len(x))),
        jacobian=jacobian,
        mass_matrix=mass,
    )


@njit
def robertson(t, x, u, c, dx):
    dx[0] = -0.04 * x[0] + 1e4 * x[1] * x[2]
    dx[2] = 3e7 * x[1] ** 2
    dx[1] = -dx[0] - dx[2]


@njit
def robertson_jacobian(t, x, u, c, J):
    J[0, 0], J[0, 1], J[0, 2] = -0.04, 1e4 * x[2], 1e4 * x[1]
    J[2, 0], J[2, 1], J[2, 2] = 0.0, 6e7 * x[1], 0.0
    for j in range(3):
        J[1, j] = -J[0, j] - J[2, j]


@njit
def robertson_dae(t, x, u, c, dx):
    """The same with conservation of mass in place of the third equation."""
    dx[0] = -0.04 * x[0] + 1e4 * x[1] * x[2]
    dx[1] = -dx[0] - 3e7 * x[1] ** 2
    dx[2] = x[0] + x[1] + x[2] - 1.0


@njit
def van_der_pol(t, x, u, c, dx):
    dx[0] = x[1]
    dx[1] = c[0] * (1 - x[0] ** 2) * x[1] - x[0]


@njit
def van_der_pol_jacobian(t, x, u, c, J):
    J[0, 0], J[0, 1] = 0.0, 1.0
    J[1, 0], J[1, 1] = -2 * c[0] * x[0] * x[1] - 1, c[0] * (1 - x[0] ** 2)


@njit
def hires(t, x, u, c, dx):
    dx[0] = -1.71 * x[0] + 0.43 * x[1] + 8.32 * x[2] + 0.0007
    dx[1] = 1.71 * x[0] - 8.75 * x[1]
    dx[2] = -10.03 * x[2] + 0.43 * x[3] + 0.035 * x[4]
    dx[3] = 8.32 * x[1] + 1.71 * x[2] - 1.12 * x[3]
    dx[4] = -1.745 * x[4] + 0.43 * (x[5] + x[6])
    dx[5] = -280 * x[5] * x[7] + 0.69 * x[3] + 1.71 * x[4] - 0.43 * x[5] + 0.69 * x[6]
    dx[6] = 280 * x[5] * x[7] - 1.81 * x[6]
    dx[7] = -dx[6]


@njit
def orego(t, x, u, c, dx):
    dx[0] = 77.27 * (x[1] + x[0] * (1 - 8.375e-6 * x[0] - x[1]))
    dx[1] = (x[2] - (1 + x[0]) * x[1]) / 77.27
    dx[2] = 0.161 * (x[0] - x[2])


@njit
def transistor_amplifier(t, x, u, c, dx):
    """Index 1; thermal voltage 0.026 V, operating voltage 6 V, all resistors 9 kOhm but the first, 1 kOhm."""
    r0, r, ub, alpha, beta = 1000.0, 9000.0, 6.0, 0.99, 1e-6
    g12 = beta * (np.exp((x[1] - x[2]) / 0.026) - 1)
    g45 = beta * (np.exp((x[4] - x[5]) / 0.026) - 1)
    dx[0] = -(0.1 * np.sin(200 * np.pi * t) - x[0]) / r0
    dx[1] = x[1] / r + (x[1] - ub) / r + (1 - alpha) * g12
    dx[2] = x[2] / r - g12
    dx[3] = (x[3] - ub) / r + alpha * g12
    dx[4] = x[4] / r + (x[4] - ub) / r + (1 - alpha) * g45
    dx[5] = x[5] / r - g45
    dx[6] = (x[6] - ub) / r + alpha * g45
    dx[7] = x[7] / r
    for i in range(8):
        dx[i] = -dx[i]


def transistor_mass() -> NDArray[np.float64]:
    mass = np.zeros((8, 8))
    for i, capacity in ((0, 1e-6), (3, 3e-6), (6, 5e-6)):
        mass[i : i + 2, i : i + 2] = [[capacity, -capacity], [-capacity, capacity]]
    mass[2, 2], mass[5, 5] = 2e-6, 4e-6
    return mass


TRANSISTOR_START = [0, 3, 3, 6, 3, 3, 6, 0]

REFERENCES = {
    "robertson": Reference(
        problem(robertson, 40.0, [1, 0, 0], robertson_jacobian),
        np.array([0.7158270687193941, 9.185534764557338e-6, 0.2841637457458413]),
    ),
    "robertson_dae": Reference(
        problem(robertson_dae, 40.0, [1, 0, 0], mass=np.diag([1.0, 1.0, 0.0])),
        np.array([0.7158270687193941, 9.185534764557338e-6, 0.2841637457458413]),
    ),
    "van_der_pol": Reference(
        problem(van_der_pol, 2000.0, [2, 0], van_der_pol_jacobian, c=[1e3]),
        np.array([0.1706167732170483e1, -0.8928097010247975e-3]),
    ),
    "hires": Reference(
        problem(hires, 321.8122, [1, 0, 0, 0, 0, 0, 0, 0.0057]),
        np.array(
            [
                0.7371312573325668e-3,
                0.1442485726316185e-3,
                0.5888729740967575e-4,
                0.1175651343283149e-2,
                0.2386356198831331e-2,
                0.6238968252742796e-2,
                0.2849998395185769e-2,
                0.2850001604814231e-2,
            ]
        ),
    ),
    "orego": Reference(
        problem(orego, 360.0, [1, 2, 3]),
        np.array([0.1000814870318523e1, 0.1228178521549917e4, 0.1320554942846706e3]),
    ),
    "transistor_amplifier": Reference(
        problem(transistor_amplifier, 0.2, TRANSISTOR_START, mass=transistor_mass()),
        np.array(
            [
                -0.5562145012262709e-2,
                0.3006522471903042e1,
                0.2849958788608128e1,
                0.2926422536206241e1,
                0.2704617865010554e1,
                0.2761837778393145e1,
                0.4770927631616772e1,
                0.1236995868091548e1,
            ]
        ),
    ),
}


def significant_digits(found: NDArray[np.float64], expected: NDArray[np.float64]) -> float:
    """Significant correct digits: -log10 of the largest relative error (the test set's scd)."""
    return float(-np.log10(np.max(np.abs((found - expected) / expected))))


def half_sine_pulse(start: float, length: float, peak: float) -> Signal:
    """Zero but for half a sine from `start`."""
    pieces = np.zeros((3, 8))
    pieces[:, 0] = -1.0, start, start + length
    pieces[1, 5], pieces[1, 6] = peak, np.pi / length
    return Signal(pieces=pieces, breakpoints=np.array([start, start + length]))


def run(name: str, problem: Problem, **options: Any) -> Trajectory:
    method = find_method(name)
    return method.integrate(problem, method, Options(**options))
