"""Places that cannot be written or must not be trusted: code goes elsewhere, results are refused in one line."""

import os
import shutil
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import netCDF4
import numpy as np
import pytest
from commands import ROOT, plainly
from study_files import write

from qddot.runner.files import named, ready, written_aside
from qddot.runner.machine import places
from qddot.runner.machine.kept import Cache
from qddot.runner.problem import Statistics, Status
from qddot.runner.solution import Solution
from qddot.runner.tables import Quantity

#: Where code is kept whose own folder cannot be written.
FOLDER = """
import sys, tempfile
from pathlib import Path
from qddot.runner.machine.places import code_folder
if "nowhere" in sys.argv: tempfile.gettempdir = lambda: str(Path.cwd())
print(code_folder(Path(sys.argv[1])))
"""


@pytest.fixture
def shut(tmp_path):
    """A folder that cannot be written."""
    folder = tmp_path / "shut"
    folder.mkdir()
    folder.chmod(0o555)
    yield folder
    folder.chmod(0o755)


@pytest.fixture
def temporary(tmp_path):
    folder = tmp_path / "temporary"
    folder.mkdir()
    return folder


@pytest.fixture
def elsewhere(shut, temporary):
    """An environment whose home cannot be written."""
    return {"HOME": shut, "XDG_CACHE_HOME": "", "TMPDIR": temporary, "NUMBA_CACHE_DIR": ""}


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_code_is_kept_beside_its_source_where_that_can_be_written(tmp_path, elsewhere):
    done = plainly(tmp_path / "own", code=FOLDER, **elsewhere)
    assert (done.stdout.strip(), done.stderr) == (str(tmp_path / "own"), "")


def test_code_of_a_folder_that_cannot_be_written_goes_to_the_users_cache(shut, tmp_path, elsewhere):
    cache = tmp_path / "cache"
    done = plainly(shut / "own", code=FOLDER, **elsewhere | {"XDG_CACHE_HOME": cache})
    assert (done.stdout.strip(), done.stderr) == (str(cache / "qddot"), "")
    assert mode(cache / "qddot") == 0o700


def test_without_a_home_it_goes_to_a_folder_of_the_user_in_the_temporary_one(shut, temporary, elsewhere):
    own = temporary / f"qddot-{os.geteuid()}"
    for _ in range(2):  # made, then found again
        done = plainly(shut / "own", code=FOLDER, **elsewhere)
        assert (done.stdout.strip(), done.stderr) == (str(own), "")
        assert mode(own) == 0o700


@pytest.mark.parametrize("what", ["link", "open", "file", "readable"])
def test_a_folder_that_somebody_else_may_have_laid_there_is_not_trusted(shut, temporary, elsewhere, what):
    own, trap = temporary / f"qddot-{os.geteuid()}", temporary / "trap"
    trap.mkdir(0o700)
    if what == "link":
        own.symlink_to(trap)
    elif what == "file":
        own.write_text("")
    else:
        own.mkdir()
        own.chmod(0o777 if what == "open" else 0o755)
    done = plainly(shut / "own", code=FOLDER, **elsewhere)
    used = Path(done.stdout.strip())
    assert used.parent == temporary
    assert used not in (own, trap)
    said = {"link": "is a link", "open": "mode 777", "file": "is no folder", "readable": "mode 755"}[what]
    assert done.stderr.count("\n") == 1
    assert f"note: {own} " in done.stderr and said in done.stderr and str(used) in done.stderr
    assert not used.exists()  # it went with its process
    assert not list(trap.iterdir())


def test_a_folder_of_another_user_is_not_trusted(tmp_path, monkeypatch):
    folder = tmp_path / "qddot"
    folder.mkdir(0o700)
    assert places._unsafe(folder, 0o077) == ""
    monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)
    assert "belongs to another user" in places._unsafe(folder, 0o077)


def test_where_nothing_can_be_written_one_line_says_so(shut, elsewhere):
    done = plainly(shut / "own", "nowhere", code=FOLDER, cwd=shut, **elsewhere)
    assert done.stdout.strip() == "None"
    assert done.stderr.count("\n") == 1
    assert "no folder for compiled code can be written: every process compiles anew; NUMBA_CACHE_DIR" in done.stderr


def test_numbas_own_variable_names_the_folder_and_is_never_ignored_silently(shut, tmp_path, elsewhere):
    wanted = tmp_path / "wanted"
    done = plainly(shut / "own", code=FOLDER, **elsewhere | {"NUMBA_CACHE_DIR": wanted})
    assert (done.stdout.strip(), done.stderr) == (str(wanted), "")
    done = plainly(tmp_path / "own", code=FOLDER, **elsewhere | {"NUMBA_CACHE_DIR": shut / "no"})
    assert done.stdout.strip() == str(tmp_path / "own")
    assert f"NUMBA_CACHE_DIR={shut / 'no'} cannot be written" in done.stderr


