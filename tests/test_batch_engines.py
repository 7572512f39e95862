"""The engines of batches: whichever way runs go, their rows are the same, to rounding."""

import numpy as np
import pytest
import xarray
from batches import STUDY, values, written

from qddot.runner.batch.alone import alone
from qddot.runner.batch.engine import run_block
from qddot.runner.batch.job import read_job
from qddot.runner.batch.outcome import refused
from qddot.runner.batch.run import run_batch
from qddot.runner.lanes import batch as many_runs
from qddot.runner.problem import Status
from qddot.runner.study.rows import row_of

#: A linear model with roads and pulses, all kinds of quantities, and a method that is exact.
EXACT = STUDY.replace('method = "rk4"\nstep = 1e-3', 'method = "exact"')


def both_ways(job):
    """What becomes of the first block together and one by one."""
    runs = [job.prepared(run) for run in job.runs(0)]
    pairs = list(enumerate(runs))
    single = refused(len(runs), len(job.model.state_names), job.sampling.count, len(job.observer.places))
    alone(pairs, job.observer, job.sampling, single)
    return run_block(runs, job.observer, job.sampling), single


@pytest.fixture
def counted(monkeypatch):
    """How many runs each call of the exact batch takes."""
    taken, compute = [], many_runs.propagate_batch
    monkeypatch.setattr(
        many_runs,
        "propagate_batch",
        lambda model, arrays, **rest: taken.append(len(arrays["t0"])) or compute(model, arrays, **rest),
    )
    return taken


@pytest.mark.parametrize("keep", ['["z_s"]', '["z_s", "zdot_u", "z_r", "kinetic_energy"]'])
def test_exact_runs_of_a_block_go_together_and_are_what_they_are_one_by_one(tmp_path, counted, keep):
    text = EXACT.replace("block = 4", "block = 36").replace('keep = ["z_s"]', f"keep = {keep}")
    together, single = both_ways(read_job(written(tmp_path, text)))
    assert counted == [36]
    assert (together.status == Status.FINISHED).all()
    assert not together.refusals
    scale = np.abs(single.samples).max(axis=(0, 1))
    assert np.abs(together.samples - single.samples).max(axis=(0, 1)) == pytest.approx(0, abs=1e-12 * scale.max())
    np.testing.assert_allclose(together.final_states, single.final_states, rtol=1e-11, atol=1e-14)
    for name in ("status", "steps", "evaluations", "failed_state"):
        assert np.array_equal(getattr(together, name), getattr(single, name)), name


def test_an_exact_run_that_diverges_fails_alone_in_its_block(tmp_path, counted):
    """A negative stiffness of the suspension: the car runs away, the faster the more negative."""
    text = EXACT.replace('linspace = ["200 kg", "400 kg", 9]', "values = [-9e9, 20e3, 30e3]")
    text = text.replace('key = "parameters.m_s"', 'key = "parameters.k_s"').replace("span = [0, 0.5]", "span = [0, 5]")
    text = text.replace('interval = "1 ms"', 'interval = "10 ms"').replace("block = 4", "block = 12")
    together, single = both_ways(read_job(written(tmp_path, text)))
    assert counted == [12]
    assert set(together.status[:4]) == {Status.NON_FINITE}
    assert set(together.status[4:]) == {Status.FINISHED}
    np.testing.assert_array_equal(together.status, single.status)
    np.testing.assert_array_equal(together.failed_state, single.failed_state)
    np.testing.assert_allclose(together.failed_at[:4], single.failed_at[:4], rtol=1e-12)
    np.testing.assert_array_equal(np.isfinite(together.samples), np.isfinite(single.samples))


def test_an_option_that_only_single_runs_take_sends_them_alone(tmp_path, counted):
    text = EXACT.replace('method = "exact"', 'method = "exact"\ntime_limit = "1 h"')
    store = run_batch(written(tmp_path, text), tmp_path / "limited.zarr")
    assert counted == []
    assert (values(store)["status"] == Status.FINISHED).all()


def test_an_exact_batch_that_was_stopped_goes_on_to_the_same_store(tmp_path):
    path = written(tmp_path, EXACT)
    whole, part = tmp_path / "whole.zarr", tmp_path / "part.zarr"
    run_batch(path, whole)
    run_batch(path, part)
    for index in (1, 5, 8):  # as if they had not been computed
        (part / ".qddot" / "blocks" / f"{index:08d}.json").unlink()
    run_batch(path, part)
    with xarray.open_zarr(whole) as one, xarray.open_zarr(part) as other:
        assert one.identical(other)


def test_methods_of_a_sweep_go_each_its_way_in_one_block(tmp_path, counted):
    axis = 'key = "integration.method"\nname = "way"\nvalues = ["exact", "rk4", "ode15s"]'
    text = EXACT.replace('key = "parameters.m_s"\nlinspace = ["200 kg", "400 kg", 9]', axis)
    text = text.replace("block = 4", "block = 12").replace(
        '[integration]\nmethod = "exact"',
        '[integration]\nmethod = "exact"\nfixed.step = 1e-4\nadaptive = { rtol = 1e-9, atol = 1e-12 }',
    )
    path = written(tmp_path, text)
    found = values(run_batch(path, tmp_path / "ways.zarr"))
    assert 4 in counted
    travel = found["travel"].reshape(3, 4)
    np.testing.assert_allclose(travel, np.tile(travel[0], (3, 1)), rtol=1e-6)
    assert travel[0] == pytest.approx(travel[0, 0] * np.arange(1, 5), rel=1e-9)
    single = row_of(path, {"integration.output_times": list(np.linspace(0, 0.5, 501))}, 2).run()
    np.testing.assert_allclose(found["z_s"][2], single["z_s"][::5], rtol=0, atol=1e-12)
