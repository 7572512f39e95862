"""A prepared run is run again and again, from other states, at once and within itself: each run is a run of its own."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import qddot
from qddot.runner.simulate import Simulation

#: Every family; dop853 saves more points than a log has room for at first.
METHODS = {
    "rk4": {"step": 1e-3},
    "dop853": {"rtol": 1e-8, "refine": 400},
    "ode15s": {"rtol": 1e-5},
    "rodas5p": {"rtol": 1e-5},
    "exact": {},
    "taylor": {"rtol": 1e-9},
}


@pytest.fixture(scope="module")
def model() -> qddot.Model:
    return qddot.load("m113")


def prepared(model: qddot.Model, method: str, **options: object) -> Simulation:
    shot = qddot.signal.pulse_train(times=[0.3], duration=0.1, impulse=605.0)
    start = np.zeros(len(model.state_names))
    return qddot.prepare(model, (0, 1), method=method, initial=start, inputs={"F": shot}, **METHODS[method], **options)


def starts(model: qddot.Model, count: int) -> np.ndarray:
    return np.random.default_rng(12).uniform(-0.02, 0.02, (count, len(model.state_names)))


@pytest.mark.parametrize("method", METHODS)
def test_a_run_does_not_know_which_were_before_it(model, method):
    first, second = starts(model, 2)
    fresh = [prepared(model, method)(x) for x in (first, second)]
    run = prepared(model, method)
    again = [run(first), run(second), run(first)]
    for found, expected in zip(again, [*fresh, fresh[0]], strict=True):
        np.testing.assert_array_equal(found.t, expected.t)
        np.testing.assert_array_equal(found.values, expected.values)
        for count in ("steps", "failed_attempts", "evaluations", "jacobians", "factorizations"):
            assert getattr(found.statistics, count) == getattr(expected.statistics, count)
    assert not np.shares_memory(again[0].values, again[2].values)
    assert not np.shares_memory(again[0].t, again[2].t)


@pytest.mark.parametrize("method", METHODS)
def test_runs_at_once_have_a_workplace_each(model, method):
    run, states = prepared(model, method), starts(model, 12)
    expected = [run(x).values for x in states]
    with ThreadPoolExecutor(4) as pool:
        for found, each in zip(pool.map(lambda x: run(x).values, states), expected, strict=True):
            np.testing.assert_array_equal(found, each)


def test_a_run_may_be_begun_within_itself(model):
    inner = []

    def progress(done: float) -> None:
        if not inner:
            inner.append(None)
            inner[0] = run(other).values

    run = prepared(model, "rk4", progress=progress)
    one, other = starts(model, 2)
    outer = run(one).values
    plain = prepared(model, "rk4")
    np.testing.assert_array_equal(outer, plain(one).values)
    np.testing.assert_array_equal(inner[0], plain(other).values)


@pytest.mark.parametrize("method", ["rk4", "dop853", "ode15s", "rodas5p", "exact"])
def test_a_run_that_failed_leaves_nothing_to_the_next(model, method):
    good, bad = starts(model, 1)[0], np.full(len(model.state_names), 1e306)
    run = prepared(model, method, divergence_limit=1e6)
    expected = run(good).values
    assert not run(bad, on_failure="return").success
    np.testing.assert_array_equal(run(good).values, expected)


def test_events_of_a_run_are_its_own(model):
    name = model.state_names[0]
    crossing = qddot.crossing(model, name, 0.0)
    run = prepared(model, "dop853", events=[crossing])
    first, second = starts(model, 2)
    alone = prepared(model, "dop853", events=[crossing])(first).events
    found = run(first).events
    run(second)
    np.testing.assert_array_equal(found.t, alone.t)
    np.testing.assert_array_equal(run(first).events.states, alone.states)
