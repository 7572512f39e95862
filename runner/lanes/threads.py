"""Packs of lanes over the cores: a thread a pack, all taking their runs from one counter.

The compiled loops release the interpreter's lock. They come back every few milliseconds, and between two slices a
thread sees whether it is to stop: progress, Ctrl-C and wall-clock limits act from the thread that asked for the batch.
"""

from collections.abc import Callable
from dataclasses import dataclass
from threading import Event
from typing import TYPE_CHECKING, Any

from qddot.runner.abi import LANE_KERNELS
from qddot.runner.explicit.step import pair_for
from qddot.runner.frame.step_control import control_for
from qddot.runner.lanes import adaptive, fixed
from qddot.runner.lanes.inputs import LOOK_UP, read_inputs
from qddot.runner.lanes.kernel import form_of, lane_rhs
from qddot.runner.lanes.landing import LAND, land
from qddot.runner.lanes.pack import LANES, make_pack
from qddot.runner.lanes.restart import RESTART, restart
from qddot.runner.lanes.samples import SAMPLE_WITHIN, write_samples_within
from qddot.runner.lanes.settle import SETTLE, settle
from qddot.runner.load import Model
from qddot.runner.machine.memory import address
from qddot.runner.machine.pointers import pointer
from qddot.runner.method import Method
from qddot.runner.options import Options
from qddot.runner.problem import Status
from qddot.runner.workers import cores, on_threads

if TYPE_CHECKING:
    from qddot.runner.lanes.task import Task
    from qddot.runner.machine.series_code import SeriesCode

#: State components advanced by a slice: some milliseconds.
SLICE_WORK = 4_000_000


def run_in_lanes(
    task: "Task",
    threads: int | None,
    progress: Callable[[float], None] | None,
    time_limit: float | None,
) -> None:
    """Integrate all runs in packs of lanes, into the arrays of the task."""
    driver = driver_for(task.method, task.options, task.model)
    batch = task.record(driver.functions)
    n = int(batch["n"])
    most_steps = max(16, SLICE_WORK // (LANES * n * driver.slopes))

    def work(stop: Event) -> None:
        pack, arrays = make_pack(batch, driver.memory or driver.slopes * n)
        if driver.start(batch, pack, *driver.start_arguments):
            while driver.loop(batch, pack, *driver.arguments, most_steps) == Status.RUNNING and not stop.is_set():
                pass
        del arrays  # The loop knew them by address: they had to live until here.

    count = max(1, min(threads or cores(), -(-task.runs // LANES)))
    on_threads(work, count, task.arrays["status"], progress, time_limit)


@dataclass(frozen=True, eq=False)
class Driver:
    """A method's compiled start and loop, their arguments between the pack and the number of steps, and its slopes.

    functions: addresses of what the loop calls, compiled once for all methods. keep: what the arguments point into.
    memory: rows that a pack needs where they are not those of slopes.
    """

    start: Any
    loop: Any
    start_arguments: tuple[Any, ...]
    arguments: tuple[Any, ...]
    slopes: int
    functions: dict[str, int]
    keep: Any = None
    memory: int = 0


def driver_for(method: Method, options: Options, model: Model) -> Driver:
    """The driver of a method; ValueError where it does not run in lanes."""
    if method.family == "taylor":
        return _taylor(model.lane_series, options)
    tableau, pair = method.tableau, method.pair
    if tableau is None:
        raise ValueError(f"method {method.name!r} does not run in lanes")
    form = form_of(model, method)
    slopes = lane_rhs(model, form), LANE_KERNELS[form]
    if pair is None:
        c, along = tableau.c.copy(), tableau.along
        loop = fixed.compiled_loop(method.name, tableau.stages, form)
        functions = _addresses(rhs=slopes, look_up=(read_inputs, LOOK_UP), settle=(land, LAND))
        weights = address(c), address(along)
        return Driver(fixed.compiled_start(), loop, (), weights, tableau.stages, functions, (c, along))
    coefficients, table = pair_for(pair)
    control = control_for(pair.controller, pair.error_order, options.least_rtol, options.divergence_limit)
    loop = adaptive.compiled_loop(method.name, pair.dense.stages, pair.next_slope)
    longest = float(pair.longest_step)
    arguments = (coefficients, control, longest)
    functions = _addresses(
        rhs=slopes,
        look_up=(read_inputs, LOOK_UP),
        sample=(write_samples_within, SAMPLE_WITHIN),
        settle=(settle, SETTLE),
        restart=(restart, RESTART),
    )
    return Driver(adaptive.compiled_start(), loop, (longest,), arguments, pair.dense.stages, functions, table)


def _taylor(code: "SeriesCode", options: Options) -> Driver:
    """The driver of Taylor's method for the series of a model in lanes."""
    from qddot.runner.lanes import taylor  # noqa: PLC0415 - what it imports is compiled, and most batches need none
    from qddot.runner.lanes.series import series_for  # noqa: PLC0415

    series, arrays = series_for(code, options.least_rtol)
    loop, arguments, order = taylor.compiled_loop(), (series,), int(series["order"])
    functions = _addresses(look_up=(read_inputs, LOOK_UP))
    memory = -(-code.memory.size // LANES)
    return Driver(taylor.compiled_start(), loop, arguments, arguments, order, functions, (code, arrays), memory)


def _addresses(**functions: tuple[Any, Any]) -> dict[str, int]:
    return {name: pointer(function, signature, name) for name, (function, signature) in functions.items()}
