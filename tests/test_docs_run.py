"""The pages that teach are typed as they stand: files are written, Python is run, what it prints is compared."""

import contextlib
import io
import re
import shlex
import subprocess
import sys

import pytest
from pages import ROOT, blocks_of

PAGES = (
    "docs/tutorial.md",
    "docs/parts.md",
    "docs/analysis.md",
    "docs/from_matlab.md",
    "docs/from_sympy.md",
    "docs/python.md",
    "docs/events.md",
)


def _command(line, folder):
    done = subprocess.run(
        [sys.executable, "-m", *shlex.split(line)], cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_tells_to_type_does_what_it_shows(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "studies").symlink_to(ROOT / "studies")
    names, printed, compared = {"__name__": "page"}, "", 0
    for block in blocks_of(page):
        if block.file:
            (tmp_path / block.file).write_text(block.text)
        elif block.language == "console":
            for command, shown in re.findall(r"^\$ (.*)\n((?:[^$].*\n)*)", block.text, re.MULTILINE):
                assert _command(command, tmp_path) == shown
                compared += 1
        elif block.language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as told:
                exec(compile(block.text, page, "exec"), names)
            printed = told.getvalue()
        elif block.language == "text":
            assert printed == block.text
            compared += 1
    assert compared or page == "docs/python.md"


def test_the_tutorials_studies_run(tmp_path):
    for block in blocks_of("docs/tutorial.md"):
        if block.file:
            (tmp_path / block.file).write_text(block.text)
    _command("qddot generate swing.py --into kernels", tmp_path)
    assert "wrote results/push.png" in _command("qddot run push.toml", tmp_path)
    changed = _command('qddot run push.toml --no-figure --set parameters.L="1.1m" --set inputs.F.peak=60', tmp_path)
    assert "wrote results/push" in changed
    assert "1000 of 1000 runs, 0 failed" in _command("qddot batch absorber.toml", tmp_path)
    assert "wrote results/absorber_row=300.nc" in _command("qddot run absorber.toml --row 300 --no-figure", tmp_path)
    assert "wrote " in _command("qddot plot results/absorber.zarr", tmp_path)
