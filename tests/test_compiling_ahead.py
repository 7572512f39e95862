"""What a first run needs last is compiled beside it, by another process: waited for, never in the way."""

import pytest
from commands import command

from qddot.runner.workers import cores

#: Says what this process itself compiles; `begun` are the others, by its arguments.
HEARD = """
import subprocess, sys, time
from numba.core import event
from qddot.runner.commands import ahead
from qddot.runner.dense.output import compiled_extremes
from qddot.runner.machine.compiling import compiled_for, working_time

class Heard(event.Listener):
    here = []
    def on_start(self, event):
        self.here.append(event.data["dispatcher"].py_func.__name__)
    def on_end(self, event):
        pass

event.register("numba:compile", Heard())
start, begun = ahead.start_process, []
ahead.start_process = lambda *arguments, **pipes: begun.append(start(*arguments, **pipes)) or begun[-1]
"""
WAITED_FOR = """
since, worked = time.perf_counter(), working_time()
with ahead.compiling_ahead():
    compiled_extremes()
    whole = time.perf_counter() - since
print("extremes" in Heard.here, len(begun), all(each.poll() is not None for each in begun))
print(working_time() - worked < 0.5 * whole if begun else "at hand")
"""
LOST = """
failing = [sys.executable, "-c", "1/0"]
ahead.start_process = lambda *arguments, **pipes: subprocess.Popen(failing, stderr=subprocess.DEVNULL)
with ahead.compiling_ahead():
    compiled_extremes()
print("extremes" in Heard.here)
"""
NONE = """
def refused(*arguments, **pipes):
    raise BlockingIOError("no process to be had")
ahead.start_process = refused
with ahead.compiling_ahead():
    compiled_extremes()
print("extremes" in Heard.here)
"""
LEFT = """
with ahead.compiling_ahead():
    time.sleep(1.0)
print(begun[0].poll() is not None)
"""
two_cores = pytest.mark.skipif(cores() < 2, reason="another process compiles where there is a core for it")


@two_cores
def test_what_another_process_compiles_is_waited_for_and_counts_as_compiling(tmp_path):
    first, second = (command(code=HEARD + WAITED_FOR, afresh=True, NUMBA_CACHE_DIR=tmp_path) for _ in range(2))
    assert first.stdout == "False 1 True\nTrue\n", first.stderr
    assert second.stdout == "False 0 True\nat hand\n", second.stderr


@two_cores
@pytest.mark.parametrize("way", [LOST, NONE], ids=["fails", "cannot be had"])
def test_where_the_other_process_is_of_no_use_this_one_compiles(tmp_path, way):
    found = command(code=HEARD + way, afresh=True, NUMBA_CACHE_DIR=tmp_path)
    assert found.stdout == "True\n", found.stderr


@two_cores
def test_a_process_that_is_not_waited_for_ends_with_the_run_and_leaves_nothing_half_written(tmp_path):
    found = command(code=HEARD + LEFT, afresh=True, NUMBA_CACHE_DIR=tmp_path)
    assert found.stdout == "True\n", found.stderr
    assert {path.suffix for path in tmp_path.rglob("*") if path.is_file()} <= {".nbi", ".nbc"}
