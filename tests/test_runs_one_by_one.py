"""Batches whose runs go one by one: each is what it is alone, whatever the one before it left behind."""

import numpy as np
import pytest

import qddot

METHODS = {"taylor": {}, "vern7": {}, "ode45": {}, "rk4": {"step": 2e-3}, "ode15s": {}, "rodas5p": {}}
TIMES = np.array([0.0, 0.21, 0.5])


@pytest.fixture(scope="module")
def four_bar():
    return qddot.load("four_bar")


def states(model, speeds):
    guess = {"theta_2": 0.6, "theta_3": 1.5}
    return np.array([qddot.assemble(model, {"theta_1": 0.4, "thetadot_1": v}, guess=guess) for v in speeds])


@pytest.mark.parametrize("method", METHODS)
def test_each_run_is_what_it_is_alone(four_bar, method):
    """Runs 0 to 2 differ by start and parameters, 3 and 4 by their inputs, 5 is a repetition of the first."""
    starts = states(four_bar, (2.0, 3.0, -1.0, 2.5, 2.5, 2.0))
    friction, mass = np.array([0.0, 0.4, 0.0, 0.1, 0.1, 0.0]), np.array([2.0, 2.0, 3.0, 2.5, 2.5, 2.0])
    torques = [0.2, 0.2, 0.2, qddot.signal.sine(1.0, 0.7), qddot.signal.sine(2.0, 0.7), 0.2]
    options = METHODS[method]
    batch = qddot.simulate_batch(
        four_bar, (0, 0.5), method=method, initial=starts, parameters={"c": friction, "m_2": mass},
        inputs={"M_1": torques}, output_times=TIMES, names=("theta_2", "lam_x"), **options,
    )  # fmt: skip
    assert not batch.in_lanes
    for run, x in enumerate(starts):
        alone = qddot.simulate(
            four_bar, (0, 0.5), method=method, initial=x, parameters={"c": friction[run], "m_2": mass[run]},
            inputs={"M_1": torques[run]}, output_times=TIMES, **options,
        )  # fmt: skip
        assert np.array_equal(batch.final[run], alone.states[-1]), run
        assert np.array_equal(batch["lam_x"][run], alone["lam_x"]), run
    assert np.array_equal(batch.final[0], batch.final[5]) and not np.array_equal(batch.final[3], batch.final[4])


def test_a_run_that_fails_leaves_nothing_to_the_next(four_bar):
    """A limit that the second run passes: the third is what it is without it."""
    starts = states(four_bar, (2.0, 300.0, 2.0))
    batch = qddot.simulate_batch(four_bar, (0, 0.2), method="vern7", initial=starts, divergence_limit=100.0)
    assert batch.success.tolist() == [True, False, True] and np.array_equal(batch.final[0], batch.final[2])


def test_runs_under_a_time_limit_are_the_same(four_bar):
    starts = states(four_bar, (2.0, 3.0))
    free, limited = (
        qddot.simulate_batch(four_bar, (0, 0.2), method="taylor", initial=starts, time_limit=limit)
        for limit in (None, 60.0)
    )
    assert np.array_equal(free.final, limited.final)
