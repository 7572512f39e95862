"""Whatever stands in a study file ends at once in a study, or in lines of our own with file, line and key."""

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from promptness import within
from study_files import assert_refused, slip, write
from test_studies import GOOD

from qddot.runner.batch.job import read_job
from qddot.runner.identify.problem import read as read_identification
from qddot.runner.study.overrides import parsed
from qddot.runner.study.read import StudyError, read
from qddot.runner.study.ready import run_study
from qddot.runner.study.schema import StudyTable

PENDULUM = """\
model = "pendulum"
span = [0, 0.01]

[integration]
step = 1e-3
"""
INITIAL = GOOD + "[initial]\n"
METRIC = '[metrics.a]\nkind = "max"\nof = "z_s"\n'
SWEEP = GOOD + "[[sweep.axes]]\n"

WRONG = {
    "a number as a span": (slip(GOOD, "[0, 0.2]", "20"), "line 2: span: found 20, expected start and end, such as"),
    "three ends": (slip(GOOD, "[0, 0.2]", "[0, 1, 2]"), "line 2: span: found [0, 1, 2], expected start and end"),
    "a truth as an end": (
        slip(GOOD, "[0, 0.2]", "[false, 1]"),
        'line 2: span.0: found false, expected a number, or a text with a unit such as "2.5 kg"',
    ),
    "a truth as a mass": (
        slip(GOOD, "m_s = 250", "m_s = true"),
        'line 9: parameters.m_s: found true, expected a number, or a text with a unit such as "2.5 kg"',
    ),
    "a list as a mass": (
        slip(GOOD, "m_s = 250", "m_s = [250]"),
        'line 9: parameters.m_s: found [250], expected a number, or a text with a unit such as "2.5 kg"',
    ),
    "a date as a mass": (slip(GOOD, "m_s = 250", "m_s = 1979-05-27"), "line 9: parameters.m_s: found "),
    "a number as a table": (
        GOOD + "[figure]\npanels = 3\n",
        "line 17: figure.panels: found 3, expected a list, of each",
    ),
    "a number as an input": (GOOD.split("[inputs")[0] + "[inputs]\nz_r = 3\n", "line 12: inputs.z_r: found 3"),
    "a number as inputs": (
        "inputs = 3\n" + PENDULUM,
        "line 1: inputs: found 3, expected a table, of each name a table",
    ),
    "a number as a model": (slip(GOOD, '"quarter_car"', "3"), "line 1: model: found 3, expected a text"),
    "a truth as a count": (
        slip(GOOD, "step = 1e-3", "step = 1e-3\nevery = true"),
        "line 7: integration.every: found true, expected a whole number",
    ),
    "a text as a count": (
        slip(GOOD, "step = 1e-3", 'step = 1e-3\nevery = "3"'),
        "line 7: integration.every: found '3', expected a whole number",
    ),
    "a number as a truth": (
        slip(GOOD, "step = 1e-3", "step = 1e-3\nbdf = 3"),
        "line 7: integration.bdf: found 3, expected true or false",
    ),
    "a start that is none": ('initial = "rest"\n' + GOOD, "line 1: initial: found 'rest', expected \"equilibrium\""),
    "a start with a list": (INITIAL + "z_s = [1]\n", "line 17: initial.z_s: found [1], expected a number, or a text"),
    "half a pair": (
        SWEEP + 'key = "parameters.m_s"\nuniform = [1]\n',
        "line 18: sweep.axes.0.uniform.1: missing; found",
    ),
    "a long title": (f'title = "{"a" * 301}"\n' + GOOD, "line 1: title: found 301 characters, expected at most 300"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_one_line_of_file_line_key_found_and_expected(tmp_path, case):
    text, message = WRONG[case]
    with pytest.raises(StudyError) as refused:
        read(write(tmp_path, text))
    said = str(refused.value)
    assert said.startswith(f"{tmp_path}/study.toml, ")
    assert message in said
    assert "\n" not in said
    assert not any(word in said for word in ("Input should", "input should", "pydantic", "valid tuple", "type="))


UNITS = {
    "a comma": ("12,5 kg", "'12,5 kg' is no number with a unit: it has a comma; write \"12.5 kg\""),
    "a blank": (
        "10 000 kg",
        "'10 000 kg' is no number with a unit: it has something between its digits; write \"10000 kg\"",
    ),
    "two numbers": ("2 3 kg", "'2 3 kg' is no number with a unit: it has two numbers one behind the other"),
    "ton": ("1 ton", "'1 ton' is no number with a unit: 'ton' means several things; write t (1000 kg), short_ton"),
    "kgg": ("250 kgg", "'250 kgg' is no number with a unit: unknown unit 'kgg'; did you mean 'kg'?"),
}


@pytest.mark.parametrize("case", UNITS)
def test_a_slip_in_an_amount_is_told_with_its_place_in_files_and_settings(tmp_path, case):
    text, message = UNITS[case]
    path = write(tmp_path, slip(GOOD, "m_s = 250", f'm_s = "{text}"'))
    assert_refused(run_study, path, f"line 9: parameters.m_s: {message}")
    path = write(tmp_path, GOOD)
    changes = parsed([f"parameters.m_s={text}"])
    assert_refused(lambda path: run_study(path, changes=changes), path, f"parameters.m_s: {message}")
    with_axis = f'{SWEEP}key = "parameters.m_s"\nlinspace = ["{text}", "400 kg", 3]\n' + METRIC
    assert_refused(read_job, write(tmp_path, with_axis), f"line 18: sweep.axes.0.linspace: {message}")


ATTACKS = {
    "brackets": ("title = " + "[" * 100_000, "no valid TOML: brackets are nested too deeply"),
    "tables in tables": ("title = " + "{a=" * 80_000, "no valid TOML: brackets are nested too deeply"),
    "a title": (f'title = "{"a" * 10_000_000}"\n' + GOOD, "longer than 262144 bytes; put long curves into CSV files"),
    "a shorter title": (
        f'title = "{"a" * 200_000}"\n' + GOOD,
        "line 1: title: found 200000 characters, expected",
    ),
    "a dotted key": ("a" + ".a" * 100_000 + " = 1\n" + GOOD, "no valid TOML: a key of more than 16 parts (at line 1)"),
    "a dotted header": (GOOD + "[a" + " . 'a'" * 40_000 + "]\n", "a key of more than 16 parts (at line 16)"),
    "a whole number": (slip(GOOD, "250", "9" * 5000), "no valid TOML: Exceeds the limit"),
    "a hexadecimal number": (slip(GOOD, "250", "0x" + "f" * 100_000), "parameters.m_s"),
    "a long name": (slip(GOOD, "m_s = 250", "a" * 100_000 + " = 1"), "unknown parameter 'aaaa"),
    "many unknown keys": (PENDULUM + "".join(f"k{i} = 1\n" for i in range(10_000)), ": and more"),
    "many axes": (
        GOOD + "[[sweep.axes]]\nkey = 'parameters.m_s'\nrange = [0, 2]\n" * 1001,
        "found 1001, expected at most",
    ),
    "a blank line": (slip(GOOD, "m_s = 250", "m_z = 250") + " " * 100_000, "parameters.m_z"),
    "a tower": (slip(GOOD, "m_s = 250", 'm_s = "9**(99*99*99*99) kg"'), "parameters.m_s: '9**(99*99*99*99) kg' is no"),
    "a long unit": (slip(GOOD, "m_s = 250", f'm_s = "1 {"*s" * 2000}"'), "it is 4002 characters long, at most 120"),
}


@pytest.mark.parametrize("case", ATTACKS)
def test_an_attack_is_refused_at_once_in_few_words(tmp_path, case):
    text, message = ATTACKS[case]
    path = write(tmp_path, text)
    with within(2.0), pytest.raises(StudyError) as refused:
        run_study(path)
    assert str(refused.value).startswith(str(path))
    assert message in str(refused.value)
    assert max(map(len, str(refused.value).splitlines())) < 2000


def test_a_setting_of_many_brackets_is_refused(tmp_path):
    path = write(tmp_path, GOOD)
    with pytest.raises(StudyError, match=r"parameters\.m_s: '\[\[.*' is no number with a unit"):
        run_study(path, changes=parsed(["parameters.m_s=" + "[" * 100_000]))


def test_a_setting_of_several_lines_is_one_text():
    assert parsed(["parameters.m_s=1\nspan = 3"]) == {"parameters.m_s": "1\nspan = 3"}


def test_identifications_are_told_in_the_same_words(tmp_path):
    text = 'title = "t"\nname = "n"\nstudy = "s.toml"\n[unknowns.a]\nkey = "parameters.a"\nstart = "1"\n'
    text += "lower = 0\nupper = 2\n"
    text += '[[scenarios]]\nname = "one"\n[[scenarios.observations]]\nquantity = "x"\nsigma = 0\nvalue = 1\n'
    with pytest.raises(StudyError) as refused:
        read_identification(write(tmp_path, text))
    lines = str(refused.value).splitlines()
    assert lines[0].endswith("study.toml, line 6: unknowns.a.start: found '1', expected a number")
    assert lines[1].endswith(": scenarios.0.observations.0.sigma: found 0, expected a number greater than 0.0")
    assert len(lines) == 2


def test_the_search_for_the_equilibrium_starts_at_the_study_s_guess(tmp_path):
    hanging = run_study(write(tmp_path, PENDULUM))
    assert hanging["theta_1"][0] == 0.0
    text = PENDULUM + '[equilibrium_guess]\ntheta_1 = "170 deg"\ntheta_2 = 3\ntheta_3 = 3.2\n'
    upright = run_study(write(tmp_path, text))
    for name in ("theta_1", "theta_2", "theta_3"):
        assert upright[name] == pytest.approx(np.full(len(upright.t), math.pi), abs=1e-9)
    for wrong, message in {
        "[equilibrium_guess]\nthetadot_1 = 1\n": "line 7: equilibrium_guess.thetadot_1: unknown coordinate",
        '[equilibrium_guess]\ntheta_1 = "1 m"\n': "line 7: equilibrium_guess.theta_1: '1 m' is in m, expected rad",
        "[initial]\ntheta_1 = 1\n[equilibrium_guess]\ntheta_1 = 1\n": "line 8: equilibrium_guess: the study gives",
    }.items():
        assert_refused(run_study, write(tmp_path, PENDULUM + wrong), message)


def test_a_sweep_may_vary_the_guess(tmp_path):
    text = PENDULUM + "".join(
        f'[[sweep.axes]]\nkey = "equilibrium_guess.theta_{i}"\nvalues = [0, 3.1]\nzip = "one"\n' for i in (1, 2, 3)
    )
    job = read_job(write(tmp_path, text + '[metrics.a]\nkind = "max"\nof = "theta_1"\n'))
    starts = [job.prepared(run).simulation.problem.initial_state[0] for run in range(2)]
    assert starts == pytest.approx([0.0, math.pi])


pieces = st.sampled_from(
    [
        *"[]{}=.,\"'#\n 0123456789ab_-+",
        '"""',
        "nan",
        "true",
        "[[",
        "]]",
        "1e400",
        "span",
        "\\",
        "é",
        "\t",
        "12,5 N",
        "model",
    ]
)


@given(st.lists(st.tuples(st.floats(0, 1), st.integers(0, 12), pieces), min_size=1, max_size=4))
@settings(deadline=None, max_examples=400)
def test_a_study_with_damage_is_a_study_or_is_refused_in_our_words(damage):
    text = GOOD
    for place, length, piece in damage:
        at = int(place * len(text))
        text = text[:at] + piece + text[at + length :]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(text, encoding="utf-8")
        try:
            assert isinstance(read(path), StudyTable)
        except StudyError as error:
            for line in str(error).splitlines():
                assert line.startswith(str(path))
                assert "nput should" not in line
