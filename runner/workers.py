"""Threads that integrate many runs: compiled loops release the interpreter's lock and look at times whether to stop.

Progress, Ctrl-C and wall-clock limits act from the thread that asked for the runs, between two looks.
"""

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from threading import Event

import numpy as np
from numpy.typing import NDArray

from qddot.runner.problem import Status

#: Seconds between two looks at what the threads have done.
LOOK = 0.05


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_threads(
    work: Callable[[Event], None],
    count: int,
    status: NDArray[np.int64],
    progress: Callable[[float], None] | None,
    time_limit: float | None,
) -> None:
    """Let `count` threads do `work`, which is to return soon once the event it is given is set. Raises what one raises.

    status (runs,): filled by the threads; runs that they leave as RUNNING become TIME_LIMIT or INTERRUPTED. progress is
    told the part of the runs that are done.
    """
    stop, started, why = Event(), time.perf_counter(), Status.INTERRUPTED

    def tell() -> None:
        if progress is not None:
            progress(np.count_nonzero(status) / max(1, len(status)))

    with ThreadPoolExecutor(count) as pool:
        futures = [pool.submit(work, stop) for _ in range(count)]
        try:
            while wait(futures, timeout=LOOK).not_done:
                tell()
                if time_limit is not None and time.perf_counter() - started >= time_limit:
                    why = Status.TIME_LIMIT
                    stop.set()
        except KeyboardInterrupt:
            stop.set()
    tell()
    for future in futures:
        future.result()
    status[status == int(Status.RUNNING)] = int(why)
