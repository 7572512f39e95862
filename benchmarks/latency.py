"""What a user waits for: whole commands in processes of their own."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.contest import say
from benchmarks.timing import Table, Timing, interleaved

ROOT = Path(__file__).parent.parent


def groups(quick: bool) -> Iterator[Table]:
    """Warm starts of the command line, of which the first, which may compile, is not counted; and cold ones."""
    with tempfile.TemporaryDirectory() as folder:
        commands = {
            "qddot --help": ("--help",),
            "qddot generate --check m113": ("generate", "m113", "--check"),
            "qddot generate --check, all models": ("generate", "--check"),
            "qddot run studies/one_shot.toml": ("run", "studies/one_shot.toml", "--into", folder),
            "the same without the figure": ("run", "studies/one_shot.toml", "--into", folder, "--no-figure"),
        }
        runs = {name: lambda arguments=arguments: _qddot(*arguments) for name, arguments in commands.items()}
        say("  warm commands")
        yield Table("Warm commands", tuple(interleaved(runs, 2 if quick else 5)))
    yield Table("Cold commands, once", tuple(_cold()))


def _cold() -> list[Timing]:
    """What a fresh clone waits for, and a changed model, in a copy without caches."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "qddot"
        left_out = ("__pycache__", ".git", ".venv*", ".*_cache", ".hypothesis", ".qddot", "results", "build", "docs")
        shutil.copytree(ROOT, copy, symlinks=True, ignore=shutil.ignore_patterns(*left_out))
        first = _timed("first qddot run: compiles drivers and kernels", lambda: _qddot(*RUN, cwd=copy))
        model = copy / "model" / "m113.py"
        model.write_text(model.read_text("utf-8").replace("M113", "M113, changed", 1), "utf-8")
        again = _timed("model changed: qddot generate", lambda: _qddot("generate", "m113", cwd=copy))
        run = _timed("then qddot run: compiles its kernels", lambda: _qddot(*RUN, cwd=copy))
    return [first, again, run]


RUN = ("run", "studies/one_shot.toml")


def _timed(name: str, run: Callable[[], None]) -> Timing:
    say(f"  {name}")
    start = time.perf_counter()
    run()
    seconds = time.perf_counter() - start
    return Timing(name, seconds, seconds)


def _qddot(*arguments: str, cwd: Path = ROOT) -> None:
    """A command of the qddot that lies there: what is installed elsewhere is compiled already."""
    command = [sys.executable, "-P", "-m", "qddot", *arguments]
    there = {"PYTHONPATH": str(cwd / ".types"), "PYTHONDONTWRITEBYTECODE": ""}  # as a user's Python, it keeps bytecode
    subprocess.run(command, cwd=cwd, env=os.environ | there, check=True, capture_output=True)
