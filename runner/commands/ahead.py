"""What a first run needs last, compiled beside it by another process from the start: a second core takes a third."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np

from qddot.runner.dense.extremes import extremes
from qddot.runner.dense.output import compiled_extremes
from qddot.runner.frame.step_end import FINISH, finish
from qddot.runner.inputs.reader import sample, write_samples
from qddot.runner.inputs.signal import stack
from qddot.runner.machine.compiled import cache_directory
from qddot.runner.machine.kept import Cache
from qddot.runner.machine.places import NAMED
from qddot.runner.machine.pointers import pointer
from qddot.runner.report.background import end_process, leave_when_told, start_process
from qddot.runner.workers import cores


@contextmanager
def compiling_ahead() -> Iterator[None]:
    """Within the block another process compiles what runs of all methods need last, where that has not been compiled.

    It does so on a core of its own, or not at all.
    """
    beside = _begun()
    if beside is None:
        yield
        return
    try:
        with Cache.elsewhere(lambda: beside.poll() is None, (finish.py_func, write_samples.py_func, extremes)):
            yield
    finally:
        end_process(beside)


def _begun() -> "subprocess.Popen[bytes] | None":
    """The other process; None where there is nothing for it to do, or no place for it or for what it compiles."""
    folder = cache_directory()
    if folder is None or cores() < 2 or any(folder.glob(f"*/*.{extremes.__name__}-*.nbi")):
        return None
    with suppress(OSError):  # this one compiles all of it, then
        return start_process(
            __name__, {NAMED: str(folder.parent)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
    return None


def main() -> None:
    """Compile that, into the folder that the environment names."""
    leave_when_told()
    pointer(finish, FINISH, "finish")
    sample(stack([], []), np.zeros(0), np.zeros((0, 0)))
    compiled_extremes()
