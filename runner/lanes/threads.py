"""Packs of lanes over the cores: a thread a pack, all taking their runs from one counter.

The compiled loops release the interpreter's lock. They come back every few milliseconds, and between two slices a
thread sees whether it is to stop: progress, Ctrl-C and wall-clock limits act from the thread that asked for the batch.
"""

import os
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np

from runner.lanes import fixed
from runner.lanes.pack import make_pack
from runner.memory import address
from runner.problem import Status

if TYPE_CHECKING:
    from runner.lanes.batch import Task

#: State components advanced by a slice: some milliseconds.
SLICE_WORK = 4_000_000
#: Seconds between two looks at what the threads have done.
LOOK = 0.05


def run_in_lanes(
    task: "Task",
    kernel: Any,
    threads: int | None,
    progress: Callable[[float], None] | None,
    time_limit: float | None,
) -> None:
    """Integrate all runs in packs of lanes, into the arrays of the task."""
    batch = task.record(kernel)
    start, advance, arguments, slopes, keep = _driver(task)
    most_steps = max(16, SLICE_WORK // (8 * int(batch["n"]) * slopes))
    stop = Event()

    def work() -> None:
        pack, arrays = make_pack(batch, slopes)
        if start(batch, pack):
            while advance(batch, pack, *arguments, most_steps) == Status.RUNNING and not stop.is_set():
                pass
        del arrays  # The loop knew them by address: they had to live until here.

    count = max(1, min(threads or cores(), -(-task.runs // 8)))
    with ThreadPoolExecutor(count) as pool:
        futures = [pool.submit(work) for _ in range(count)]
        why = _watch(futures, lambda: _done(task), stop, progress, time_limit)
    for future in futures:
        future.result()
    status = task.arrays["status"]
    status[status == int(Status.RUNNING)] = int(why)
    del keep, kernel


def _driver(task: "Task") -> tuple[Any, Any, tuple[int, ...], int, Any]:
    """The compiled start and loop of the task's method, their arguments, how many slopes there are, what must live."""
    tableau = task.method.tableau
    if tableau is None:
        raise ValueError(f"method {task.method.name!r} does not run in lanes")
    c = tableau.c.copy()
    return fixed.compiled_start(), fixed.advance(task.method.name, tableau.stages), (address(c),), tableau.stages, c


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _done(task: "Task") -> float:
    return float(np.count_nonzero(task.arrays["status"])) / task.runs


def _watch(
    futures: list[Future[None]],
    done: Callable[[], float],
    stop: Event,
    progress: Callable[[float], None] | None,
    time_limit: float | None,
) -> Status:
    """Wait for the threads; gives what became of runs that they did not finish."""
    started, why = time.perf_counter(), Status.INTERRUPTED
    try:
        while wait(futures, timeout=LOOK).not_done:
            if progress is not None:
                progress(done())
            if time_limit is not None and time.perf_counter() - started >= time_limit:
                why = Status.TIME_LIMIT
                stop.set()
    except KeyboardInterrupt:
        stop.set()
    if progress is not None:
        progress(done())
    return why
