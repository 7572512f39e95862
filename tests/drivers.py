"""What most test files need compiled, shared out between the processes of a session as it starts.

Each process would compile all of it otherwise, at about the same time and so in vain.
"""

import time
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path

import qddot

#: Test files from which on the drivers of all methods are needed, and seconds that a process waits for the others.
MANY, PATIENCE = 40, 240.0


def _run(name, method, **options):
    solution = qddot.simulate(qddot.load(name), (0.0, 0.1), method=method, **options)
    solution.at(0.05)
    solution.extremes(solution.state_names[0])


def _batch(method, **options):
    model = qddot.load("quarter_car")
    qddot.simulate_batch(model, (0.0, 0.1), runs=9, method=method, output_times=2, **options)


#: The longest first, so that the last ones end together.
TASKS = {
    "ode15s": lambda: _run("quarter_car", "ode15s"),
    "exact": lambda: _run("quarter_car", "exact"),
    "vern7": lambda: _run("quarter_car", "vern7"),
    "rodas5p": lambda: _run("quarter_car", "rodas5p"),
    "constraints": lambda: _run(
        "four_bar", "rk4", step=0.01, initial={"theta_1": 0.5}, guess={"theta_2": 0.5, "theta_3": 1.5}
    ),
    "rk4": lambda: _run("quarter_car", "rk4", step=0.01),
    "taylor": lambda: _run("double_pendulum", "taylor"),
    "adaptive lanes": lambda: _batch("vern7"),
    "lanes": lambda: _batch("rk4", step=0.01),
    "taylor lanes": lambda: _batch("taylor"),
}


#: Modules that compile functions as they are imported, which test files do as they are collected.
IMPORTS = {
    name: partial(import_module, name) for name in ("qddot.runner.machine.constrained", "qddot.runner.batch.block")
}


def compile_a_share(folder: Path, tasks: Mapping[str, Callable[[], object]]) -> None:
    """Do what no other process has taken, then wait until all is done; folder: of all processes of a session."""
    folder.mkdir(exist_ok=True)
    for name, task in tasks.items():
        try:
            (folder / f"{name} taken").touch(exist_ok=False)
        except FileExistsError:
            continue
        try:
            task()
        finally:
            (folder / f"{name} done").touch()
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and not all((folder / f"{name} done").exists() for name in tasks):
        time.sleep(0.1)
