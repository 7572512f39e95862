"""Identification: known unknowns come back within their stated errors, and what the data cannot tell is said."""

import json
import tomllib
from datetime import date
from pathlib import Path

import numpy as np
import pytest
from commands import command
from scipy.stats import binomtest, chi2

import qddot
from qddot.runner.identify.fit import fit
from qddot.runner.identify.judge import judge
from qddot.runner.identify.problem import read
from qddot.runner.identify.store import estimates, save
from qddot.runner.inputs.shapes import pulse_train, sine
from qddot.runner.load import load
from qddot.runner.report.identified_figure import draw
from qddot.runner.simulate import simulate
from qddot.runner.study.read import StudyError
from qddot.runner.study.ready import run_study

ROOT = Path(__file__).parent.parent
PAPER = ROOT / "studies" / "paper"

STUDY = """\
model = "quarter_car"
span = [0, 1.5]
[integration]
method = "rk4"
step = 5e-3
[inputs.z_r]
kind = "pulse_train"
times = [0.1]
peak = 0.05
duration = 0.2
"""

HEAD = """\
title = "Body stiffness and damping"
name = "suspension"
study = "study.toml"
[unknowns.stiffness]
key = "parameters.k_s"
start = 20000
lower = 5000
upper = 60000
unit = "N/m"
[unknowns.damping]
key = "parameters.c_s"
start = 2000
lower = 200
upper = 6000
"""
TRUE, SIGMA = {"k_s": 16000.0, "c_s": 1200.0}, 5e-4
TIMES = np.linspace(0.1, 1.4, 25)


def scenario(observations, name="bump", settings="{}"):
    rows = "".join(f"[[scenarios.observations]]\n{each}\n" for each in observations)
    return f'[[scenarios]]\nname = "{name}"\nset = {settings}\n{rows}'


def curve(values, quantity="z_s", sigma=SIGMA):
    points = f"t = {TIMES.tolist()}\nvalues = {np.asarray(values).tolist()}"
    return f'quantity = "{quantity}"\nchange = true\nsigma = {sigma}\n{points}'


def problem(folder, text, study=STUDY):
    (folder / "study.toml").write_text(study)
    (folder / "identify.toml").write_text(text)
    return read(folder / "identify.toml")


@pytest.fixture(scope="module")
def truth():
    """Displacement of the body at TIMES by a step ten times as fine, in two scenarios: peaks of 0.05 and of 0.02 m."""
    found = []
    for peak in (0.05, 0.02):
        road = pulse_train(times=[0.1], peak=peak, duration=0.2)
        run = simulate(load("quarter_car"), (0, 1.5), step=5e-4, parameters=TRUE, inputs={"z_r": road}, every=1)
        found.append(np.interp(TIMES, run.t, run["z_s"] - run["z_s"][0]))
    return found


def two_scenarios(truth, noise):
    second = scenario([curve(truth[1] + noise[1])], "low bump", '{ "inputs.z_r.peak" = 0.02 }')
    return HEAD + scenario([curve(truth[0] + noise[0])]) + second


def test_without_noise_the_true_values_come_back(tmp_path, truth):
    given = problem(tmp_path, two_scenarios(truth, np.zeros((2, 25))))
    found = fit(given)
    assert found.converged
    assert found.x == pytest.approx(list(TRUE.values()), rel=1e-4)
    assert not judge(given, found).notes


def test_a_curve_in_a_file_is_the_curve_written_out(tmp_path, truth):
    rows = zip((TIMES * 1e3).tolist(), (truth[0] * 1e3).tolist(), strict=True)
    (tmp_path / "body.csv").write_text("z_s [mm];t [ms]\n" + "".join(f"{y!r};{t!r}\n" for t, y in rows))
    told = f'quantity = "z_s"\nchange = true\nsigma = {SIGMA}\nfile = "body.csv"\ncolumns = ["t", "z_s"]'
    x = np.array([2e4, 2e3])
    from_file, inline = (problem(tmp_path, HEAD + scenario([each])) for each in (told, curve(truth[0])))
    assert from_file.residuals(x) == pytest.approx(inline.residuals(x), rel=1e-9)
    assert draw(from_file, fit(from_file), tmp_path / "fit.png").is_file()


def test_the_stated_uncertainty_covers_the_truth_as_often_as_it_says(tmp_path, truth):
    """The distance from the truth by the stated covariance is chi squared with 2 degrees of freedom."""
    rng = np.random.default_rng(11)
    distances, misfits = [], []
    near = HEAD.replace("start = 20000", "start = 16500").replace("start = 2000", "start = 1300")
    for _ in range(40):
        given = problem(tmp_path, near + scenario([curve(truth[0] + rng.normal(0, SIGMA, 25))]))
        found = fit(given)
        judgement = judge(given, found)
        off = found.x - list(TRUE.values())
        distances.append(off @ np.linalg.solve(judgement.covariance, off))
        misfits.append(judgement.misfit)
    for level in (0.5, 0.683, 0.9):
        inside = int((np.array(distances) < chi2.ppf(level, 2)).sum())
        assert binomtest(inside, 40, level).pvalue > 1e-3, (level, inside)
    assert binomtest(int((np.array(misfits) < 0.5).sum()), 40, 0.5).pvalue > 1e-3


