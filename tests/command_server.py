"""A process that has loaded what commands load, and forks one for each command that it is sent: see `commands`."""

import atexit
import gc
import importlib
import json
import os
import pkgutil
import sys
import threading

from permissions import give_up

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
    importlib.import_module("numba.core.registry").cpu_target.target_context.refresh()  # what compiles needs it
    compiling = importlib.import_module("qddot.runner.machine.compiling")
    assert threading.active_count() == 1, threading.enumerate()
    compiling._CLOCK.seconds = 0.0  # what is forked has spent no time compiling
    gc.freeze()


def _become(words: list[str], cwd: str, environment: dict[str, str], streams: list[str], plain: bool) -> None:
    """Make the forked process what `python -m qddot` makes of one: its arguments, folder, environment and streams."""
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["qddot", *words]
    sys.path[0] = cwd
    if plain:
        give_up()
    for stream, path in enumerate([os.devnull, *streams]):
        opened = os.open(path, os.O_RDWR)
        os.dup2(opened, stream)
        os.close(opened)


def _serve() -> str:
    """Fork for each line that is read, tell how that ended and how long a processor took; return the forked's code."""
    while line := sys.stdin.readline():
        forked = os.fork()
        if not forked:
            request = json.loads(line)
            code: str = request.pop("code")
            _become(**request)
            return code
        _, status, usage = os.wait4(forked, 0)
        print(json.dumps([os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime]), flush=True)
    raise SystemExit


def _ended(code: str) -> int:
    """Run the forked process's code as its main module, and say with which status it ends."""
    try:
        exec(code, {"__name__": "__main__"})
    except SystemExit as ended:
        if ended.code is None or isinstance(ended.code, int):
            return ended.code or 0
        print(ended.code, file=sys.stderr)
        return 1
    except BaseException:
        sys.excepthook(*sys.exc_info())
        return 1
    return 0


if __name__ == "__main__":
    gc.disable()
    _load()
    given = _serve()
    gc.enable()
    status = _ended(given)
    threading._shutdown()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # to take down what was loaded before the fork would only copy it
