"""The stiff flyball governor over its time, beside SciPy's Radau on SymPy's equations.

No published figures of it were at hand that are certain, so none are claimed.
"""

from dataclasses import replace

import numpy as np
import pytest
from benchmark_library import governor
from mechanisms import energy
from scipy.integrate import solve_ivp
from sympy import Symbol
from test_benchmark_library import governor_by_sympy

import qddot
from qddot.model import State

#: Springs of 8e5 N/m and dampers of 4e4 N s/m on balls that swing within seconds.
START, END = np.array([0.0, np.pi / 6, np.pi / 6, 0.5, 2 * np.pi, 0.0, 0.0, 0.0]), 10.0


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    """With the work of its dampers as a state."""
    work = State(Symbol("lost"), 2 * governor().dissipation, "J", "work of the dampers")
    with pytest.warns(match="nothing depends on the state lost"):
        made = replace(governor(), states=[work])
    return qddot.load(qddot.generate(made, tmp_path_factory.mktemp("kernels")))


@pytest.fixture(scope="module")
def reference():
    """Its states at 21 times, by an implicit method of order 5 in another program, from other equations."""
    times = np.linspace(0.0, END, 21)
    with np.errstate(over="ignore"):  # in the steps of its differences for a Jacobian
        run = solve_ivp(governor_by_sympy(), (0.0, END), START, "Radau", times, rtol=1e-9, atol=1e-10)
    assert run.success
    return times, run.y.T


@pytest.mark.parametrize(("method", "tolerance"), [("ode15s", 1e-5), ("rodas5p", 1e-6)])
def test_the_stiff_governor_in_time(turning, reference, method, tolerance):
    times, expected = reference
    run = qddot.simulate(
        turning, (0.0, END), initial=[*START, 0.0], method=method, rtol=1e-9, atol=1e-10, output_times=times
    )
    found = np.array([run[name] for name in turning.state_names[:8]]).T
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(found - expected).max(axis=0) <= tolerance * np.maximum(scale, 1.0)).all()
    # both sides alike, for good; nothing turns the shaft, so that its momentum stays
    assert np.abs(run["b_1"] - run["b_2"]).max() < 1e-7
    assert np.ptp(run["b_1"]) > 0.01
    assert np.ptp(momentum(found)) < 1e-5
    # what is lost is what the dampers take
    total = energy(turning, run)
    assert total[0] - total[-1] > 3e-3
    assert np.abs(total + run["lost"] - total[0]).max() < 1e-7 * total[0]


def momentum(states):
    """About the shaft, from the bodies by hand, in N m s."""
    across, along = np.cos(states[:, 1]), np.sin(states[:, 1])
    section = 0.01**2
    rod = 0.3 * (0.05 + 0.5 * across) ** 2 + 0.3 * (section / 6 * along**2 + (1 + section) / 12 * across**2)
    own = 0.3 * section / 6 + 3.0 * 0.01 / 6
    return (2 * (5.0 * (0.05 + across) ** 2 + rod) + own) * states[:, 4]