def test_the_covariance_is_that_of_an_independent_linearization(tmp_path, truth):
    given = problem(tmp_path, two_scenarios(truth, np.random.default_rng(3).normal(0, SIGMA, (2, 25))))
    found = fit(given)
    steps = np.diag([1.0, 0.1])
    J = np.array([(given.residuals(found.x + h) - given.residuals(found.x - h)) / (2 * h.sum()) for h in steps]).T
    expected = np.linalg.inv(J.T @ J)
    assert judge(given, found).covariance == pytest.approx(expected, rel=1e-3)


def test_an_unknown_the_data_do_not_know_is_named(tmp_path, truth):
    """Where the wheel starts, within a nanometre, is nothing that these data could tell."""
    text = HEAD.replace("parameters.k_s", "initial.z_u").replace("20000", "0").replace("60000", "1e-9")
    text = text.replace("lower = 5000", "lower = -1e-9")
    given = problem(tmp_path, text + scenario([curve(truth[0])]), STUDY + "[initial]\nz_s = 0.0\n")
    judgement = judge(given, fit(given))
    assert any("cannot tell stiffness" in note for note in judgement.notes)


def test_two_that_only_work_together_are_named_together(tmp_path):
    """Mass, stiffness and damping of the body times one number move it alike where the tyre is stiff."""
    extra = '[unknowns.mass]\nkey = "parameters.m_s"\nstart = 300\nlower = 100\nupper = 900\n'
    study = STUDY.replace("5e-3", "2e-4") + "[parameters]\nk_t = 1e9\nm_s = 280\n"
    (tmp_path / "true.toml").write_text(study + "k_s = 16000\nc_s = 1200\n")
    run = run_study(tmp_path / "true.toml")
    seen = np.interp(TIMES, run.t, run["z_s"] - run["z_s"][0])
    given = problem(tmp_path, HEAD + extra + scenario([curve(seen)]), study)
    notes = judge(given, fit(given)).notes
    assert any("cannot tell" in note and "mass" in note and "stiffness" in note for note in notes), notes


def test_a_bound_that_stops_the_search_is_named(tmp_path, truth):
    text = HEAD.replace("start = 20000\nlower = 5000", "start = 25000\nlower = 20000")
    given = problem(tmp_path, text + scenario([curve(truth[0])]))
    found = fit(given)
    judgement = judge(given, found)
    assert found.at_lower.tolist() == [True, False]
    assert judgement.standard_errors[0] == 0
    assert judgement.standard_errors[1] > 0
    assert any(note.startswith("stiffness is at its lower bound") for note in judgement.notes)
    assert not judgement.fits
    assert any("not met within their stated errors" in note for note in judgement.notes)


def test_numbers_are_taken_of_a_run_as_they_are_called():
    run = simulate(load("quarter_car"), (0, 2), step=1e-3, inputs={"z_r": sine(0.01, 2.0)}, initial=[0.0] * 4, every=7)

    def number(**said):
        return qddot.reading(run, "z_r", said.pop("measure", "greatest"), **said)

    assert number(measure="greatest") == pytest.approx(0.01, rel=1e-6)  # between the saved points
    assert number(measure="least") == pytest.approx(-0.01, rel=1e-6)
    assert number(measure="range") == pytest.approx(0.02, rel=1e-6)
    assert number(measure="largest", after=0.01, before=0.05) == pytest.approx(
        0.01 * np.sin(4 * np.pi * 0.05), rel=1e-6
    )
    assert number(measure="rms") == pytest.approx(0.01 / np.sqrt(2), rel=1e-3)
    assert number(measure="at", at=0.1234) == pytest.approx(0.01 * np.sin(4 * np.pi * 0.1234), rel=1e-6)
    with pytest.raises(ValueError, match="fewer than three points"):
        number(after=1.0, before=1.001)


