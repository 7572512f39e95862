"""`qddot run --watch` runs again when the study, its model or a file that it names changes, and ends with a word."""

import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from qddot import origin
from qddot.runner.commands.watch import stamps, watch

STUDY = """model = "quarter_car"
span = [0, 0.1]

[integration]
step = 1e-3

[inputs.z_r]
kind = "table"
file = "road.csv"
"""


@pytest.fixture
def study(tmp_path):
    (tmp_path / "road.csv").write_text("t,z\n0,0\n1,0.01\n")
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path / "study.toml"


def until(process, word, patience=180.0):
    """What a process says, to the first time it says a word."""
    said, end = b"", time.monotonic() + patience
    while word.encode() not in said:
        assert time.monotonic() < end, said.decode()
        if select.select([process.stdout], [], [], 1.0)[0]:
            more = os.read(process.stdout.fileno(), 65536)
            assert more, said.decode()
            said += more
    return said.decode()


@pytest.fixture
def heeded():
    """Processes that are started heed Ctrl-C; those of tests in the background of a shell would not."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heeded")
def test_a_change_of_the_study_runs_it_again_and_ctrl_c_ends_it(study):
    command = [sys.executable, "-m", "qddot", "run", "study.toml", "--watch", "--no-figure", "--set", "span=[0,0.2]"]
    with subprocess.Popen(
        command,
        cwd=study.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as process:
        try:
            first = until(process, "Ctrl-C ends it")
            assert "201 points" in first and "wrote results/study_set" in first
            assert "watching study.toml, road.csv, " in first
            study.write_text(STUDY.replace("quarter_car", "quarter_kar"))
            wrong = until(process, "Ctrl-C ends it")
            assert "study.toml changed" in wrong and "error: " in wrong and "quarter_car" in wrong
            os.killpg(process.pid, signal.SIGINT)
            assert "no longer watching" in until(process, "no longer watching")
            assert process.wait(30) == 0
        finally:
            process.kill()


def test_the_files_watched_are_the_study_its_model_with_what_that_imports_and_what_it_names(study):
    folder = study.parent
    assert set(stamps(study)) == {study, folder / "road.csv", origin.model_file("quarter_car")}
    (folder / "mine.py").write_text("import other\n\ndef system():\n    return other.it\n")
    (folder / "other.py").write_text("it = 1\n")
    study.write_text(STUDY.replace('"quarter_car"', '"mine.py"'))
    assert set(stamps(study)) == {study, folder / "road.csv", folder / "mine.py", folder / "other.py"}
    (folder / "other.py").unlink()
    assert folder / "mine.py" in stamps(study)
    study.write_text("half = [")
    assert set(stamps(study)) == {study}
    study.unlink()
    assert stamps(study) == {study: None}


def test_what_is_not_there_is_not_watched(tmp_path):
    with pytest.raises(ValueError, match="there is no such file to watch"):
        watch(tmp_path / "none.toml", [])
    assert origin.model_file("nothing") is None and origin.model_file("../x") is None


def test_a_generated_module_is_watched_with_the_model_it_was_made_of(study):
    module = Path(origin.__file__).parent.parent / "generated" / "pendulum.py"
    study.write_text(f'model = "{module.as_posix()}"\nspan = [0, 1]\n')
    assert set(stamps(study)) == {study, module, origin.model_file("pendulum")}
