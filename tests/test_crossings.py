"""Events by name: states and outputs that cross a level, against the analytic times."""

import numpy as np
import pytest

import qddot


@pytest.fixture(scope="module")
def axle():
    return qddot.load("one_axle")


def omega():
    return np.sqrt((2.15e6 + 6.5e4) / 120.0)


@pytest.mark.parametrize("method", ["ode45", "dop853", "ode15s"])
def test_a_state_and_an_output_cross_where_theory_says(axle, method):
    """q = -g/w^2 (1 - cos wt) passes its middle at wt = pi/2, 3 pi/2, ...; the force is stiffness times q."""
    middle = -9.81 / omega() ** 2
    events = [
        qddot.crossing(axle, "q_2", middle, direction=-1),
        qddot.crossing(axle, "axle_force", middle * (2.15e6 + 6.5e4), direction=1),
    ]
    found = qddot.simulate(axle, (0, 0.1), method=method, rtol=1e-8, atol=1e-12, initial=[0, 0], events=events).events
    periods = 2 * np.pi / omega() * np.arange(3)
    falling, rising = periods + np.pi / 2 / omega(), periods + 3 * np.pi / 2 / omega()
    assert found.times("q_2") == pytest.approx(falling[falling < 0.1], abs=2e-6)
    assert found.times("axle_force") == pytest.approx(rising[rising < 0.1], abs=2e-6)


def test_a_terminal_crossing_ends_the_run(axle):
    stop = qddot.crossing(axle, "q_2", -9.81 / omega() ** 2, terminal=True)
    solution = qddot.simulate(axle, (0, 1), method="dop853", rtol=1e-8, atol=1e-12, initial=[0, 0], events=[stop])
    assert solution.success
    assert solution.t[-1] == pytest.approx(np.pi / 2 / omega(), abs=1e-7)
    assert "ended by an event" in solution.message


def test_unknown_names_and_runs_without_events_say_so(axle):
    with pytest.raises(ValueError, match=r"unknown state or output 'q_3'; did you mean 'q_2'\?"):
        qddot.crossing(axle, "q_3")
    with pytest.raises(ValueError, match="watched for no events"):
        _ = qddot.simulate(axle, (0, 0.01), method="ode45", initial=[0, 0]).events
