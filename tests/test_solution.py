import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

from qddot.runner.files import written_aside
from qddot.runner.inputs.shapes import sine
from qddot.runner.load import load
from qddot.runner.simulate import simulate


@pytest.fixture(scope="module")
def run():
    model = load("tests/sample_models/oscillator.py")
    return simulate(
        model, (0, 1), step=0.01, parameters=("weightless", {"k_1": 80.0}), inputs={"F": 2.0, "z_1": sine(0.01, 3.0)}
    )


def test_columns_are_found_by_name(run):
    assert run.names == ("q_1", "qdot_1", "qddot_1", "F_spring", "F", "z_1", "zdot_1")
    assert (*run.state_names, *run.output_names, *run.input_names) == run.names
    assert run.output_names == ("qddot_1", "F_spring")
    assert len(run.t) == 101
    np.testing.assert_array_equal(run["q_1"], run.states[:, 0])
    np.testing.assert_array_equal(run["F"], 2.0)
    np.testing.assert_allclose(run["z_1"], 0.01 * np.sin(6 * np.pi * run.t), atol=1e-16)
    np.testing.assert_allclose(run["F_spring"], 80.0 * (run["z_1"] - run["q_1"]), atol=1e-14)
    np.testing.assert_allclose(run["qddot_1"], np.gradient(run["qdot_1"], run.t), atol=0.05)
    assert run.quantity("F_spring").unit == "N"
    assert "F_spring" in run


def test_unknown_column_names_the_nearest(run):
    with pytest.raises(KeyError, match="unknown quantity 'q1'; did you mean 'q_1'"):
        run["q1"]


def test_solution_cannot_be_changed(run):
    with pytest.raises(ValueError, match="read-only"):
        run["q_1"][0] = 1.0


def test_statistics_count_steps_and_evaluations(run):
    assert (run.statistics.steps, run.statistics.evaluations) == (100, 400)


def test_xarray_has_units_names_and_metadata(run):
    data = run.to_xarray()
    assert data["q_1"].attrs == {"units": "m", "long_name": "displacement of the mass"}
    assert data["time"].attrs["units"] == "s"
    assert data.attrs["model"] == "oscillator"
    assert data.attrs["method"] == "rk4"
    assert data.attrs["step"] == 0.01
    assert data.attrs["parameter k_1"] == 80.0
    assert data.attrs["status"] == "FINISHED"


def test_saved_file_reads_back_identically(run, tmp_path):
    path = run.save(tmp_path / "new" / "run.nc")
    with xarray.open_dataset(path) as data:
        xarray.testing.assert_identical(data.load(), run.to_xarray())
    assert [each.name for each in path.parent.iterdir()] == ["run.nc"]


def test_saving_replaces_an_older_file(run, tmp_path):
    path = tmp_path / "run.nc"
    path.write_text("old")
    run.save(path)
    with xarray.open_dataset(path) as data:
        assert data.sizes["time"] == 101


def test_failed_saving_leaves_the_older_file_and_nothing_else(tmp_path):
    path = tmp_path / "run.nc"
    path.write_text("old")

    def fail():
        with written_aside(path) as aside:
            aside.write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        fail()
    assert path.read_text() == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


def test_running_and_saving_do_not_import_slow_packages(tmp_path):
    program = f"""
import sys
from qddot.runner.load import load
from qddot.runner.simulate import simulate
simulate(load("tests/sample_models/oscillator.py"), (0, 1), step=0.1).save({str(tmp_path / "run.nc")!r})
slow = {{"xarray", "pandas", "matplotlib", "sympy", "pint", "scipy.interpolate"}}
print(slow & set(sys.modules))
"""
    root = Path(__file__).parent.parent
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=root, check=True)
    assert done.stdout.strip() == "set()"
