"""Imports go one way, the front door is light, and the public names are exactly those it lists."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import qddot

ROOT = Path(__file__).parent.parent

FORBIDDEN = {
    "units": {"numpy", "sympy", "model", "codegen", "generated", "runner", "qddot", "tests"},
    "model": {"pint", "numpy", "scipy", "numba", "jinja2", "symengine", "codegen", "generated", "runner", "qddot"},
    "codegen": {"pint", "numpy", "scipy", "numba", "generated", "runner", "qddot", "tests"},
    "generated": {"model", "codegen", "runner", "qddot", "numpy", "sympy"},
    "runner": {"pint", "sympy", "symengine", "jinja2", "model", "codegen", "qddot", "tests"},
}


def imports(path):
    """Top-level names of everything a file imports, inside functions too."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0]


@pytest.mark.parametrize("room", FORBIDDEN)
def test_no_room_imports_what_it_must_not(room):
    for path in (ROOT / room).rglob("*.py"):
        assert not set(imports(path)) & FORBIDDEN[room], path


def test_generated_modules_import_numba_and_math_only():
    for path in (ROOT / "generated").glob("*.py"):
        assert set(imports(path)) <= {"numba", "math"}, path


def test_running_imports_no_derivation_and_deriving_no_compiler():
    for module, absent in (("runner.command", "sympy"), ("codegen.command", "numba"), ("qddot", "numpy")):
        code = f"import sys, {module}; sys.exit({absent!r} in sys.modules)"
        assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0, module


def test_public_names_are_sorted_exist_and_are_documented():
    assert qddot.__all__ == sorted(set(qddot.__all__))
    for name in qddot.__all__:
        assert getattr(qddot, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'simulte'"):
        qddot.simulte  # noqa: B018


def test_no_file_evaluates_text():
    for room in ("units", "model", "codegen", "runner"):
        for path in (ROOT / room).rglob("*.py"):
            calls = {
                node.func.id
                for node in ast.walk(ast.parse(path.read_text()))
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
            }
            assert not calls & {"eval", "exec"}, path
