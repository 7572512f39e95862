"""`command`: the command line as a person uses it, in a process of its own for each command.

Most of what a command's process takes is loading what it needs. So a process beside the tests loads that once, and
forks one for each command, see `command_server`. Where the environment is not the one it was started in, a process
starts from nothing: much of the environment is read as modules are loaded.
"""

import atexit
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from permissions import give_up

ROOT = Path(__file__).parent.parent
#: Seconds that a command may take.
_PATIENCE = 300.0
#: How names begin of what pytest says in the environment of each test, and of what qddot and Dask say there.
_PASSING = ("PYTEST_", "PYDANTIC_", "__DASK_", "MALLOC_", "OMP_", "MKL_", "OPENBLAS_", "PYTHONHASHSEED")
#: What `python -m qddot` does.
_COMMAND_LINE = "from qddot.command_line import main; main()"


@dataclass(frozen=True)
class Done:
    """How a command ended: its status, what it wrote, and the seconds of a processor that it took."""

    returncode: int
    stdout: str
    stderr: str
    seconds: float


def command(*arguments, cwd=ROOT, afresh=False, plain=False, code=_COMMAND_LINE, **environment):
    """Run `qddot` with these arguments in a folder. `afresh`: in a process that starts from nothing.

    plain: as a user to whom permissions apply, also where tests run as root. code: what Python does in place of
    `qddot`. environment: what is in it beside that of the tests; then the process starts from nothing as well.
    """
    words = [*map(str, arguments)]
    given = {**os.environ, **{name: str(value) for name, value in environment.items()}}
    server = None if afresh or environment else _server()
    with tempfile.TemporaryDirectory() as folder:
        streams = [Path(folder, "stdout"), Path(folder, "stderr")]
        for stream in streams:
            stream.touch()
        if server and _lasting(given) == server.environment:
            status, seconds = server.run(words, Path(cwd), given, streams, plain, code)
        else:
            status, seconds = _run(words, cwd, given, streams, plain, code)
        return Done(status, *(stream.read_text() for stream in streams), seconds)


def plainly(*arguments, **how):
    """`command` as a user to whom permissions apply."""
    return command(*arguments, plain=True, **how)


def _run(words, cwd, environment, streams, plain, code):
    line = [sys.executable, *(["-m", "qddot"] if code is _COMMAND_LINE else ["-c", code]), *words]
    before = os.times()
    with streams[0].open("wb") as out, streams[1].open("wb") as err:
        done = subprocess.run(
            line, cwd=cwd, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=err, timeout=_PATIENCE,
            check=False, preexec_fn=give_up if plain else None,
        )  # fmt: skip
    after = os.times()
    return done.returncode, sum(after[2:4]) - sum(before[2:4])


class _Server:
    """The process that forks those of commands."""

    def __init__(self):
        self.environment = _lasting(os.environ)
        self._process = subprocess.Popen(
            [sys.executable, Path(__file__).with_name("command_server.py")],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT, start_new_session=True,
        )  # fmt: skip
        atexit.register(self._process.communicate)

    def run(self, words, cwd, environment, streams, plain, code):
        request = {"words": words, "cwd": str(cwd.absolute()), "environment": environment, "plain": plain, "code": code}
        self._process.stdin.write(json.dumps({**request, "streams": [*map(str, streams)]}) + "\n")
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], _PATIENCE)[0]:
            os.killpg(self._process.pid, signal.SIGKILL)
            _server.cache_clear()
            raise subprocess.TimeoutExpired(["qddot", *words], _PATIENCE)
        return json.loads(self._process.stdout.readline())


_server = cache(_Server)


def _lasting(environment):
    """The environment without what is said in it while tests run."""
    return {name: value for name, value in environment.items() if not name.startswith(_PASSING)}
