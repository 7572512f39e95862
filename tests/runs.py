"""Runs without the front door, and right-hand sides at which every method must stop."""

from typing import Any

import numpy as np
from numba import njit

from qddot.runner.inputs.signal import InputTable, stack
from qddot.runner.methods import find_method
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory
from qddot.runner.takers import fitted

NO_INPUTS = stack([], [])


@njit
def exploding(t, x, u, c, dx):
    """The second state is 1/(1 - t) until it is infinite at t = 1."""
    dx[0] = -x[0]
    dx[1] = x[1] * x[1]


@njit
def rooted(t, x, u, c, dx):
    """The second state's slope is no number once the first is negative, at t = 1."""
    dx[0] = -1.0
    dx[1] = np.sqrt(x[0])


def problem(
    rhs: Any,
    t1: float,
    x0: Any,
    jacobian: Any = None,
    mass: Any = None,
    c: Any = (),
    inputs: InputTable = NO_INPUTS,
    t0: float = 0.0,
) -> Problem:
    x = np.array(x0, dtype=np.float64)
    return Problem(
        rhs=rhs,
        t0=float(t0),
        t1=float(t1),
        initial_state=x,
        constants=np.array(c, dtype=np.float64),
        inputs=inputs,
        n_inputs=len(inputs.first),
        state_names=tuple(f"x_{i + 1}" for i in range(len(x))),
        jacobian=jacobian,
        mass_matrix=mass,
    )


def run(name: str, problem: Problem, **options: Any) -> Trajectory:
    method = find_method(name)
    return method.integrate(problem, method, fitted(Options(**options), method))
