"""What models of any size cost before their first run: processor seconds, files and memory over n, with exponents.

`python -m benchmarks.size MODEL N` measures one, cold, in a process of its own, and writes a line of JSON.
"""

import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path

from benchmarks.contest import say
from benchmarks.timing import Table, Timing

#: Numbers of links, of masses and of wheels, and of those that take seconds.
SIZES = {"pendulum": (8, 16, 32, 64), "chain": (10, 100, 300, 1000), "carrier": (4, 8, 16)}
QUICK = {"pendulum": (4, 8), "chain": (10, 40), "carrier": (2, 4)}
#: Where the models are that are none of the house's own.
HOMES = {"carrier": "benchmarks.cases"}
#: Seconds that one may take.
LIMIT = 900


def groups(quick: bool) -> Iterator[Table]:
    """A table a model."""
    for model, sizes in (QUICK if quick else SIZES).items():
        yield Table(f"{model}: generate, compile rhs and Jacobian, first calls; cold", tuple(_rows(model, sizes)))


def _rows(model: str, sizes: Sequence[int]) -> Iterator[Timing]:
    before: tuple[int, float] | None = None
    for n in sizes:
        say(f"  {model} {n}")
        try:
            found = _in_a_process(model, n)
        except subprocess.TimeoutExpired:
            yield Timing(f"{model} {n}", note=f"stopped after {LIMIT} s")
            return
        total = found["generate"] + found["rhs"] + found["jacobian"]
        parts = ", ".join(f"{part} {found[part]:.1f} s" for part in ("generate", "rhs", "jacobian"))
        note = f"{parts}; {found['module']:.0f} kB and {found['tex']:.0f} kB of text; {found['memory']:.0f} MB"
        if before is not None:
            note += f"; exponent {math.log(total / before[1]) / math.log(n / before[0]):.1f}"
        yield Timing(f"{model} {n}", total, total, note)
        before = n, total


def _in_a_process(model: str, n: int) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "benchmarks.size", model, str(n)]
        environment = os.environ | {"NUMBA_CACHE_DIR": folder}
        done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True, timeout=LIMIT)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def measured(model: str, n: int) -> dict[str, float]:
    """Processor seconds of generation and of each kernel until its first call is done, kB of text, MB of memory."""
    import numpy as np  # noqa: PLC0415 - what is imported where it is used is not counted before

    from qddot.codegen.generate import generate  # noqa: PLC0415

    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        home = import_module(f"{HOMES.get(model, 'qddot.model')}.{model}")
        file = generate(home.system(n), folder)
        found["generate"] = time.process_time() - start + resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        found["module"], found["tex"] = (Path(file).with_suffix(end).stat().st_size / 1e3 for end in (".py", ".tex"))
        from qddot.runner.load import load  # noqa: PLC0415

        made = load(file)
        x, u, c = np.full(len(made.state_names), 0.1), np.zeros(8), made.constants(made.parameter_values())
        for kernel in ("rhs", "jacobian"):
            start = time.process_time()
            values = np.empty(len(x) if kernel == "rhs" else made.tables.patterns[kernel].entries)
            made.kernel(kernel)(0.0, x, u, c, values)
            found[kernel] = time.process_time() - start
            if not np.isfinite(values).all():
                raise ArithmeticError(f"{model} {n}: {kernel} is not finite")
    return found | {"memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3}


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], int(sys.argv[2]))))
