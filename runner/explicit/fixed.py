"""Fixed-step marching: plans the steps and the saved points of a run, and drives the compiled loop of `march`."""

from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner.explicit.march import MARCH, advance, steps_of
from qddot.runner.explicit.step import PAIR, tableau_for
from qddot.runner.explicit.workspace import SPACE, space_for, state_of
from qddot.runner.inputs.instants import ROUNDING, between
from qddot.runner.inputs.short import with_stops
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.compiling import working_time
from qddot.runner.machine.memory import BLOCK, address, record
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Statistics, Status, Trajectory
from qddot.runner.slices import drive

if TYPE_CHECKING:
    from qddot.runner.methods import Method

#: Points saved by default, about.
DEFAULT_POINTS = 5000
#: State components advanced per slice: some milliseconds of work for a generated model.
SLICE_WORK = 1_000_000


@cache
def _compiled_advance() -> Any:
    records = (typeof(record(fields)) for fields in (SPACE, PAIR, MARCH))
    return compiled(types.int64(*records, types.int64), _nrt=False, nogil=True)(advance)


def integrate(problem: Problem, method: "Method", options: Options) -> Trajectory:
    """March `problem` with options.step; saves at options.output_times or every options.every-th grid point.

    Raises ValueError where the step is missing, does not advance the time, or output times lie outside the span.
    """
    if method.tableau is None:
        raise ValueError(f"method {method.name!r} has no tableau to march")
    start, stages = working_time(), method.tableau.stages
    plan = _plan(problem, options, method.name)
    space, space_arrays = space_for(problem, np.zeros(1), np.zeros(1))
    tableau, _ = tableau_for(method.tableau)
    march, arrays = _march(plan, len(problem.initial_state), options.divergence_limit)
    _save_if_new(march, arrays, problem.initial_state)
    most_steps = max(16, SLICE_WORK // (BLOCK * int(space["blocks"]) * stages))
    status = drive(
        partial(_compiled_advance(), space, tableau, march, most_steps),
        fraction_done=lambda: float((march["now"] - plan.t0) / (plan.t1 - plan.t0)),
        progress=options.progress,
        time_limit=options.time_limit,
    )
    _save_if_new(march, arrays, state_of(space, space_arrays))
    return _trajectory(march, arrays, status, stages, working_time() - start)


@dataclass(frozen=True, eq=False)
class Plan:
    """Where the steps end: grid points t0 + k*step for k = 1..grid_points - 1, then t1; and the stops between them.

    stops (m,) rising times within (t0, t1), save_at_stop (m,) whether the state is saved there; every: grid points
    between two saved ones, 0 for none.
    """

    t0: float
    t1: float
    step: float
    grid_points: int
    every: int
    stops: NDArray[np.float64]
    save_at_stop: NDArray[np.int64]


def _plan(problem: Problem, options: Options, name: str) -> Plan:
    t0, t1, step = float(problem.t0), float(problem.t1), options.step
    if step is None:
        raise ValueError(f"method {name!r} marches with a constant step: give step=, such as step=1e-3")
    if step < 64 * np.spacing(max(abs(t0), abs(t1))):
        raise ValueError(f"step is {step}, too small to advance a time as large as {max(abs(t0), abs(t1))}")
    grid_points = int(steps_of.py_func(t0, t1, step))
    outputs = _requested(options.output_times, t0, t1)
    times = with_stops(problem.inputs, step)
    breakpoints = _on_grid(_apart(between(times, t0, t1), outputs), t0, step)
    stops = np.concatenate([outputs, breakpoints])
    order = np.argsort(stops, kind="stable")
    every = 0 if options.output_times is not None else options.every or -(-grid_points // DEFAULT_POINTS)
    return Plan(t0, t1, float(step), grid_points, every, stops[order], (order < len(outputs)).astype(np.int64))


def _requested(times: NDArray[np.float64] | None, t0: float, t1: float) -> NDArray[np.float64]:
    """The output times strictly within the span; its ends are saved anyway."""
    if times is None:
        return np.empty(0)
    outside = times[(t0 - times > ROUNDING * abs(t0)) | (times - t1 > ROUNDING * abs(t1))]
    if outside.size:
        raise ValueError(f"output time {outside[0]} is outside the span from {t0} to {t1}")
    return between(times, t0, t1)


def _apart(breakpoints: NDArray[np.float64], outputs: NDArray[np.float64]) -> NDArray[np.float64]:
    """The breakpoints that are no output time: there a run stops anyway."""
    if not outputs.size:
        return breakpoints
    after = np.searchsorted(outputs, breakpoints)
    gaps = [np.abs(breakpoints - outputs[np.clip(after + side, 0, len(outputs) - 1)]) for side in (-1, 0)]
    return breakpoints[np.minimum(*gaps) > ROUNDING * np.abs(breakpoints)]


def _on_grid(breakpoints: NDArray[np.float64], t0: float, step: float) -> NDArray[np.float64]:
    """The breakpoints, those that are a grid point's time as the grid counts it."""
    grid = t0 + np.round((breakpoints - t0) / step) * step
    return np.where(np.abs(breakpoints - grid) > ROUNDING * np.abs(breakpoints), breakpoints, grid)


def _march(plan: Plan, n: int, limit: float) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """The march at its start, and the arrays it points into."""
    room = 3 + int(plan.save_at_stop.sum()) + (plan.grid_points // plan.every if plan.every else 0)
    arrays: dict[str, NDArray[Any]] = {
        "stops": plan.stops,
        "save_at_stop": plan.save_at_stop,
        "saved_t": np.empty(room),
        "saved_x": np.empty((room, n)),
    }
    march = record(
        MARCH,
        **{name: address(array) for name, array in arrays.items()},
        n_stops=len(plan.stops),
        grid_points=plan.grid_points,
        every=plan.every,
        room=room,
        failed_state=-1,
        restart=1,
        t0=plan.t0,
        t1=plan.t1,
        step=plan.step,
        now=plan.t0,
        limit=limit,
        failed_at=np.nan,
    )
    return march, arrays


def _save_if_new(march: np.void, arrays: dict[str, NDArray[Any]], x: NDArray[np.float64]) -> None:
    place = int(march["saved"])
    if place == 0 or arrays["saved_t"][place - 1] < march["now"]:
        arrays["saved_t"][place], arrays["saved_x"][place] = march["now"], x
        march["saved"] = place + 1


def _trajectory(
    march: np.void, arrays: dict[str, NDArray[Any]], status: Status, stages: int, wall_time: float
) -> Trajectory:
    """The saved points; a run that was cut short ends with its last state."""
    points, steps = int(march["saved"]), int(march["steps"])
    return Trajectory(
        t=arrays["saved_t"][:points].copy(),
        states=arrays["saved_x"][:points].copy(),
        status=status,
        statistics=Statistics(steps=steps, evaluations=steps * stages, wall_time=wall_time),
        failed_at=float(march["failed_at"]),
        failed_state=int(march["failed_state"]),
    )
