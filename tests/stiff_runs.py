"""Small problems for the stiff methods, and how to run them."""

from typing import Any

import numpy as np

from runner.inputs.signal import InputTable, Signal, stack
from runner.methods import find_method
from runner.options import Options
from runner.problem import Problem, Trajectory

NO_INPUTS = stack([], [])


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


def half_sine_pulse(start: float, length: float, peak: float) -> Signal:
    """Zero but for half a sine from `start`."""
    pieces = np.zeros((3, 8))
    pieces[:, 0] = -1.0, start, start + length
    pieces[1, 5], pieces[1, 6] = peak, np.pi / length
    return Signal(pieces=pieces, breakpoints=np.array([start, start + length]))


def run(name: str, problem: Problem, **options: Any) -> Trajectory:
    method = find_method(name)
    return method.integrate(problem, method, Options(**options))