#: Loads a generated module and evaluates a kernel of it.
LOAD = """
import sys, tempfile
from pathlib import Path
if "nowhere" in sys.argv: tempfile.gettempdir = lambda: str(Path.cwd())
import numpy as np
from qddot.runner.load import load
model = load(Path(sys.argv[1]))
print(np.isfinite(model.constants(model.parameter_values())).all())
"""


def test_a_model_in_a_folder_that_cannot_be_written_is_compiled_once_and_kept(shut, temporary, elsewhere):
    """Numba alone raises "cannot cache function: no locator available", when the module is imported."""
    shut.chmod(0o755)
    shutil.copy(ROOT / "generated" / "pendulum.py", shut)
    shut.chmod(0o555)
    found = []
    for _ in range(2):
        done = plainly(shut / "pendulum.py", code=LOAD, **elsewhere)
        assert done.returncode == 0, done.stderr
        assert "note" not in done.stderr
        found.append(done.stdout)
    assert found == ["True\n", "True\n"]
    kept = temporary / f"qddot-{os.geteuid()}"
    assert list(kept.glob("qddot-*/shut_*/pendulum.constants-*.nbc"))
    done = plainly(shut / "pendulum.py", "nowhere", code=LOAD, cwd=shut, **elsewhere)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("True")
    assert "every process compiles anew" in done.stderr


def test_a_cache_that_was_cut_short_is_made_again(tmp_path, elsewhere):
    shutil.copy(ROOT / "generated" / "pendulum.py", tmp_path)
    path = tmp_path / "pendulum.py"
    assert plainly(path, code=LOAD, **elsewhere).returncode == 0
    indices = list((tmp_path / "__pycache__").rglob("pendulum.constants-*.nbi"))
    assert indices
    for index in indices:
        index.write_bytes(index.read_bytes()[:-20])
    done = plainly(path, code=LOAD, **elsewhere)
    assert (done.returncode, done.stdout) == (0, "True\n"), done.stderr
    assert plainly(path, code=LOAD, **elsewhere).returncode == 0


