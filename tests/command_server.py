"""A process that has loaded what commands load, and forks one for each command that it is sent: see `commands`."""

import gc
import importlib
import json
import os
import pkgutil
import sys
import threading

#: What commands load when they need it, beside their own modules.
_LOADED = (
    *("jinja2", "latex2mathml.converter", "matplotlib.backends.backend_agg", "matplotlib.figure", "netCDF4", "pint"),
    *("rich.progress", "rich.table", "symengine", "sympy", "xarray", "zarr"),
    *("numba.np.arraymath", "scipy.integrate", "scipy.linalg", "scipy.optimize", "scipy.sparse.linalg"),
)
#: Of these packages all modules: those of commands, and of the rooms behind them.
_ROOMS = ("commands", "runner", "codegen", "model", "paper", "units")


def _load() -> None:
    """Import only, and start no thread: what is forked would have none of them."""
    from qddot.command_line import _start_quickly

    _start_quickly()
    for name in _LOADED:
        importlib.import_module(name)
    for room in _ROOMS:
        package = importlib.import_module(f"qddot.{room}")
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            importlib.import_module(module.name)
    assert threading.active_count() == 1, threading.enumerate()
    gc.collect()
    gc.freeze()


def _become(words: list[str], cwd: str, environment: dict[str, str], streams: list[str]) -> None:
    """Make the forked process what `python -m qddot` makes of one: its arguments, folder, environment and streams."""
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["qddot", *words]
    sys.path[0] = cwd
    for stream, path in enumerate([os.devnull, *streams]):
        opened = os.open(path, os.O_RDWR)
        os.dup2(opened, stream)
        os.close(opened)


def _serve() -> None:
    """Fork for each line that is read, tell how that ended and how long a processor took; return in what is forked."""
    while line := sys.stdin.readline():
        forked = os.fork()
        if not forked:
            _become(**json.loads(line))
            return
        _, status, usage = os.wait4(forked, 0)
        print(json.dumps([os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime]), flush=True)
    raise SystemExit


if __name__ == "__main__":
    _load()
    _serve()
    from qddot.command_line import main

    main()
