"""Imports go one way, the front door is light, and the public names are exactly those it lists."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import qddot

ROOT = Path(__file__).parent.parent

ROOMS = {"units", "model", "codegen", "generated", "runner", "paper", "studies"}

#: Of the front door, what rooms may import.
SHARED = {"words", "origin"}

#: What a room must not import: libraries, and rooms of ours. Of the front door, rooms may have its words and origins.
FORBIDDEN = {
    "units": {"numpy", "sympy", "qddot.model", "qddot.codegen", "qddot.generated", "qddot.runner"},
    "model": {"pint", "numpy", "scipy", "numba", "jinja2", "symengine"}
    | {"qddot.codegen", "qddot.generated", "qddot.runner"},
    "codegen": {"pint", "numpy", "scipy", "numba", "qddot.generated", "qddot.runner"},
    "generated": {"numpy", "sympy", "qddot.units", "qddot.model", "qddot.codegen", "qddot.runner"},
    "runner": {"pint", "sympy", "symengine", "jinja2", "qddot.model", "qddot.codegen"},
}


def imported(path):
    """Full names of everything a file imports, inside functions too."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


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


def test_the_paper_is_written_with_public_names_alone():
    public = {"qddot": qddot, **{f"qddot.{name}": import_module(f"qddot.{name}") for name in qddot.NAMESPACES}}
    for path in (ROOT / "paper").rglob("*.py"):
        for name in imported(path):
            module, _, last = name.rpartition(".")
            if name.partition(".")[0] == "qddot" and not name.startswith("qddot.paper."):
                assert module in public and last in public[module].__all__, (path, name)


def test_no_room_is_imported_by_its_bare_name():
    """From the root that would be a second copy of its modules."""
    for path in ROOT.rglob("*.py"):
        if not {".venv", ".venv-bench", "build", ".types"} & set(path.relative_to(ROOT).parts):
            assert not {name.partition(".")[0] for name in imported(path)} & {*ROOMS, *SHARED}, path


def test_generated_modules_import_numba_and_math_only():
    for path in (ROOT / "generated").glob("*.py"):
        assert set(imports(path)) <= {"numba", "math"}, path


def test_running_imports_no_derivation_and_deriving_no_compiler():
    for module, absent in (("qddot.runner.command", "sympy"), ("qddot.codegen.command", "numba"), ("qddot", "numpy")):
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
            calls = {
                node.func.id
                for node in ast.walk(ast.parse(path.read_text()))
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
            }
            assert not calls & {"eval", "exec"}, path
