"""Kernels whose model changed since: commands compute what the model says now, and only `generate` writes them down."""

import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray
from commands import plainly
from study_files import write

import qddot
from qddot import origin
from qddot.codegen.command import generate
from qddot.codegen.generate import apply, changes
from qddot.codegen.sources import find
from qddot.commands import COMMANDS
from qddot.model.system import ModelError
from qddot.runner import stale
from qddot.runner.batch.cluster import _Frozen, _opened
from qddot.runner.batch.job import read_job
from qddot.runner.stale import StaleKernels, kernel_digest

ROOT = Path(__file__).parent.parent

MODEL = """\
from sympy import symbols
from numbers_of_mine import STIFFNESS
from qddot.model import Coordinate, Parameter, System


def system():
    x, xdot, m = symbols("x xdot m")
    return System(
        name="own", title="A mass on a spring", coordinates=[Coordinate(x, "m", "displacement")],
        parameters=[Parameter(m, 1.0, "kg", "mass")], kinetic_energy=m * xdot**2 / 2,
        potential_energy=STIFFNESS * x**2 / 2,
    )
"""

STUDY = """\
model = "kernels/own.py"
span = [0, 1]
initial = { x = 1.0 }
[integration]
method = "rk4"
step = 1e-3
"""

SWEEP = """\
[[sweep.axes]]
key = "parameters.m"
values = [1.0, 4.0]
[sweep]
block = 1
[metrics.end]
kind = "final"
of = "x"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A model whose frequency is 3 rad/s, its kernels, and studies of it."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path, MODEL, "mine.py")
    stiffness(9)
    write(tmp_path, STUDY)
    write(tmp_path, STUDY + SWEEP, "sweep.toml")
    assert generate(("mine.py",), Path("kernels"), False, False) == 0
    return tmp_path


def stiffness(k):
    Path("numbers_of_mine.py").write_text(f"STIFFNESS = {k}\n")


def command(name, **given):
    """The exit status of a command, given as a person would who leaves out the rest."""
    own = {
        "run": {
            "study": Path("study.toml"), "into": Path("results"), "figure": False, "settings": [], "row": None,
            "watch": False,
        },
        "batch": {
            "study": Path("sweep.toml"), "out": None, "figure": False, "settings": [], "workers": None,
            "scheduler": None, "fresh": False, "keep_kernels": False,
        },
    }  # fmt: skip
    return COMMANDS[name].function(**own[name] | given)


def end():
    with xarray.open_dataset("results/study.nc") as run:
        return float(run["x"][-1])


def ends():
    with xarray.open_zarr("results/sweep.zarr") as data:
        return data["end"].to_numpy()


def texts(where):
    return {path: path.read_bytes() for path in Path(where).rglob("*.py")}


def numbers(name):
    """The stiffness, or half of it, as kernels have it."""
    text = Path(f"kernels/{name}.py").read_text()
    return {k for k in (4.0, 7.0, 9.0) if re.search(rf"\b({k}|{k / 2})\b", text.partition("def rhs")[2])}


def test_a_run_computes_what_the_model_says_now_and_leaves_its_kernels_as_they_are(folder, capsys):
    before = texts("kernels")
    assert command("run") == 0
    assert end() == pytest.approx(np.cos(3), abs=1e-9)
    assert "changed" not in capsys.readouterr().err
    assert not Path(".qddot").exists()

    stiffness(16)
    assert command("run") == 0
    assert end() == pytest.approx(np.cos(4), abs=1e-9)
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "changed" in line]
    assert line.startswith("note: numbers_of_mine.py changed since kernels/own.py was generated: using kernels of its")
    assert line.endswith("`qddot generate mine.py --into kernels` writes them for good")
    assert texts("kernels") == before

    (made,) = Path(".qddot/kernels").glob("own-*/own.py")
    written = made.stat().st_mtime_ns
    assert command("run") == 0
    assert made.stat().st_mtime_ns == written
    assert Path(".qddot/.gitignore").read_text() == "*\n"

    stiffness(9)  # as it was
    capsys.readouterr()
    assert command("run") == 0
    assert end() == pytest.approx(np.cos(3), abs=1e-9)
    assert "changed" not in capsys.readouterr().err


def test_load_warns_with_the_model_the_file_and_the_command_and_takes_the_kernels_that_are_there(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        qddot.load("kernels/own.py")
    stiffness(16)
    said = r"numbers_of_mine.py changed since kernels/own.py was generated: `qddot generate mine.py --into kernels`"
    with pytest.warns(StaleKernels, match=said) as caught:
        model = qddot.load("kernels/own.py")
    assert caught[0].filename == __file__
    assert Path(model.module.__file__) == folder / "kernels" / "own.py"
    assert not Path(".qddot").exists()


@pytest.mark.parametrize("change", ["removed", "line ends", "made by a program"])
def test_kernels_are_used_without_a_word_where_there_is_nothing_to_make_others_of(folder, change):
    if change == "removed":
        stiffness(16)
        Path("mine.py").unlink()
    elif change == "line ends":
        Path("mine.py").write_bytes(MODEL.replace("\n", "\r\n").encode())
    else:
        Path("mine.py").write_text(MODEL + "#")
        (system,) = find(("mine.py",)).values()
        qddot.generate(system, "kernels")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        qddot.load("kernels/own.py")


def test_files_are_found_in_the_syntax_tree_without_running_it(tmp_path):
    write(tmp_path, "import one, sympy\nraise SystemExit\n", "model.py")
    write(tmp_path, "def late():\n    from package.part import thing\n    import model\n", "one.py")
    (tmp_path / "package").mkdir()
    for name in ("__init__", "part", "other"):
        write(
            tmp_path / "package", "from qddot.model import System\nfrom qddot.model.m113 import system\n", f"{name}.py"
        )
    write(tmp_path, "def system(:", "unused.py")
    found = [*origin.sources(tmp_path / "model.py")]
    package = [tmp_path / "package" / "__init__.py", tmp_path / "package" / "part.py"]
    assert found == [tmp_path / "model.py", tmp_path / "one.py", *package, ROOT / "model" / "m113.py"]
    names = [*origin.origin(dict.fromkeys(found, ""), tmp_path / "kernels")]
    assert names == ["../model.py", "../one.py", "../package/__init__.py", "../package/part.py", "qddot.model.m113"]


def test_odd_names_of_files_stay_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = 'ä "\\\nraise SystemExit #.py'
    write(tmp_path, MODEL.replace("numbers_of_mine", "n"), name)
    write(tmp_path, "STIFFNESS = 9\n", "n.py")
    assert generate((name,), Path("kernels"), False, False) == 0
    assert [*origin.read(Path("kernels/own.py"))] == [tmp_path / name, tmp_path / "n.py"]
    assert origin.changed(Path("kernels/own.py")) == []
    assert qddot.load("kernels/own.py").name == "own"


def test_what_lies_beside_a_model_is_its_own_and_as_it_stands_now(tmp_path, monkeypatch):
    """Two models with helpers of one name; a helper that is edited within the same second, to the same length."""
    monkeypatch.chdir(tmp_path)
    for name, k in (("a", 9), ("b", 4)):
        (tmp_path / name).mkdir()
        write(tmp_path / name, MODEL.replace('"own"', f'"{name}"'), "model.py")
        write(tmp_path / name, f"STIFFNESS = {k}\n", "numbers_of_mine.py")
    assert generate(("a/model.py", "b/model.py"), Path("kernels"), False, False) == 0
    assert numbers("a") == {9.0}
    assert numbers("b") == {4.0}
    write(tmp_path / "b", "STIFFNESS = 7\n", "numbers_of_mine.py")
    assert generate(("b/model.py",), Path("kernels"), False, False) == 0
    assert numbers("b") == {7.0}
    assert "numbers_of_mine" not in sys.modules
    assert not list(tmp_path.rglob("*.pyc"))


def test_kernels_are_the_same_wherever_they_were_generated(folder):
    generate(("mine.py",), Path("deep/down"), False, False)
    assert Path("kernels/own.py").read_bytes() != Path("deep/down/own.py").read_bytes()
    assert kernel_digest(Path("kernels/own.py")) == kernel_digest(Path("deep/down/own.py"))


def test_a_batch_that_is_there_keeps_its_kernels_or_is_computed_again(folder, capsys):
    assert command("batch") == 0
    assert ends() == pytest.approx([np.cos(3), np.cos(1.5)], abs=1e-9)
    stiffness(16)
    Path("results/sweep.zarr/.qddot/blocks/00000001.json").unlink()  # as if it had been killed
    with pytest.raises(ValueError, match=r"numbers_of_mine\.py changed") as refused:
        command("batch")
    assert "--keep-kernels" in str(refused.value)
    assert "--fresh" in str(refused.value)
    assert not Path(".qddot").exists()
    assert command("batch", keep_kernels=True) == 0
    assert ends() == pytest.approx([np.cos(3), np.cos(1.5)], abs=1e-9)

    assert command("batch", fresh=True) == 0
    assert ends() == pytest.approx([np.cos(4), np.cos(2)], abs=1e-9)
    Path("results/sweep.zarr/.qddot/blocks/00000001.json").unlink()
    capsys.readouterr()
    assert command("batch") == 0  # begun with the kernels of this very text
    stiffness(25)
    assert command("batch", keep_kernels=True) == 0  # and they are still there
    assert command("batch", fresh=True, keep_kernels=True) == 0  # those in kernels/
    assert ends() == pytest.approx([np.cos(3), np.cos(1.5)], abs=1e-9)


def test_a_worker_takes_the_kernels_that_the_batch_was_begun_with(folder, monkeypatch):
    stiffness(16)
    with stale.choosing(stale.anew(lambda model, into: apply(changes(find((model,)), into, whole=False)), print)):
        job = read_job(Path("sweep.toml"))
    monkeypatch.setattr("qddot.runner.batch.cluster.warm_up", lambda job: None)
    monkeypatch.setattr("qddot.runner.batch.cluster.Store", lambda path: None)
    model = pickle.loads(pickle.dumps(job.model))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        there, _ = _opened(str(job.path), job.text, _Frozen(job.tree | job.own), model, "", 1)
    assert there.model.module.__file__ == job.model.module.__file__
    assert ".qddot" in there.model.module.__file__


def test_a_model_that_cannot_be_generated_is_told_and_leaves_nothing(folder):
    before = texts("kernels")
    Path("numbers_of_mine.py").write_text("STIFFNES = 9\n")
    with pytest.raises(ValueError, match=r"study.toml, line 1: model: .*mine.py, line 2: ImportError: cannot import"):
        command("run")
    assert [path.name for path in Path(".qddot/kernels").iterdir()] == []
    assert texts("kernels") == before


def test_where_no_kernels_can_be_written_one_line_says_so(folder):
    stiffness(16)
    folder.chmod(0o555)
    done = plainly("run", "study.toml", "--no-figure", "--into", folder / "kernels", cwd=folder)
    folder.chmod(0o755)
    assert done.returncode == 2
    said = done.stderr.splitlines()[-1]
    assert said.startswith("error: study.toml, line 1: model: numbers_of_mine.py changed since kernels/own.py was")
    assert f"there is no place for new kernels: {folder / '.qddot' / 'kernels'}: Permission denied" in said
    assert said.endswith("use `qddot generate mine.py --into kernels`")


def test_two_processes_make_an_entry_once_and_nothing_piles_up(folder):
    (folder / ".qddot" / "kernels").mkdir(parents=True)
    left = folder / ".qddot" / "kernels" / ".own-0123456789abcdef.01234567"
    left.mkdir()
    stiffness(16)
    code = (
        "import time\nfrom pathlib import Path\nfrom qddot.runner import stale\n"
        "def make(model, into):\n    into.mkdir()\n    time.sleep(0.3)\n    (into / 'own.py').write_text('')\n"
        "    print('made', flush=True)\n"
        "module = Path('kernels/own.py')\n"
        "print(stale.anew(make, lambda line: None)(module, [Path('numbers_of_mine.py')], Path()))\n"
    )
    both = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=folder) for _ in range(2)
    ]
    said = [each.communicate(timeout=60)[0].splitlines() for each in both]
    assert [each.returncode for each in both] == [0, 0]
    assert said[0][-1] == said[1][-1]
    assert sum(lines.count("made") for lines in said) == 1
    assert not left.exists()

    def make(model, into):
        into.mkdir()
        (into / "own.py").write_text("")

    for k in range(30, 45):
        stiffness(k)
        made = stale.anew(make, lambda line: None)(Path("kernels/own.py"), [folder / "numbers_of_mine.py"], folder)
        assert made.is_file()
    assert len(list((folder / ".qddot" / "kernels").iterdir())) == 8


def test_where_nothing_changed_nothing_is_derived(folder):
    code = (
        "import sys\nfrom pathlib import Path\nfrom qddot.commands import COMMANDS\n"
        "COMMANDS['show'].function(name='kernels/own.py', parameters=None, into=Path('results'))\n"
        "COMMANDS['show'].function(name='quarter_car', parameters=None, into=Path('results'))\n"
        "sys.exit(any(name in sys.modules for name in ('sympy', 'qddot.codegen')))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_generate_replaces_nothing_that_was_not_generated(folder):
    Path("own.py").write_text(MODEL)
    with pytest.raises(ModelError, match=r"own.py was not generated, and is not replaced"):
        generate(("own.py",), Path(), False, False)
    assert Path("own.py").read_text() == MODEL
    with pytest.raises(ModelError, match="another of these models is called own"):
        generate(("own.py", "mine.py"), Path("kernels"), False, False)
