"""What a batch gives back is read as a solution is: by the same names, with units, as a data set."""

from dataclasses import fields

import numpy as np
import pytest

import qddot
from qddot.runner.keywords import BatchKeywords, OptionKeywords


@pytest.fixture(scope="module")
def model():
    return qddot.load("quarter_car")


@pytest.fixture(scope="module")
def batch(model):
    k = [2e4, 2e4, 2e4]
    return qddot.simulate_batch(
        model, (0, 0.2), step=1e-3, parameters={"k_s": k}, initial={"z_s": [0.1, 0.0, 1e99]}, output_times=5,
        names=["z_s", "zdot_u"], divergence_limit=1e98,
    )  # fmt: skip


def test_columns_have_the_names_of_a_solution(model, batch):
    initial = {"z_s": 0.1}
    alone = qddot.simulate(
        model, (0, 0.2), step=1e-3, parameters={"k_s": 2e4}, initial=initial, output_times=batch["t"][0]
    )
    np.testing.assert_allclose(batch["zdot_u"][0], alone["zdot_u"], rtol=1e-12)
    assert list(batch) == ["z_s", "zdot_u"]
    assert "z_s" in batch and "z_u" not in batch
    with pytest.raises(KeyError, match="unknown quantity 'z_z'; did you mean 'z_s'"):
        batch["z_z"]


def test_the_state_that_left_is_a_name(batch):
    assert batch.failed_state.tolist() == ["", "", "z_s"]
    assert batch.success.tolist() == [True, True, False]


def test_the_data_set_has_units_and_how_each_run_ended(batch):
    data = batch.to_xarray()
    assert dict(data.sizes) == {"run": 3, "time": 5}
    assert data["zdot_u"].units == "m/s"
    assert data["time"].units == "s"
    assert data["failed_state"].to_numpy().tolist() == ["", "", "z_s"]
    np.testing.assert_array_equal(data["z_s"].sel(run=0), batch["z_s"][0])


def test_the_data_set_of_runs_with_times_of_their_own_has_them_for_each(model):
    batch = qddot.simulate_batch(model, (0, [0.1, 0.2]), step=1e-3, output_times=3, initial=np.zeros((2, 4)))
    data = batch.to_xarray()
    assert dict(data.sizes) == {"run": 2, "sample": 3}
    np.testing.assert_allclose(data["time"], [[0, 0.05, 0.1], [0, 0.1, 0.2]], rtol=1e-15)


def test_the_old_names_work_for_one_version_and_say_so(model, batch):
    with pytest.warns(DeprecationWarning, match="samples= is output_times= now"):
        old = qddot.simulate_batch(model, (0, 0.2), step=1e-3, initial=np.zeros((1, 4)), samples=3)
    assert old.output_times.shape == (1, 3)
    with pytest.warns(DeprecationWarning, match="Batch.output_times now"):
        assert batch.sample_times is batch.output_times
    with pytest.warns(DeprecationWarning), pytest.raises(ValueError, match="both given"):
        qddot.simulate_batch(model, (0, 0.2), step=1e-3, initial=np.zeros((1, 4)), samples=3, output_times=3)


def test_the_keywords_that_an_editor_shows_are_the_options():
    names = {each.name for each in fields(qddot.Options)}
    assert set(OptionKeywords.__annotations__) | {"step"} == names
    assert set(BatchKeywords.__annotations__) < names
