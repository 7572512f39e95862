"""Interleaved repeats and their statistics, and what the machine can do at best."""

import gc
import math
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np

#: A contender whose counted turns took more than so many seconds together is not repeated any more.
PATIENCE = 10.0
#: Seconds that a contender has in a turn, in which it may run more than once.
TURN = 0.02


@dataclass(frozen=True)
class Timing:
    """Seconds of one contender: least and median of its repeats, NaN for one that does not take part.

    note: what else there is to know. error: of its results. share: of the peak of dgemm on as many threads.
    """

    name: str
    least: float = np.nan
    median: float = np.nan
    note: str = ""
    error: float | None = None
    share: float | None = None


@dataclass(frozen=True)
class Table:
    """Contenders for one thing. per: what the seconds are those of, "call" or one "run" of a batch."""

    title: str
    rows: tuple[Timing, ...]
    per: str = "call"

    def took_part(self, *, ours: bool) -> list[Timing]:
        """The rows of qddot, or of the other tools, that took part."""
        return [row for row in self.rows if math.isfinite(row.least) and row.name.startswith("qddot") is ours]


def interleaved(contenders: Mapping[str, Callable[[], object]], repeats: int, *, warm: bool = False) -> list[Timing]:
    """Time callables in turn, A B C A B C ..., after one turn that does not count unless they are warm already.

    Who is quick goes on for `TURN` seconds: after a slow one, the first call finds cold caches. What is there before
    them is looked through for cycles once, not by chance in one of them.
    """
    seconds: dict[str, list[float]] = {name: [] for name in contenders}
    gc.collect()
    gc.freeze()
    for turn in range(warm, repeats + 1):
        for name, run in contenders.items():
            if sum(seconds[name]) > PATIENCE:
                continue
            begin = start = time.perf_counter()
            while start < begin + TURN or start == begin:
                run()
                end = time.perf_counter()
                if turn:
                    seconds[name].append(end - start)
                start = end
    gc.unfreeze()
    return [Timing(name, min(each), median(each)) for name, each in seconds.items()]


def machine() -> str:
    """The processor and the number of cores, as the system names them."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        model = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
        flags = next((line for line in lines if line.startswith("flags")), "")
        cores = sum(line.startswith("processor") for line in lines)
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
    wide = " (AVX-512)" if "avx512f" in flags else " (AVX2)" if "avx2" in flags else ""
    return f"{model}{wide}, {cores} cores, Python {platform.python_version()}"


def dgemm_peak(threads: int) -> float:
    """Floating-point operations a second of NumPy's BLAS on so many threads, in a process of its own."""
    names = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
    environment = os.environ | dict.fromkeys(names, str(threads))
    command = [sys.executable, "-c", _DGEMM]
    return float(subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout)


_DGEMM = """
import time
import numpy as np

n, best = 1500, float("inf")
a, b = np.random.default_rng(0).random((2, n, n))
for _ in range(10):
    start = time.perf_counter()
    a @ b
    best = min(best, time.perf_counter() - start)
print(2 * n**3 / best)
"""
