"""Along a driven trajectory of every model, energy changes by what inputs put in less what is dissipated."""

import importlib

import numpy as np
import pytest
from models import MODELS
from numba import njit

import qddot
from qddot.runner import abi
from qddot.runner.machine.pointers import call_kernel, pointer
from qddot.runner.ranges import expanded

FREQUENCY = 1.3  # Hz
AMPLITUDE = 0.02


@njit
def with_work(t, x, u, c, dx):
    """The right-hand side of a model with one more state: the work of inputs less the work dissipated.

    The last two constants are the addresses of the model's kernels, so that it is compiled once for all models.
    """
    n, E = len(x) - 1, np.empty(4)
    call_kernel(int(c[-2]), t, x[:n], u, c, dx[:n])
    call_kernel(int(c[-1]), t, x[:n], u, c, E)
    dx[n] = E[3] - E[2]


def drive(module):
    """Every input a sine; the channels of rates its exact derivative."""
    channels = []
    for _, of, order, unit, _ in expanded(module.INPUT):
        size = 1e3 * AMPLITUDE if "N" in unit else AMPLITUDE
        phase = 0.3 * len(of)
        if order:
            omega = 2 * np.pi * FREQUENCY
            channels.append(qddot.signal.sine(omega * size, FREQUENCY, phase + np.pi / 2))
        else:
            channels.append(qddot.signal.sine(size, FREQUENCY, phase))
    return channels


@pytest.mark.parametrize("name", MODELS)
def test_power_balance_along_a_trajectory(name):
    module, model = importlib.import_module(f"qddot.generated.{name}"), qddot.load(name)
    parameters = {row[0]: 0.05 for row in expanded(module.PARAMETER) if row[1] == 0.0}  # pendulums get their dampers
    c = model.constants(model.parameter_values(parameters))
    n = len(expanded(module.STATE))
    start = np.append(0.1 * np.cos(np.arange(n)), 0.0)
    rhs, energy = model.kernel("rhs"), model.kernel("energy")
    places = [pointer(each, abi.VECTOR_KERNEL, each.py_func.__name__) for each in (rhs, energy)]
    solution = qddot.solve(
        with_work,
        (0, 2),
        start,
        method="dop853",
        rtol=1e-13,
        atol=1e-13,
        constants=[*c, *places],
        inputs=drive(module),
    )
    energies = []
    for k in range(len(solution.t)):
        u, E = np.array([signal(solution.t[k]) for signal in drive(module)]), np.empty(4)
        energy(solution.t[k], np.ascontiguousarray(solution.states[k, :n]), np.atleast_1d(u), c, E)
        energies.append(E[0] + E[1])
    energies = np.array(energies)
    work = solution.states[:, n]
    assert np.abs(work).max() > 1e-6 * np.abs(energies).max()
    assert np.abs(energies - energies[0] - work).max() <= 1e-10 * np.abs(energies).max()
