"""qddot installed as a wheel, beside a user's own files: nothing of his is in its way, and nothing of it in his."""

import ast
import os
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from pages import blocks, python_example
from ruff.__main__ import find_ruff_bin

import qddot

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
ROOMS = ("codegen", "generated", "model", "paper", "runner", "units")
HOSTILE = "raise SystemExit('a file of the user was imported in place of one of ours')\n"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir"]
    sources = tmp_path_factory.mktemp("sources") / "qddot"  # building leaves a folder `build` beside the sources
    tracked = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, tracked.split("\0")):
        if (ROOT / name).is_file() and not name.startswith((".types", "docs", "tests")):
            (sources / name).parent.mkdir(parents=True, exist_ok=True)
            (sources / name).write_bytes((ROOT / name).read_bytes())
    subprocess.run([*command, folder, sources], check=True, capture_output=True, timeout=300)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The interpreter of an environment that has the wheel and, by a path, the libraries of this one; and a folder."""
    home = tmp_path_factory.mktemp("environment")
    venv.create(home, with_pip=False)
    packages = next((home / "lib").glob("python*")) / "site-packages"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    libraries = Path(pytest.__file__).parent.parent  # as a path alone: what stands in its .pth files is not read
    (packages / "libraries.pth").write_text(f"{libraries}\n")
    (home / "bin" / "ruff").symlink_to(find_ruff_bin())  # an installer would have put it there
    folder = tmp_path_factory.mktemp("user")
    for name in ("model.py", "runner.py", "codegen.py", "generated.py", "studies.py"):
        (folder / name).write_text(HOSTILE)
    for name, text in blocks().items():
        (folder / name).write_text(text)
    return home / "bin" / "python", folder, packages


def run(installed, *arguments, blocked=()):
    """`python ARGUMENTS` in the user's folder; importing one of the blocked libraries fails as if it were not there."""
    python, folder, _ = installed
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment["NUMBA_CACHE_DIR"] = str(ROOT / "runner" / "__pycache__")  # drivers of the same source are there
    if blocked:
        site = folder / "blocked"
        site.mkdir(exist_ok=True)
        (site / "sitecustomize.py").write_text(BLOCKER.format(tuple(blocked)))
        environment["PYTHONPATH"] = str(site)
    command = [str(python), *map(str, arguments)]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600, check=False
    )


