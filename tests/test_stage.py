"""A kernel compiled for the state of a stage, y + factor * k, gives what it gives for the sum itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numba import njit
from sympy import symbols

import qddot
from qddot.model.system import Coordinate, Parameter, System
from qddot.runner.machine.memory import BLOCK, address
from qddot.runner.machine.stage import call_stage, stage_pointer
from qddot.runner.machine.sums import add_latest, any_beyond, copy_items, sum_slopes

numbers = st.floats(-2, 2)


@njit
def at_stage(kernel, t, y, k, factor, u, c, dx):
    call_stage(kernel, t, y, k, factor, u, c, dx)


@pytest.mark.parametrize("name", ["m113", "double_pendulum"])
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_a_kernel_sums_the_state_of_a_stage_by_itself(name, data):
    model = qddot.load(name)
    n, c = len(model.state_names), model.constants(model.parameter_values())
    y, k = (data.draw(arrays(np.float64, n, elements=numbers)) for _ in range(2))
    factor, u = data.draw(numbers), np.linspace(-1, 1, 11)
    expected, found = np.empty(n), np.empty(n)
    model.kernel("rhs")(0.0, y + factor * k, u, c, expected)
    at_stage(
        stage_pointer(model.kernel("rhs")), 0.0, address(y), address(k), factor, address(u), address(c), address(found)
    )
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@njit
def sums(base, h, weights, count, slopes, target, n):
    sum_slopes(base, h, weights, count, slopes, 8 * BLOCK, target)
    add_latest(target, h, slopes + 8 * BLOCK * count, n)


@njit
def beyond(row, limit):
    return any_beyond(row, limit)


@njit
def copied(source, target, count):
    copy_items(source, target, count)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 6), st.integers(1, BLOCK), st.integers(0, 2**32 - 1))
def test_sums_over_slopes_are_those_of_numpy(count, n, seed):
    rng = np.random.default_rng(seed)
    base, weights, slopes = rng.normal(size=BLOCK), rng.normal(size=count), rng.normal(size=(count + 1, BLOCK))
    target = np.full(BLOCK, np.nan)
    sums(address(base), 0.3, address(weights), count, address(slopes), address(target), n)
    expected = base + 0.3 * weights @ slopes[:count]
    expected[:n] += 0.3 * slopes[count, :n]
    np.testing.assert_allclose(target, expected, rtol=1e-12, atol=1e-13)
    copied(address(target), address(base), n)
    assert (base[:n] == target[:n]).all()


@pytest.mark.parametrize("value", [7.1, -7.1, np.inf, -np.inf, np.nan])
@pytest.mark.parametrize("place", [0, 5, BLOCK - 1])
def test_a_value_beyond_the_limit_is_seen_wherever_it_stands(value, place):
    row = np.linspace(-7, 7, BLOCK)
    assert not beyond(address(row), 7.0)
    row[place] = value
    assert beyond(address(row), 7.0)


@pytest.fixture(scope="module")
def falling(tmp_path_factory):
    """A mass that an attracting centre pulls: the force divides by the distance squared."""
    r, rdot, m, k = symbols("r rdot m k")
    system = System(
        name="falling",
        title="Mass pulled to a centre",
        coordinates=(Coordinate(r, "m", "distance to the centre"),),
        parameters=(Parameter(m, 1.0, "kg", "mass"), Parameter(k, 1.0, "N m^2", "strength")),
        kinetic_energy=m * rdot**2 / 2,
        potential_energy=-k / r,
    )
    return qddot.load(qddot.generate(system, tmp_path_factory.mktemp("falling")))


@pytest.mark.parametrize("settings", [{"method": "rk4", "step": 1e-3}, {"method": "dop853"}])
def test_a_division_by_zero_ends_a_run_with_time_and_state(falling, settings):
    with pytest.raises(qddot.IntegrationError, match=r"at t = 0 s.*rdot left first|at t = 0.001 s.*rdot left first"):
        qddot.simulate(falling, (0, 1), initial={"r": 0.0}, **settings)
