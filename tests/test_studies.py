"""Studies: what a file says is what is run, and every slip is named with its place and what is valid there."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from study_files import assert_refused, slip, write

from qddot.runner.inputs.shapes import pulse_train
from qddot.runner.load import load
from qddot.runner.simulate import simulate
from qddot.runner.study.read import StudyError, read
from qddot.runner.study.ready import run_study
from qddot.runner.study.units import magnitude

GOOD = """\
model = "quarter_car"
span = [0, 0.2]

[integration]
method = "rk4"
step = 1e-3

[parameters]
m_s = 250

[inputs.z_r]
kind = "pulse_train"
times = [0.05]
peak = 0.02
duration = 0.1
"""

BAD = {
    "no TOML": ("model = ", "no valid TOML"),
    "twice": ("model = 'a'\nmodel = 'b'\n", "no valid TOML: Cannot overwrite a value (at line 2"),
    "unknown key": (slip(GOOD, "span", "spam"), "line 2: spam: unknown key 'spam'; did you mean 'span'?"),
    "unknown key in a table": (
        slip(GOOD, "step = 1e-3", "setp = 1e-3"),
        "line 6: integration.setp: unknown key 'setp'; did you mean 'step'?",
    ),
    "unknown key of an input": (
        slip(GOOD, "duration", "durration"),
        "line 15: inputs.z_r.durration: unknown key 'durration'; did you mean 'duration'?",
    ),
    "key of another kind": (
        slip(GOOD, "peak = 0.02", "amplitude = 0.02"),
        "line 14: inputs.z_r.amplitude: unknown key 'amplitude'",
    ),
    "no model": (slip(GOOD, 'model = "quarter_car"', ""), "model: missing"),
    "no kind": (slip(GOOD, 'kind = "pulse_train"', ""), "inputs.z_r: missing kind; there are: constant, sine"),
    "unknown kind": (
        slip(GOOD, '"pulse_train"', '"pulses"'),
        "line 11: inputs.z_r.kind: unknown kind 'pulses'; did you mean 'pulse_train'?",
    ),
    "wrong type": (
        slip(GOOD, "[0, 0.2]", '"all of it"'),
        "line 2: span: found 'all of it', expected start and end, such as [0, 10]",
    ),
    "one end": (
        slip(GOOD, "[0, 0.2]", "[0]"),
        "line 2: span.1: missing; found [0], expected start and end, such as [0, 10]",
    ),
    "unknown model": (slip(GOOD, '"quarter_car"', '"quater_car"'), "model 'quater_car'; did you mean 'quarter_car'?"),
    "missing module": (slip(GOOD, '"quarter_car"', '"out/mine.py"'), "line 1: model: no file"),
    "unknown input": (slip(GOOD, "z_r", "z_q"), "line 11: inputs.z_q: unknown input 'z_q'; did you mean 'z_r'?"),
    "rate as an input": (slip(GOOD, "inputs.z_r", "inputs.zdot_r"), "unknown input 'zdot_r'; did you mean 'z_r'?"),
    "unknown parameter": (
        slip(GOOD, "m_s = 250", "m_z = 250"),
        "line 9: parameters.m_z: unknown parameter 'm_z'",
    ),
    "wrong unit": (
        slip(GOOD, "m_s = 250", 'm_s = "250 m"'),
        "line 9: parameters.m_s: '250 m' is in m, expected kg or a multiple of it",
    ),
    "no unit": (
        slip(GOOD, "m_s = 250", 'm_s = "250"'),
        "line 9: parameters.m_s: '250' has no unit; expected one such as kg, or a plain number in kg",
    ),
    "unknown unit": (
        slip(GOOD, "m_s = 250", 'm_s = "250 kgg"'),
        "line 9: parameters.m_s: '250 kgg' is no number with a unit",
    ),
    "code as a number": (
        slip(GOOD, "m_s = 250", "m_s = \"__import__('os').getcwd()\""),
        "line 9: parameters.m_s: \"__import__('os').getcwd()\" is no number with a unit",
    ),
    "not finite": (slip(GOOD, "m_s = 250", "m_s = nan"), "parameters.m_s is nan, expected a finite number"),
    "no mass": (slip(GOOD, "m_s = 250", "m_s = 0"), "constant inverse_m_s is inf; zero: m_s"),
    "time as a length": (
        slip(GOOD, "step = 1e-3", 'step = "1 mm"'),
        "line 6: integration.step: '1 mm' is in mm, expected s or a multiple of it",
    ),
    "impulse of another kind": (
        slip(GOOD, "peak = 0.02", 'impulse = "3 N s"'),
        "line 14: inputs.z_r.impulse: '3 N s' is in N s, expected m * s or a multiple of it",
    ),
    "too many of three": (GOOD + "impulse = 1.0\n", "inputs.z_r: "),
    "negative duration": (slip(GOOD, "duration = 0.1", "duration = -0.1"), "inputs.z_r: duration"),
    "unknown method": (slip(GOOD, '"rk4"', '"rk5"'), "unknown method 'rk5'; did you mean 'rk4'?"),
    "no step": (slip(GOOD, "step = 1e-3", ""), "step"),
    "negative step": (slip(GOOD, "1e-3", "-1e-3"), "step is -0.001, expected a number greater than 0"),
    "backwards": (slip(GOOD, "[0, 0.2]", "[1, 0]"), "expected a start before the end"),
    "unknown set": ('parameter_set = "heavy"\n' + GOOD, "unknown parameter set 'heavy'"),
    "unknown state": (
        GOOD + "[initial]\nzz_s = 1\n",
        "line 17: initial.zz_s: unknown state 'zz_s'; did you mean 'z_s'?",
    ),
    "bad start": ('initial = "rest"\n' + GOOD, "line 1: initial"),
    "table without a file": (
        GOOD.split("[inputs")[0] + '[inputs.z_r]\nkind = "table"\nfile = "road.csv"\n',
        "line 13: inputs.z_r.file: there is no file",
    ),
    "table of both": (
        GOOD.split("[inputs")[0] + '[inputs.z_r]\nkind = "table"\nfile = "r.csv"\nt = [0, 1]\nvalues = [0, 1]\n',
        "inputs.z_r: give either file, or t and values",
    ),
    "table out of order": (
        GOOD.split("[inputs")[0] + '[inputs.z_r]\nkind = "table"\nt = [0, 2, 1]\nvalues = [0, 1, 2]\n',
        "inputs.z_r: sample 2",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_study_is_refused_with_its_place(tmp_path, case):
    text, message = BAD[case]
    assert_refused(run_study, write(tmp_path, text), message)


def test_a_missing_file_names_its_neighbours(tmp_path):
    write(tmp_path, GOOD)
    with pytest.raises(StudyError, match=r"there is no such file; .* did you mean 'study.toml'"):
        read(tmp_path / "stuy.toml")
    with pytest.raises(StudyError, match="no folder"):
        read(tmp_path / "none" / "study.toml")


def test_a_study_runs_what_it_says(tmp_path):
    found = run_study(write(tmp_path, GOOD))
    road = pulse_train(times=[0.05], peak=0.02, duration=0.1)
    expected = simulate(load("quarter_car"), (0, 0.2), step=1e-3, parameters={"m_s": 250.0}, inputs={"z_r": road})
    assert np.array_equal(found.t, expected.t)
    assert np.array_equal(found.values, expected.values)
    assert np.abs(found["z_s"]).max() > 1e-3


def test_units_mean_what_they_say(tmp_path):
    text = GOOD.replace("m_s = 250", 'm_s = "0.25 t"').replace("peak = 0.02", 'peak = "2 cm"')
    text = text.replace("duration = 0.1", 'duration = "100 ms"').replace("[0.05]", '["50 ms"]')
    with_units = run_study(write(tmp_path, text))
    plain = run_study(write(tmp_path, GOOD))
    assert with_units.values == pytest.approx(plain.values, rel=1e-12, abs=1e-15)


def test_a_csv_file_beside_the_study_is_an_input(tmp_path):
    (tmp_path / "road.csv").write_text("time [ms];height [cm]\n0;0\n100;2,5\n200;0\n")
    text = GOOD.split("[inputs")[0] + '[inputs.z_r]\nkind = "table"\nfile = "road.csv"\n'
    solution = run_study(write(tmp_path, text))
    assert solution["z_r"].max() == pytest.approx(0.025)
    assert solution.t[np.argmax(solution["z_r"])] == pytest.approx(0.1)


@given(st.floats(-1e6, 1e6), st.sampled_from([("N", 1.0), ("kN", 1e3), ("mN", 1e-3), ("kg m/s^2", 1.0)]))
def test_amounts_with_units_are_converted(value, unit):
    name, factor = unit
    assert magnitude("here", f"{value!r} {name}", "N") == pytest.approx(value * factor)
    assert magnitude("here", value, "N") == value
