"""Messages of the command line say what was found and what to do; and files run no code but what lies below them."""

from importlib.metadata import version
from pathlib import Path

import pytest
from commands import command

import qddot as front
from qddot.codegen.compare.command import run as compare
from qddot.codegen.compare.tree import CompareError
from qddot.codegen.slips import explained
from qddot.codegen.sources import from_file
from qddot.model.system import ModelError
from qddot.paper.claims import read as read_claims
from qddot.runner.commands.show import show
from qddot.runner.files import named_code
from qddot.runner.identify.problem import read as read_identification
from qddot.runner.report.tables import statistics
from qddot.runner.study.arguments import study_model
from qddot.runner.study.read import StudyError, read
from qddot.words import be, counted, nearest

ROOT = Path(__file__).parent.parent

OWN = """from sympy import symbols
from qddot.model.system import Coordinate, Parameter, System
x, xdot, m, k_3 = symbols("x xdot m k_3")
def system():
    potential = k_3 * x**4
    return System("own", "Own", [Coordinate(x, "m", "x")],
                  [Parameter(m, 1.0, "kg", "mass"), Parameter(k_3, 1.0, "N/m^3", "k")], m * xdot**2 / 2, potential)
"""
EVIL = "open(r'{}', 'w').write('ran')\n"
STUDY = 'model = "{}"\nspan = [0, 1]\n'


# Files that name code


@pytest.fixture
def evil(tmp_path):
    """A program beside a folder `own`, and the file that it writes when it is run."""
    (tmp_path / "own").mkdir()
    (tmp_path / "evil.py").write_text(EVIL.format(tmp_path / "ran"))
    (tmp_path / "own" / "link.py").symlink_to(tmp_path / "evil.py")
    (tmp_path / "own" / "elsewhere").symlink_to(tmp_path)
    return tmp_path / "ran"


@pytest.mark.parametrize("name", ["./evil.py", "../evil.py", "/etc/evil.py", "link.py", "evil", "m113.py"])
def test_an_equations_file_never_runs_a_file(tmp_path, monkeypatch, evil, name):
    for folder in (tmp_path, tmp_path / "own"):
        monkeypatch.chdir(folder)
        (folder / "equations.txt").write_text(f"model {name}\nq_1: g = 0\n")
        with pytest.raises(CompareError) as refused:
            compare(folder / "equations.txt", None, "text")
        assert str(refused.value).startswith(str(folder / "equations.txt"))
        assert not evil.exists()
        if name != "evil":
            said = "names shipped models only; give the path of one on the command line, --model"
            assert said in str(refused.value)


def test_the_command_line_may_name_the_file_of_a_model(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "equations.txt").write_text("x: m*xddot + 4*k_3*x**3 = 0\n")
    done = command("compare", "equations.txt", "--model", "./own.py", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "1 of 1 equation is equal to the one derived" in done.stdout


@pytest.mark.parametrize("name", ["../evil.py", "{}/evil.py", "link.py", "elsewhere/evil.py", "sub/../../evil.py"])
def test_a_study_names_code_below_its_own_folder_only(tmp_path, evil, name):
    name = name.format(tmp_path)
    path = tmp_path / "own" / "study.toml"
    path.write_text(STUDY.format(name))
    with pytest.raises(StudyError, match=r"line 1: model: .* does not lie below .*own: a file names code below"):
        study_model(read(path), path)
    assert not evil.exists()
    outer = tmp_path / "own" / "identify.toml"
    outer.write_text(f'study = "{name.replace(".py", ".toml")}"\n[unknowns]\n[[scenarios]]\nname = "a"\n')
    assert not evil.exists()


def test_a_model_below_the_studys_folder_is_found(tmp_path):
    front.generate(from_file(written(tmp_path, OWN)), tmp_path / "kernels")
    path = tmp_path / "study.toml"
    path.write_text(STUDY.format("kernels/own.py"))
    assert study_model(read(path), path).name == "own"


def written(folder, text):
    (folder / "own.py").write_text(text)
    return folder / "own.py"


def test_named_code_is_below_the_folder_or_refused(tmp_path, evil):
    own = tmp_path / "own"
    assert named_code(own, "a/b.py") == own / "a" / "b.py"
    assert named_code(tmp_path, "own/link.py") == own / "link.py"  # the link stays within tmp_path
    for name in ("..", "a/../../b", "/a", "link.py", "elsewhere", str(own / "a.py")):
        with pytest.raises(ValueError, match="does not lie below"):
            named_code(own, name)


def test_identifications_and_papers_name_studies_below_their_folder_only(tmp_path):
    shipped = (ROOT / "studies" / "paper" / "identify_recoil.toml").read_text()
    (tmp_path / "identify.toml").write_text(shipped.replace('"standing.toml"', '"../standing.toml"'))
    with pytest.raises(StudyError, match=r"identify.toml, line \d+: study: '../standing.toml' does not lie below"):
        read_identification(tmp_path / "identify.toml")
    shipped = (ROOT / "studies" / "paper" / "paper.toml").read_text()
    (tmp_path / "paper.toml").write_text(shipped.replace('"drive.toml"', '"/drive.toml"'))
    with pytest.raises(StudyError, match=r"paper.toml, line \d+: drive.study: '/drive.toml' does not lie below"):
        read_claims(tmp_path / "paper.toml")
    read_claims(ROOT / "studies" / "paper" / "paper.toml")


# Arguments


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rnu"], "there is no command 'rnu'; did you mean run?"),
        (["--verson"], "there is no option '--verson'; did you mean --version?"),
        (["xyzzy"], "there is no command 'xyzzy'; `qddot --help` lists them all"),
        (["run", "a.toml", "--rwo", "3"], "run has no option '--rwo'; did you mean --row?"),
        (["generate", "m113", "--chek"], "generate has no option '--chek'; did you mean --check?"),
        (["run", "a.toml", "--intoo=x"], "run has no option '--intoo'; did you mean --into?"),
        (["list", "models", "more"], "list takes no further 'more'"),
        (["list", "metrisc"], "did you mean 'metrics'?"),
        (["generate", "m113", "--diff"], "--diff says how files differ, which --check looks for"),
        (["show", "one_shot"], "one_shot is no model but a study: qddot show studies/one_shot.toml"),
        (["show", "m131"], "did you mean 'm113'?"),
    ],
)
def test_a_slip_is_answered_by_what_was_meant(arguments, said):
    done = command(*arguments)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_the_version():
    done = command("--version")
    assert (done.returncode, done.stdout) == (0, f"qddot {version('qddot')}\n")