BLOCKER = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)
sys.meta_path.insert(0, Blocked())
"""


def test_the_wheel_holds_qddot_alone_with_its_studies_templates_and_equations(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == {"qddot"}
    wanted = ["qddot/py.typed", "qddot/generated/m113.tex", "qddot/codegen/templates/kernels.py.jinja"]
    wanted += ["qddot/studies/one_shot.toml", "qddot/studies/library/guns.toml", "qddot/studies/paper/paper.toml"]
    wanted += ["qddot/runner/scene/scene.js", "qddot/runner/scene/scene.css", "qddot/runner/report/page/page.html"]
    wanted += [f"qddot/runner/report/page/uplot/{name}" for name in ("uPlot.iife.min.js", "uPlot.min.css", "LICENSE")]
    parts = ("plots.js", "moment.js", "runs.js", "runs.html", "page.js", "page.css")
    wanted += [
        *(f"qddot/runner/report/page/{name}" for name in parts),
        "qddot/paper/claims.js",
        "qddot/paper/claims.css",
    ]
    assert set(wanted) <= set(names)
    assert any(name.endswith("LICENSE") for name in names)


def test_every_folder_with_code_is_a_package_of_the_wheel():
    folders = {path.parent for room in ROOMS for path in (ROOT / room).rglob("*.py") if "__pycache__" not in path.parts}
    expected = {"qddot", "qddot.commands", "qddot.studies"} | {
        f"qddot.{'.'.join(path.relative_to(ROOT).parts)}" for path in folders
    }
    assert set(PROJECT["tool"]["setuptools"]["packages"]) == expected


def test_the_links_for_the_type_checker_lead_to_every_room_and_file_of_the_front_door():
    linked = {path.name: path.resolve() for path in (ROOT / ".types" / "qddot").iterdir()}
    front = {path.name: path for path in (ROOT / "qddot").iterdir() if path.name != "__pycache__"}
    assert linked == front | {room: ROOT / room for room in ROOMS}


def test_readmes_own_model_runs_beside_files_that_have_our_rooms_names(installed):
    done = run(installed, "-m", "qddot", "generate", "duffing.py", "--into", "kernels")
    assert done.returncode == 0, done.stderr
    done = run(installed, "-m", "qddot", "run", "shaken.toml", "--no-figure")
    assert done.returncode == 0, done.stderr
    assert (installed[1] / "results" / "shaken.nc").is_file()


def test_the_python_example_runs_where_only_the_wheel_is(installed):
    done = run(installed, "-c", python_example())
    assert done.returncode == 0, done.stderr


def test_ready_studies_and_the_library_are_found_where_only_the_wheel_is(installed):
    done = run(installed, "-m", "qddot", "list", "studies")
    assert done.returncode == 0, done.stderr
    assert "one_shot" in done.stdout
    (installed[1] / "own.toml").write_text(
        'model = "m113"\nparameter_set = "as_run_unloaded"\nspan = [0, 0.1]\n'
        '[integration]\nmethod = "rk4"\nstep = 1e-3\n[inputs.F]\nfrom = "gun_30mm"\ntimes = [0.01]\n'
    )
    done = run(installed, "-m", "qddot", "show", "own.toml")
    assert done.returncode == 0, done.stderr
    done = run(
        installed, "-m", "qddot", "compare", installed[2] / "qddot" / "studies" / "paper" / "equations_5_to_11.txt"
    )
    assert "4 of 7 equations are equal" in done.stdout, done.stderr


def test_the_paper_and_its_report_find_their_studies_where_only_the_wheel_is(installed):
    """The first ends at what was given wrongly, which is looked at when the studies have been read."""
    done = run(installed, "-m", "qddot", "paper", "--parameters", "as_run_unlaoded")
    assert done.returncode == 2
    assert "did you mean 'as_run_unloaded'" in done.stderr, done.stderr
    (installed[1] / "claims.json").write_text('{"parameter_set": null, "claims": []}')
    done = run(installed, "-m", "qddot", "report", "--claims", "claims.json", "--no-pdf")
    assert done.returncode == 0, done.stderr
    assert "The ride" in (installed[1] / "results" / "paper" / "report.html").read_text()


def test_generating_writes_where_the_user_stands_and_never_into_the_package(installed):
    _, folder, packages = installed
    before = {
        path: path.stat().st_mtime_ns
        for path in (packages / "qddot").rglob("*.[pt]*")
        if "__pycache__" not in path.parts
    }
    done = run(installed, "-m", "qddot", "generate", "quarter_car")
    assert done.returncode == 0, done.stderr
    assert (folder / "generated" / "quarter_car.py").read_text() == (ROOT / "generated" / "quarter_car.py").read_text()
    after = {path: path.stat().st_mtime_ns for path in before}
    assert after == before


def test_running_kernels_needs_numpy_scipy_and_numba_alone(installed):
    code = (
        "import qddot; model = qddot.load('double_pendulum')\n"
        "solution = qddot.simulate(model, (0, 1), method='dop853', initial=[1, 1, 0, 0])\n"
        "assert solution.success and solution.t[-1] == 1"
    )
    others = ("sympy", "symengine", "jinja2", "ruff", "pydantic", "pint", "rich", "xarray", "netCDF4", "pandas")
    done = run(installed, "-c", code, blocked=(*others, "matplotlib", "zarr", "distributed", "latex2mathml"))
    assert done.returncode == 0, done.stderr


REPORT = ("matplotlib", "latex2mathml")
BATCH = ("zarr", "distributed", "dask", "pyarrow")


def test_what_comes_without_extras_derives_runs_and_saves_and_says_which_extra_draws(installed):
    run(installed, "-m", "qddot", "generate", "duffing.py", "--into", "kernels")
    done = run(installed, "-m", "qddot", "run", "shaken.toml", blocked=REPORT + BATCH)
    assert done.returncode == 0, done.stderr
    assert "shaken.nc" in done.stdout
    assert "pip install 'qddot[report]'" in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        (["run", "shaken.toml", "--figure"], "report"),
        (["equations", "quarter_car", "--quiet"], "report"),
        (["batch", "sweep.toml"], "batch"),
        (["summary", "results/none.zarr"], "batch"),
    ],
)
def test_a_missing_extra_is_named_with_the_command_that_brings_it(installed, arguments, extra):
    study = (installed[1] / "shaken.toml").read_text()
    (installed[1] / "sweep.toml").write_text(
        study + '\n[[sweep.axes]]\nname = "m"\nkey = "parameters.m"\nvalues = [1, 2]\n'
    )
    done = run(installed, "-m", "qddot", *arguments, blocked=REPORT + BATCH)
    assert done.returncode == 2
    assert f"pip install 'qddot[{extra}]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_front_door_says_to_a_type_checker_what_it_gives():
    tree = ast.parse((ROOT / "qddot" / "__init__.py").read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    homes = {alias.name: node.module for node in imports for alias in node.names}
    assert homes == qddot._HOMES | dict.fromkeys(qddot.NAMESPACES, "qddot")
    assert sorted(homes) == qddot.__all__


def test_the_front_door_offers_what_a_user_wants_and_nothing_else():
    assert set(qddot.__all__) <= set(dir(qddot))
    assert all(name in qddot.__all__ or name.startswith("__") for name in dir(qddot))
    for name in qddot.__all__:
        assert name in qddot.__doc__, f"{name} is not in the table of contents"
    assert qddot.__version__ == PROJECT["project"]["version"]


@pytest.mark.parametrize("old", sorted(qddot._MOVED))
def test_a_name_of_the_version_before_gives_the_new_one_and_says_so(old):
    room, new = qddot._MOVED[old].split(".")
    with pytest.warns(DeprecationWarning, match=f"qddot.{old} is qddot.{room}.{new} now"):
        value = getattr(qddot, old)
    assert value is getattr(getattr(qddot, room), new)
