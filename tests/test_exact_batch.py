"""A batch of exact runs against the same runs alone."""

import numpy as np
import pytest

import qddot
from qddot.runner.exact.batch import propagate_batch
from qddot.runner.inputs.shapes import constant
from qddot.runner.inputs.tables import table
from qddot.runner.load import load
from qddot.runner.problem import Status

RUNS, SAMPLES = 37, 41
SIGNALS = (
    constant(0.0),
    qddot.signal.sine(0.02, 0.6, 0.3),
    table(np.array([-9.0, 0.3, 0.45, 20.0]), np.array([0.0, 0.02, -0.01, 0.03])),
    table(np.linspace(-9.0, 20.0, 40), 0.02 * np.cos(np.arange(40.0)), "cubic"),
    qddot.signal.pulse_train(times=[0.0], duration=0.1, impulse=605.0),
)


def batch_of(model, runs, samples, columns, seed=1):
    """Arrays of random runs."""
    random, channels = np.random.default_rng(seed), model.tables.inputs
    n, lengths = len(model.state_names), np.array([len(signal.pieces) for signal in SIGNALS])
    values = model.parameter_values()
    p = values * random.uniform(0.9, 1.1, (runs, len(values)))
    sources = [[c.name for c in channels].index(c.input) for c in channels]
    t1 = random.uniform(1.0, 2.0, runs)
    whole = {"status": 0, "failed_state": -1, "steps": 0, "evaluations": 0}
    return p, {
        "t0": random.uniform(-0.5, 0.0, runs),
        "t1": t1,
        "initial": 0.01 * random.standard_normal((runs, n)),
        "constants": np.array([model.constants(row) for row in p]).reshape(runs, len(model.tables.constant_names)),
        "table": random.integers(0, len(SIGNALS), (runs, len(channels)))[:, sources].copy(),
        "rate": random.uniform(-2.0, 2.0, (runs, len(channels)))[:, sources].copy(),
        "offset": random.uniform(-1.0, 1.0, (runs, len(channels)))[:, sources].copy(),
        "order": np.array([c.order for c in channels], dtype=np.int64),
        "pieces": np.concatenate([signal.pieces for signal in SIGNALS]),
        "first": np.cumsum(lengths) - lengths,
        "last": np.cumsum(lengths) - 1,
        "times": np.linspace(-0.2, t1, samples, axis=1).copy(),
        "columns": np.array(columns, dtype=np.int64),
        "samples": np.full((runs, samples, len(columns)), np.nan),
        "final": np.full((runs, n), np.nan),
        "failed_at": np.full(runs, np.nan),
        **{name: np.full(runs, value, dtype=np.int64) for name, value in whole.items()},
    }


@pytest.mark.parametrize("name", ["m113", "quarter_car"])
def test_each_run_is_what_it_is_alone(name):
    model = load(name)
    columns = [0, len(model.state_names) - 1, len(model.state_names)]
    p, arrays = batch_of(model, RUNS, SAMPLES, columns)
    propagate_batch(model, arrays, threads=2)
    assert (arrays["status"] == int(Status.FINISHED)).all()
    parameters, channels = [each.name for each in model.tables.parameters], model.tables.inputs
    for run in range(0, RUNS, 4):
        inputs = {
            channel.name: SIGNALS[arrays["table"][run, i]].shifted(arrays["rate"][run, i], arrays["offset"][run, i])
            for i, channel in enumerate(channels)
            if not channel.order
        }
        span, times = (arrays["t0"][run], arrays["t1"][run]), arrays["times"][run]
        case = {"parameters": dict(zip(parameters, p[run], strict=True)), "initial": arrays["initial"][run]}
        alone = qddot.simulate(model, span, method="exact", inputs=inputs, output_times=times[times >= span[0]], **case)
        scale = 1e-10 * np.abs(alone.states).max()
        np.testing.assert_allclose(arrays["final"][run], alone.states[-1], rtol=0, atol=scale)
        reached = times > span[0]
        np.testing.assert_array_equal(np.isfinite(arrays["samples"][run, :, 0]), reached)
        for j, column in enumerate(columns):
            expected = alone.values[-reached.sum() :, column]
            atol = 1e-10 * np.abs(alone.values[:, column]).max() + scale
            np.testing.assert_allclose(arrays["samples"][run, reached, j], expected, rtol=0, atol=atol)


def test_a_run_that_diverges_and_one_that_is_not_finite_stop_alone():
    model = load("quarter_car")
    _, arrays = batch_of(model, 20, 3, [0])
    damping = model.tables.constant_names.index("c_s")
    arrays["constants"][3, damping] = -1e7
    arrays["initial"][11, 0] = np.nan
    propagate_batch(model, arrays, limit=1e50)
    failed = np.flatnonzero(arrays["status"] == int(Status.NON_FINITE))
    assert failed.tolist() == [3, 11]
    assert arrays["t0"][3] < arrays["failed_at"][3] <= arrays["t1"][3]
    assert (arrays["failed_state"][failed] >= 0).all()
    assert np.isfinite(np.delete(arrays["final"], failed, axis=0)).all()
    assert np.isfinite(arrays["final"][3]).all()


def test_no_runs_and_a_nonlinear_model():
    model = load("quarter_car")
    _, arrays = batch_of(model, 0, 3, [0])
    propagate_batch(model, arrays)
    with pytest.raises(ValueError, match="model pendulum is nonlinear"):
        propagate_batch(load("pendulum"), arrays)


def test_progress_and_the_time_limit():
    model = load("quarter_car")
    _, arrays = batch_of(model, 50, 2, [0])
    reports = []
    propagate_batch(model, arrays, progress=reports.append)
    assert reports[-1] == 1.0


def test_simulate_batch_takes_the_exact_way():
    model = load("m113")
    road, shot = SIGNALS[1], SIGNALS[4]
    masses, speeds = np.linspace(9e3, 12e3, 9), np.linspace(2.0, 8.0, 9)
    inputs = {"F": qddot.per_run(shot, offset=-0.1 * speeds), "z_1": qddot.per_run(road, speeds)}
    batch = qddot.simulate_batch(
        model,
        (0, 2),
        method="exact",
        parameters={"m_6": masses},
        inputs=inputs,
        output_times=21,
        names=["heave", "q_1"],
    )  # fmt: skip
    assert batch.success.all() and not batch.in_lanes
    for run in (0, 4, 8):
        alone = qddot.simulate(
            model,
            (0, 2),
            method="exact",
            parameters={"m_6": masses[run]},
            inputs={"F": shot.shifted(offset=-0.1 * speeds[run]), "z_1": road.shifted(speeds[run])},
            output_times=np.linspace(0, 2, 21),
        )
        np.testing.assert_allclose(batch.samples[run, :, 0], alone["heave"], rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(batch.final[run], alone.states[-1], rtol=1e-11, atol=1e-14)


def test_simulate_batch_refuses_to_propagate_a_nonlinear_model_exactly():
    with pytest.raises(ValueError, match="is nonlinear"):
        qddot.simulate_batch(load("double_pendulum"), (0, 1), method="exact", runs=2)
