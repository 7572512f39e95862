"""Models, solutions, batches, modes and signals say what they are, at a prompt and in a notebook."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.io import loadmat

import qddot
from qddot.runner import notebook
from qddot.runner.inputs.csv_table import samples_from_csv


@pytest.fixture(scope="module")
def model():
    return qddot.load("quarter_car")


@pytest.fixture(scope="module")
def run(model):
    return qddot.simulate(model, (0, 1), step=1e-3, inputs={"z_r": qddot.signal.sine(0.02, 2.0)})


def test_a_model_says_its_size_and_shows_its_equations(model):
    said = "Quarter car on a road, 2 degrees of freedom; 2 coordinates, 1 input, 3 outputs, 5 parameters"
    assert repr(model) == f"<Model quarter_car: {said}>"
    page = model._repr_html_()
    assert r"m_{s} \ddot{z}_{s} + k_{s} \delta_{s}" in page
    assert page.count("$$") == 2 * len(model.coordinate_names)
    assert "suspension damping" in page


def test_a_solution_says_how_it_ended_and_draws_its_curves(run):
    assert repr(run).startswith("<Solution of quarter_car by rk4: 0 to 1 s, 1001 points, finished; z_s, z_u,")
    page = run._repr_html_()
    shown = [name for names in run.headlines.values() for name in names]
    assert page.count("<svg") == len(shown)
    assert f"{run['z_s'].max():.4g}" in page
    assert run._ipython_key_completions_() == ["t", *run.names]


def test_a_failed_run_says_why(model):
    failed = qddot.simulate(model, (0, 10), method="euler", step=0.05, initial={"z_s": 0.1}, on_failure="return")
    assert not failed.success
    assert "diverged" in failed._repr_html_()
    assert "diverged" in repr(failed)


def test_modes_are_a_table(model):
    modes = qddot.modes(model)
    lines = repr(modes).splitlines()
    assert len(lines) == 1 + len(modes)
    assert f"{modes[0].natural_frequency / 2 / np.pi:.4g}" in lines[1]
    assert modes._repr_html_().count("<tr>") == 1 + len(modes)


def test_a_signal_says_its_pieces():
    pulse = qddot.signal.pulse_train(times=[1.0, 2.0], duration=0.1, peak=5.0).shifted(2.0, 0.5)
    assert "4 breakpoints" in repr(pulse)
    assert "read at 2 t + 0.5" in repr(pulse)
    assert "<svg" in pulse._repr_html_()


def test_a_batch_says_what_it_holds(model):
    batch = qddot.simulate_batch(model, (0, 0.1), method="rk4", step=1e-3, runs=9, output_times=3, names=["z_s"])
    assert repr(batch) == "<Batch of 9 runs, 0 failed: 3 samples of z_s>"
    assert "sprung mass" in batch._repr_html_()


def test_a_curve_keeps_the_peak_of_a_hundred_thousand_points():
    values = np.zeros(100_001)
    values[54_321] = 1.0
    drawn = ElementTree.fromstring(notebook.curve(np.linspace(0, 1, 100_001), values))
    points = [tuple(map(float, pair.split(","))) for pair in drawn[0].attrib["points"].split()]
    assert len(points) <= notebook.POINTS + 2
    top = min(points, key=lambda pair: pair[1])
    assert top == pytest.approx((0.54321 * notebook.WIDTH, 2.0), abs=0.06)


def test_a_curve_leaves_out_what_is_no_number():
    assert "nan" not in notebook.curve(np.arange(4.0), np.array([0.0, np.nan, 1.0, np.inf]))
    assert notebook.curve(np.arange(2.0), np.full(2, np.nan)) == ""


def test_a_data_frame_has_the_time_as_its_index(run):
    frame = run.to_dataframe()
    assert frame.index.name == "time"
    np.testing.assert_array_equal(frame["z_s"], run["z_s"])


def test_a_csv_file_is_read_back_to_the_last_bit(run, tmp_path):
    path = run.save(tmp_path / "run.csv")
    heading = path.read_text().partition("\n")[0]
    assert heading.startswith("time [s],z_s [m],")
    t, values, _ = samples_from_csv(path, "time", "z_s", unit="m")
    np.testing.assert_array_equal(t, run.t)
    np.testing.assert_array_equal(values, run["z_s"])


def test_a_mat_file_has_a_column_for_each_quantity(run, tmp_path):
    read = loadmat(run.save(tmp_path / "run.mat"))
    np.testing.assert_array_equal(read["time"], run.t[:, None])
    np.testing.assert_array_equal(read["delta_s"], run["delta_s"][:, None])


def test_another_suffix_is_refused(run, tmp_path):
    with pytest.raises(ValueError, match=r"run\.xlsx: expected a file that ends in \.nc, \.csv, \.mat"):
        run.save(tmp_path / "run.xlsx")
    assert not list(tmp_path.iterdir())


def test_what_one_works_with_says_what_it_is_in_a_line(model):
    """Arrays and tables of coefficients are for those who ask for them."""
    prepared = qddot.prepare(model, (0.0, 0.5), method="vern7", rtol=1e-8)
    assert repr(prepared) == "<Simulation of quarter_car by vern7: 0 to 0.5 s, 4 states>"
    assert repr(qddot.Options(rtol=1e-8, refine=4)) == "Options(rtol=1e-08, refine=4)"
    study = Path(__file__).parent.parent / "studies" / "one_shot.toml"
    assert repr(qddot.read_study(study)) == f"<Study {study} of m113>"
    slowest = qddot.modes(model)[0]
    assert repr(slowest).startswith(f"<Mode: damped period {slowest.damped_period:.4g} s, ")
    assert "z_s" in repr(slowest)
    said = repr(qddot.methods()).splitlines()
    assert len(said) == len(qddot.methods())
    assert next(line for line in said if "dop853" in line).startswith("<Method dop853: adaptive, order 8, 12 stages; ")
    assert max(map(len, said)) < 300