def test_the_result_is_a_set_that_a_study_takes_up(tmp_path, truth):
    given = problem(tmp_path, two_scenarios(truth, np.zeros((2, 25))))
    found = fit(given)
    judgement = judge(given, found)
    path = save(given, found, judgement, tmp_path, date(2020, 2, 3))
    stored = tomllib.loads(path.read_text())
    assert stored["date"] == date(2020, 2, 3)
    assert stored["name"] == "suspension"
    assert "identify.toml" in stored["origin"]
    assert stored["estimates"]["damping"]["standard_error"] == pytest.approx(judgement.standard_errors[1])
    (tmp_path / "use.toml").write_text('identified = "suspension.toml"\n' + STUDY)
    assert run_study(tmp_path / "use.toml").metadata["parameter k_s"] == found.x[0]
    own = 'identified = "suspension.toml"\n' + STUDY + "[parameters]\nk_s = 9e3\n"
    (tmp_path / "own.toml").write_text(own)  # the study's own value wins
    assert run_study(tmp_path / "own.toml").metadata["parameter k_s"] == 9e3
    (tmp_path / "none.toml").write_text('identified = "nowhere.toml"\n' + STUDY)
    with pytest.raises(StudyError, match=r"line 1: identified: there is no file .*nowhere.toml"):
        run_study(tmp_path / "none.toml")
    assert draw(given, found, tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")
    assert [each.at_bound for each in estimates(given, found, judgement)] == ["", ""]


WRONG = {
    "unknown key": (HEAD.replace("upper = 60000", "uper = 60000"), "unknowns.stiffness.uper: unknown key 'uper'"),
    "out of order": (HEAD.replace("lower = 5000", "lower = 30000"), "expected lower <= start <= upper"),
    "no such parameter": (HEAD.replace("parameters.k_s", "parameters.k_z"), "unknown parameter 'k_z'"),
    "no such table": (HEAD.replace("parameters.k_s", "parameter.k_s"), "unknown table 'parameter'"),
    "no such input": (HEAD.replace("parameters.k_s", "inputs.z_q.peak"), "unknown input key 'inputs.z_q.peak'"),
    "no such input key": (HEAD.replace("parameters.k_s", "inputs.z_r.peek"), "inputs.z_r"),
    "no study": (HEAD.replace("study.toml", "stuy.toml"), "there is no such file"),
    "no TOML": ("title = ", "no valid TOML"),
}


@pytest.mark.parametrize("case", WRONG)
def test_slips_are_named_with_their_place(tmp_path, case):
    text, message = WRONG[case]
    with pytest.raises(StudyError) as refused:
        fit(problem(tmp_path, text + scenario([curve(np.zeros(25))])))
    assert message in str(refused.value)
    assert str(tmp_path) in str(refused.value)


@pytest.mark.parametrize(
    ("observation", "message"),
    [
        ('quantity = "z_q"\nsigma = 1\nvalue = 1', "unknown quantity 'z_q'"),
        ('quantity = "z_s"\nsigma = 0\nvalue = 1', "sigma"),
        ('quantity = "z_s"\nsigma = 1', "expected either value, or t and values, or file"),
        (
            'quantity = "z_s"\nsigma = 1\nvalue = 1\nfile = "curve.csv"',
            "expected either value, or t and values, or file",
        ),
        ('quantity = "z_s"\nsigma = 1\nfile = "none.csv"', "scenarios.0.observations.0.file: there is no file"),
        ('quantity = "z_q"\nsigma = 1\nfile = "curve.csv"', "observations.0.quantity: unknown quantity 'z_q'"),
        ('quantity = "z_s"\nsigma = 1\nfile = "curve.csv"\ncolumns = ["t", "z"]', "curve.csv: unknown column 'z'"),
        ('quantity = "z_s"\nsigma = 1\nfile = "curve.csv"', "curve.csv, line 4: time 0.15 is before"),
        ('quantity = "zdot_s"\nsigma = 1\nfile = "curve.csv"', "column 'z_s': [mm] cannot be turned into [m/s]"),
        ('quantity = "z_s"\nsigma = 1\nvalue = 1\nmeasure = "at"', "`at` is a time"),
        ('quantity = "z_s"\nsigma = 1\nvalue = 1\nmeasure = "top"', "measure"),
        ('quantity = "z_s"\nsigma = 1\nt = [0.1, 9.0]\nvalues = [0, 0]', "observed from 0.1 to 9 s, run from 0 to 1.5"),
    ],
)
def test_observations_that_cannot_be_are_refused(tmp_path, observation, message):
    (tmp_path / "curve.csv").write_text("t [s],z_s [mm]\n0.1,0\n0.2,1\n0.15,2\n")
    with pytest.raises(StudyError) as refused:
        fit(problem(tmp_path, HEAD + scenario([observation])))
    assert message in str(refused.value)


def test_the_papers_five_displacements(tmp_path):
    """With the printed damping no pulse and arm meet all five; the file in studies/paper is what the command writes."""
    done = command("identify", "studies/paper/identify_recoil.toml", "--json", "--into", tmp_path)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert not said["fits"]
    stored = tomllib.loads((PAPER / "identified" / "recoil.toml").read_text())
    written = tomllib.loads((tmp_path / "recoil.toml").read_text())
    assert written["values"] == pytest.approx(stored["values"], rel=1e-3)
    assert written["chi_squared"] == pytest.approx(stored["chi_squared"], rel=1e-3)