def test_compiled_code_that_a_full_disk_does_not_take_is_used_all_the_same(monkeypatch, capfd):
    from numba.core.caching import FunctionCache

    def full(self, sig, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(FunctionCache, "save_overload", full)
    cache = Cache.__new__(Cache)
    cache._cache_path = "/somewhere"
    compiled = SimpleNamespace(_replace=lambda **_: None)
    cache.save_overload(None, compiled)
    cache.save_overload(None, compiled)
    assert capfd.readouterr().err == "note: compiled code is not kept in /somewhere: No space left on device\n"


def solution(points=20_000):
    t = np.linspace(0.0, 1.0, points)
    columns = tuple(Quantity(name, "m", name) for name in ("x", "xdot"))
    counts = Statistics(steps=points, evaluations=points)
    return Solution(
        t,
        np.column_stack([np.sin(t), np.cos(t)]),
        np.empty((len(t), 0)),
        columns,
        2,
        0,
        Status.FINISHED,
        "",
        counts,
        {},
    )


#: A process that may write files of 20 kB, as on a disk that is full: real failing writes.
LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sys.path.insert(0, "tests")
"""


def test_a_disk_that_is_full_leaves_the_old_file_and_nothing_half_written(tmp_path):
    path = solution(10).save(tmp_path / "run.nc")
    before = path.read_bytes()
    code = LIMITED + (
        "from test_trust_places import solution\n"
        "import netCDF4\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))\n"
        "try: solution().save(sys.argv[1])\n"
        "except OSError as error: print('refused', error.filename, error.strerror)\n"
    )
    done = plainly(path, code=code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"refused {path} could not be written")
    assert "MB are free" in done.stdout
    assert done.stderr == ""
    assert path.read_bytes() == before
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


STUDY = """\
title = "A quick run"
model = "quarter_car"
span = [0, 0.5]
integration = { method = "rk4", step = 1e-3 }
inputs.z_r = { kind = "pulse_train", times = [0.05], peak = 0.02, duration = 0.1 }

[[sweep.axes]]
key = "parameters.m_s"
values = [200.0, 300.0]
"""


def test_a_run_on_a_full_disk_ends_in_one_line(tmp_path):
    study = write(tmp_path, STUDY, "quick.toml")
    assert plainly("run", study, "--into", tmp_path / "warm", cwd=tmp_path).returncode == 0  # compiled, and kept
    code = LIMITED + (
        "from qddot.command_line import main\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, resource.RLIM_INFINITY))\nmain()\n"
    )
    done = plainly("run", study, "--set", "span=[0, 2]", code=code, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("note: the study's own values, without its sweep")
    assert "error: results/quick_row=base_set=span=-0-2-_" in done.stderr
    assert "Traceback" not in done.stderr
    assert not list((tmp_path / "results").iterdir())


def test_results_that_cannot_be_written_are_refused_before_anything_is_computed(tmp_path, shut, monkeypatch):
    from qddot.runner.commands.run import run

    monkeypatch.setattr("qddot.runner.study.ready.Study.run", lambda *_, **__: pytest.fail("it ran"))
    study = write(tmp_path, STUDY, "quick.toml")
    (tmp_path / "file").write_text("")
    (tmp_path / "results" / "quick_row=1.nc").mkdir(parents=True)
    for into, message in (("file", "is a file; expected a folder"), ("file/below", "is a file; expected a folder")):
        with pytest.raises(NotADirectoryError, match=message) as refused:
            run(study, tmp_path / into, None, [], None)
        assert refused.value.filename == str(tmp_path / "file")
    with pytest.raises(IsADirectoryError, match="is a folder; expected the name of a file"):
        run(study, tmp_path / "results", None, [], 1)
    done = plainly("run", study, "--into", shut / "results", "--no-figure", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == f"error: {shut / 'results'}: permission denied"
    done = plainly("run", study, "--into", shut, "--no-figure", cwd=tmp_path)
    assert done.stderr.splitlines()[-1] == f"error: {shut}: no file can be written into this folder"


def test_what_is_no_ordinary_file_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    for write_to in (ready, lambda path: written_aside(path).__enter__()):
        with pytest.raises(OSError, match="is no ordinary file"):
            write_to(tmp_path / "pipe.csv")
    assert [each.name for each in tmp_path.iterdir()] == ["pipe.csv"]


def test_a_file_of_one_name_written_by_many_at_once_is_that_of_one_of_them(tmp_path):
    path, sizes = tmp_path / "run.nc", range(100, 116)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda size: _written(path, size), sizes))
    assert path.read_text() in {_text(size) for size in sizes}
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


def _text(size):
    return str(size) * 10_000


def _written(path, size):
    with written_aside(path) as aside:
        aside.write_text(_text(size))


def test_two_processes_save_one_result(tmp_path):
    code = "import os, sys; sys.path.insert(0, 'tests'); from test_trust_places import solution\n"
    code += "other = os.fork(); made = solution(3000 if other else 1000)\n"
    code += "for _ in range(5): made.save(sys.argv[1])\n"
    code += "if other: sys.exit(os.waitstatus_to_exitcode(os.waitpid(other, 0)[1]))"
    done = plainly(tmp_path / "run.nc", code=code)
    assert done.returncode == 0, done.stderr
    with netCDF4.Dataset(tmp_path / "run.nc") as file:
        assert len(file.dimensions["time"]) in (1000, 3000)
        assert np.array_equal(file["x"][:], np.sin(file["time"][:]))
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


def test_the_command_line_gives_each_run_a_file_of_its_own(tmp_path):
    study = write(tmp_path, STUDY, "quick.toml")
    commands = {
        "quick_row=base": [],
        "quick_row=1": ["--row", 1],
        "quick_row=1_set=parameters.m_u=41kg": ["--row", 1, "--set", "parameters.m_u=41 kg"],
    }
    for name, options in commands.items():
        done = plainly("run", study, "--no-figure", *options, cwd=tmp_path)
        assert f"wrote results/{name}.nc" in done.stdout, done.stderr
        assert "held a run of" not in done.stderr
    assert {each.stem for each in (tmp_path / "results").iterdir()} == set(commands)
    other = tmp_path / "other"
    other.mkdir()
    done = plainly("run", write(other, STUDY, "quick.toml"), "--no-figure", "--row", 1, cwd=tmp_path)
    assert f"note: results/quick_row=1.nc held a run of {study}" in done.stderr


def test_names_of_files_differ_where_what_is_asked_for_differs():
    assert named("map") == named("map", metric=[]) == "map"
    assert named("map", metric=["ride"], over=["k", "c"]) == "map_metric=ride_over=k+c"
    asked = [["a", "b"], ["a+b"], ["a-b"], ["a/b"], ["ab"], ["a_b"], ["a" * 200], ["a" * 201]]
    names = {named("map", metric=words) for words in asked}
    assert len(names) == len(asked)
    assert all("/" not in name and len(name) < 200 for name in names)
