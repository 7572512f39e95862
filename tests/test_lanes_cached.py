"""Batches of a second process compile nothing."""

import os
import shutil
import subprocess
import sys

import pytest
from commands import ROOT, command

SECOND_PROCESS = """
import numba, numpy, qddot
from numba.core import event

numba.njit(lambda x: x)(1)  # numba's own first compilation
names = []
class Listener(event.Listener):
    def on_start(self, started):
        names.append(started.data["dispatcher"].py_func.__qualname__)
    def on_end(self, ended):
        pass
event.register("numba:compile", Listener())
from qddot.runner.lanes import adaptive, fixed, taylor
from qddot.runner.exact.batch import _compiled_runs
from qddot.runner.methods import find_method
model, at = qddot.load("quarter_car"), numpy.arange(40.0)
road = qddot.signal.table(at - 9, numpy.sin(at), "cubic")
for method in ("rk4", "dop853", "taylor", "exact"):
    step = {"step": 1e-3} if method == "rk4" else {}
    given = {"inputs": {"z_r": road}, "output_times": 3, "names": ["z_s"], **step}
    qddot.simulate_batch(model, (0, 0.1), method=method, runs=9, **given)
pair = find_method("dop853").pair
by_steps = fixed.compiled_loop("rk4", 4, "advance")
adaptively = adaptive.compiled_loop("dop853", pair.dense.stages, pair.next_slope)
loops = (by_steps, adaptively, taylor.compiled_loop(), _compiled_runs())
print([sum(loop.stats.cache_hits.values()) for loop in loops], names)
"""


@pytest.fixture(scope="module")
def first():
    """What a process says after which all is compiled."""
    return command(code=SECOND_PROCESS)


def test_a_second_process_compiles_nothing(first):
    """Loops, what they call by address, the lane kernel and the exact batch come from the cache, in every process."""
    assert first.returncode == 0, first.stderr
    assert command(code=SECOND_PROCESS).stdout.strip() == "[1, 1, 1, 1] []"


@pytest.mark.usefixtures("first")
def test_a_copy_of_the_same_source_takes_what_was_compiled(tmp_path):
    """Where NUMBA_CACHE_DIR leads both to the same folder: loops, not the kernels, which are a module's own."""
    copy = tmp_path / "qddot"
    left_out = shutil.ignore_patterns(
        *(".venv*", ".git", "*.nb[ci]*", "*.pyc.*", "results", ".*_cache", ".hypothesis", "docs", "tests")
    )
    shutil.copytree(ROOT, copy, symlinks=True, ignore=left_out)
    environment = {"PYTHONPATH": str(copy / ".types"), "NUMBA_CACHE_DIR": str(ROOT / "runner" / "__pycache__")}
    done = subprocess.run(
        [sys.executable, "-P", "-c", SECOND_PROCESS],
        capture_output=True,
        text=True,
        cwd=copy,
        check=True,
        env={**os.environ, **environment},
    )
    loops, names = done.stdout.strip().split("] ")
    assert loops == "[1, 1, 1, 1"
    assert "run_slice" not in names and "restart" not in names and "read_inputs" not in names
