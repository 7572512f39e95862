"""Processes to which permissions apply, also where tests run as root."""

import ctypes
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent

#: Of Linux: prctl(PR_CAPBSET_DROP), and the rights to pass over permissions and owners.
_DROP, _OVERRIDE = 24, (1, 2, 3)


def _give_up() -> None:
    if os.geteuid() == 0:
        for right in _OVERRIDE:
            ctypes.CDLL(None).prctl(_DROP, right, 0, 0, 0)


def plainly(*arguments, code=None, **environment):
    """Run qddot, or Python code, as a user to whom permissions apply; `cwd` apart, keywords are its environment."""
    folder = environment.pop("cwd", ROOT)
    command = [sys.executable, *(["-c", code] if code else ["-m", "qddot"]), *map(str, arguments)]
    given = {**os.environ, "PYTHONPATH": str(ROOT), **{name: str(value) for name, value in environment.items()}}
    return subprocess.run(
        command, capture_output=True, text=True, cwd=folder, env=given, timeout=300, check=False, preexec_fn=_give_up
    )
