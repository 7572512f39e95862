"""Where constraints are redundant, what single ones carry is told to be undetermined, by name, wherever it is shown."""

import numpy as np
import pytest
from mechanisms import parallel_cranks, spherical_pendulum

import qddot
from qddot.runner.pictures.arrange import run_picture
from qddot.runner.report.saved_run import read_run
from qddot.runner.report.tables import not_finite, summary_rows

PINS = ("lam_2x", "lam_2y", "lam_3x", "lam_3y")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Three parallel cranks, swinging: four equations, of which two are independent wherever they stand."""
    model = qddot.load(qddot.generate(parallel_cranks(), tmp_path_factory.mktemp("cranks")))
    start = qddot.assemble(model, {"theta_1": 0.3, "thetadot_1": 1.0}, guess={"theta_2": 0.2, "theta_3": 0.2})
    return qddot.simulate(model, (0, 1), initial=start, method="ode45", output_times=np.linspace(0, 1, 11))


def test_the_result_names_them_and_the_reactions_are_numbers(run):
    assert run.undetermined == PINS
    assert np.isnan([run[name] for name in PINS]).all()
    assert np.isfinite([run[f"reaction_theta_{k}"] for k in (1, 2, 3)]).all()


def test_the_summary_says_so_in_one_line_and_in_place_of_a_number(run):
    (line,) = not_finite(run)
    assert line.startswith(f"{', '.join(PINS)} are undetermined at 11 of 11 points, first at 0 s: ")
    assert "reaction_theta_1, reaction_theta_2, reaction_theta_3" in line
    rows = {name: numbers for name, _, *numbers in summary_rows(run)}
    assert rows["lam_2x"] == ["undetermined", "", "", "", ""]
    assert "nan" not in str(rows)
    assert run._repr_html_().count("undetermined") == 2 * len(PINS)


def test_the_figure_says_what_it_does_not_draw(run, tmp_path):
    picture = run_picture(run, run.headlines)
    assert f"undetermined throughout, not drawn: {', '.join(PINS)}" in picture.notes
    drawn = {curve.name for panel in picture.panels for curve in panel.curves}
    assert "reaction_theta_1" in drawn and not drawn & set(PINS)
    chosen = run_picture(run, run.headlines, panels=["lam_2x", "theta_1"])
    assert chosen.notes == ("undetermined where there is no line: lam_2x",)
    saved = read_run(run.save(tmp_path / "cranks.nc"))
    assert run_picture(saved, saved.headlines).notes == picture.notes


def test_nothing_is_said_where_all_are_determined(tmp_path):
    model = qddot.load(qddot.generate(spherical_pendulum(), tmp_path))
    start = qddot.assemble(model, {"x": 0.5, "y": 0.0, "ydot": 1.0}, guess={"z": -1.0})
    found = qddot.simulate(model, (0, 0.1), initial=start, method="ode45", output_times=[0, 0.1])
    assert found.undetermined == () and not_finite(found) == []
    assert found.headlines["multipliers"] == ("lam",) and "lam" not in found.headlines["outputs"]
    assert not any("undetermined" in note for note in run_picture(found, found.headlines).notes)