OTHERS = {"own.py": "generate", "done.nc": "holds the results of a run", "all.zarr": "is the store of a batch"}


@pytest.mark.parametrize("name", OTHERS)
def test_a_file_of_another_kind_is_named_for_what_it_is(tmp_path, name):
    (tmp_path / name).write_text(OWN)
    for reader in (read, read_identification):  # run, batch and show; identify
        with pytest.raises(StudyError, match=f"{name} .*{OTHERS[name]}.*; expected a study, a TOML file"):
            reader(tmp_path / name)
    with pytest.raises(ValueError, match=f"{name} .*{OTHERS[name]}"):
        show(str(tmp_path / name), None, tmp_path)


def test_a_result_given_to_run_ends_in_one_line(tmp_path):
    (tmp_path / "done.nc").write_bytes(b"\x89HDF")
    done = command("run", "done.nc", cwd=tmp_path)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert done.stderr.startswith("error: done.nc holds the results of a run; ")


# Model files


@pytest.mark.parametrize(
    ("good", "bad", "said"),
    [
        ("k_3 * x**4", "k_33 * x**4", "line 5: NameError: name 'k_33' is not defined in `potential = k_33 * x**4`"),
        ("k_3 * x**4", "k_33 * x**4", "did you mean k_3?"),
        ("k_3 * x**4", "k_3 * x^4", "line 5: TypeError: "),
        ("k_3 * x**4", "k_3 * x^4", "write powers with **"),
        ("k_3 * x**4", "k_3 * (x**4", "line 5, column 23: this is no Python: '(' was never closed in `potential"),
        ("import symbols", "import symbls", "line 1: ImportError: "),
        ("import symbols", "import symbls", "did you mean symbols?"),
        ("k_3 * x**4", "x.dif(x)", "line 5: AttributeError: 'Symbol' object has no attribute 'dif' in `potential"),
        ("k_3 * x**4", "x.dif(x)", "did you mean diff?"),
        ("k_3 * x**4", "1 / 0", "line 5: ZeroDivisionError: division by zero in `potential = 1 / 0`"),
        ("k_3 * x**4", "exit(3)", "line 5: SystemExit: 3 in `potential = exit(3)`; a model file gives a System"),
        ("return System(", "return (", "system() gives ("),
        ("def system", "def sytem", "expected a function system()"),
        ("m * xdot**2 / 2", "m", "the kinetic energy depends on no velocity"),
    ],
)
def test_a_slip_in_a_model_file_is_one_line_with_file_and_place(tmp_path, good, bad, said):
    assert good in OWN
    path = written(tmp_path, OWN.replace(good, bad))
    with pytest.raises(ModelError) as refused:
        from_file(path)
    assert str(refused.value).startswith(str(path))
    assert said in str(refused.value)


def test_a_slip_is_found_by_a_relative_path_too(tmp_path, monkeypatch):
    written(tmp_path, OWN.replace("k_3 * x**4", "k_33 * x**4"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelError, match=r"^own.py, line 5: NameError"):
        from_file(Path("own.py"))


def test_a_slip_outside_the_file_has_no_line(tmp_path):
    with pytest.raises(ModelError, match=r"x.py: ValueError: no line of it"), explained(tmp_path / "x.py"):
        raise ValueError("no line\nof it")


# Words


def test_nouns_are_counted():
    assert [counted(n, "step") for n in (0, 1, 2)] == ["0 steps", "1 step", "2 steps"]
    assert counted(2, "degree of freedom") == "2 degrees of freedom"
    found = [counted(3, noun) for noun in ("match", "entry", "day", "axis")]
    assert found == ["3 matches", "3 entries", "3 days", "3 axes"]
    assert [be(n) for n in (0, 1, 2)] == ["are", "is", "are"]
    assert nearest("rnu", ("run", "list")) == "; did you mean run?"
    assert nearest("xyzzy", ("run", "list")) == ""


def test_one_step_is_one_step():
    model = front.load("quarter_car")
    solution = front.simulate(model, (0, 1e-3), method="rk4", step=1e-3)
    assert "1 step, 4 evaluations, 2 points" in statistics(solution)


def test_a_public_name_that_is_none_is_answered_with_the_nearest():
    with pytest.raises(AttributeError, match="no attribute 'simulat'; did you mean simulate"):
        front.simulat  # noqa: B018
    with pytest.raises(AttributeError, match=r"no attribute '__wrapped__'$"):
        front.__wrapped__  # noqa: B018
