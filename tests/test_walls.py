"""Imports go one way, the front door is light, and the public names are exactly those it lists."""

import ast
import os
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

import qddot

ROOT = Path(__file__).parent.parent

ROOMS = {"units", "model", "codegen", "generated", "runner", "paper", "studies"}

#: Of the front door, what rooms may import.
SHARED = {"words", "origin", "extras", "cycles"}

#: The rooms of the runner from the first to the last: each may import those before it.
RUNNER = (
    *(
        "abi",
        "notebook",
        "checks",
        "files",
        "ranges",
        "machine",
        "matrices",
        "sparse",
        "tables",
        "pictures",
        "read_tables",
        "stale",
        "load",
        "inputs",
        "problem",
        "switching",
    ),
    *("options", "tableaux", "method", "frame", "explicit", "stiff", "workers", "exact", "taylor", "methods"),
    *(
        "takers",
        "auto",
        "keywords",
        "manifold",
        "inertia",
        "equilibrium",
        "scene",
        "modes",
        "assembly",
        "jumps",
        "diagnosis",
        "columns",
        "saving",
        "solution",
        "result",
        "dense",
        "simulate",
        "solve",
    ),
    *("observe", "lanes", "metrics", "study", "batch", "identify", "report", "commands"),
)
MODULES = [path for path in (ROOT / "runner").rglob("*.py") if "__pycache__" not in path.parts]

#: What a room must not import: libraries, and rooms of ours. Of the front door, rooms may have its words and origins.
FORBIDDEN = {
    "units": {"numpy", "sympy", "qddot.model", "qddot.codegen", "qddot.generated", "qddot.runner"},
    "model": {"pint", "numpy", "scipy", "numba", "jinja2", "symengine"}
    | {"qddot.codegen", "qddot.generated", "qddot.runner"},
    "codegen": {"pint", "numpy", "scipy", "numba", "qddot.generated", "qddot.runner"},
    "generated": {"numpy", "sympy", "qddot.units", "qddot.model", "qddot.codegen"},
    "runner": {"pint", "sympy", "symengine", "jinja2", "qddot.model", "qddot.codegen"},
}


@cache
def read(path):
    """Full names of everything a file imports, inside functions too, and of the functions that it calls."""
    imported, called = [], set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            imported += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            imported += [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            called.add(node.func.id)
    return imported, called


def imported(path):
    return read(path)[0]


def imports(path):
    """What a file imports: libraries, and what is ours as `qddot.ROOM`; the front door as `qddot`."""
    for name in imported(path):
        first, _, rest = name.partition(".")
        room = rest.partition(".")[0]
        yield f"qddot.{room}" if first == "qddot" and room in {*ROOMS, *SHARED} else first


@pytest.mark.parametrize("room", FORBIDDEN)
def test_no_room_imports_what_it_must_not(room):
    for path in (ROOT / room).rglob("*.py"):
        assert not set(imports(path)) & (FORBIDDEN[room] | {"qddot", "qddot.paper", "tests"}), path


def test_imports_of_the_runner_lead_to_the_same_room_or_one_before_it():
    """So there is no circle of rooms, and no arrow that runs back; imports inside functions and for types count."""
    place = {room: k for k, room in enumerate(RUNNER)}
    found = {path.relative_to(ROOT / "runner").parts[0].removesuffix(".py") for path in (ROOT / "runner").rglob("*.py")}
    assert found - {"__init__"} == place.keys()
    back = []
    for path in (ROOT / "runner").rglob("*.py"):
        file = path.relative_to(ROOT / "runner")
        own = file.parts[0].removesuffix(".py")
        ours = (name.split(".")[2] for name in imported(path) if name.startswith("qddot.runner."))
        back += [f"{file} imports {room}" for room in ours if room in place and place[room] > place.get(own, -1)]
    assert back == []


def test_no_two_files_of_the_runner_import_each_other():
    """Nor in a longer circle."""
    files = {path: ".".join(("qddot", *path.relative_to(ROOT).with_suffix("").parts)) for path in MODULES}
    names = {name.removesuffix(".__init__"): path for path, name in files.items()}
    after = {}
    for path in files:
        prefixes = (name.rsplit(".", k)[0] for name in imported(path) for k in (0, 1))
        after[path] = {names[name] for name in prefixes if name in names and names[name] != path}
    TopologicalSorter(after).prepare()  # raises CycleError, with the circle


def test_the_paper_is_written_with_public_names_alone():
    public = {"qddot": qddot, **{f"qddot.{name}": import_module(f"qddot.{name}") for name in qddot.NAMESPACES}}
    for path in (ROOT / "paper").rglob("*.py"):
        for name in imported(path):
            module, _, last = name.rpartition(".")
            if name.partition(".")[0] == "qddot" and not name.startswith("qddot.paper."):
                assert module in public and last in public[module].__all__, (path, name)


def test_no_room_is_imported_by_its_bare_name():
    """From the root that would be a second copy of its modules."""
    for folder, folders, files in os.walk(ROOT):
        folders[:] = sorted({*folders} - {".venv", ".venv-bench", ".git", "build", ".types"})
        for path in (Path(folder, name) for name in files if name.endswith(".py")):
            assert not {name.partition(".")[0] for name in imported(path)} & {*ROOMS, *SHARED}, path


def test_generated_modules_import_numba_and_math_and_functions_for_them():
    """What the runner has for generated kernels to call stands in one module for each purpose."""
    for path in (ROOT / "generated").glob("*.py"):
        assert set(imports(path)) <= {"numba", "math", "qddot.runner"}, path
        ours = {name.rpartition(".")[0] for name in imported(path) if name.startswith("qddot.")}
        assert ours <= {"qddot.runner.machine.constrained"}, path


def test_running_imports_no_derivation_and_deriving_no_compiler():
    for module, absent in (
        ("qddot.runner.commands.run", "sympy"),
        ("qddot.codegen.command", "numba"),
        ("qddot", "numpy"),
    ):
        code = f"import sys, {module}; sys.exit({absent!r} in sys.modules)"
        assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0, module


def test_public_names_are_sorted_exist_and_are_documented():
    assert qddot.__all__ == sorted(set(qddot.__all__))
    for name in qddot.__all__:
        assert getattr(qddot, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'simulte'"):
        qddot.simulte  # noqa: B018


def test_no_file_evaluates_text():
    for room in ("units", "model", "codegen", "runner", "paper"):
        for path in (ROOT / room).rglob("*.py"):
            assert not read(path)[1] & {"eval", "exec"}, path
