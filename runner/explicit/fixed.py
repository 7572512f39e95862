"""Fixed-step marching: plans the steps and the saved points of a run, and drives the compiled loop of `march`."""

import time
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from runner.explicit.march import FAILED_AT, FAILED_STATE, NOW, SAVED, SNAP, STEPS, March, Plan, compiled_advance
from runner.inputs.reader import reader_for
from runner.options import Options
from runner.problem import Problem, Statistics, Status, Trajectory
from runner.slices import drive

if TYPE_CHECKING:
    from runner.methods import Method

#: Points saved by default, about.
DEFAULT_POINTS = 5000
#: State components advanced per slice: some milliseconds of work for a generated model.
SLICE_WORK = 1_000_000


def integrate(problem: Problem, method: "Method", options: Options) -> Trajectory:
    """March `problem` with options.step; saves at options.output_times or every options.every-th grid point.

    Raises ValueError where the step is missing, does not advance the time, or output times lie outside the span.
    """
    tableau = method.tableau
    if tableau is None:
        raise ValueError(f"method {method.name!r} has no tableau to march")
    plan = _plan(problem, options, method.name)
    march = _march(problem, plan, tableau.stages)
    coefficients = [array.flatten() for array in (tableau.A, tableau.b, tableau.c)]
    limit = float(options.divergence_limit)
    arguments = (*coefficients, problem.constants, problem.inputs, problem.n_inputs, plan, march, limit)
    most_steps = max(16, SLICE_WORK // (len(march.x) * tableau.stages))
    loop = compiled_advance(*map(typeof, arguments), types.int64)
    start = time.perf_counter()
    status = drive(
        partial(loop, problem.rhs, *arguments, most_steps),
        fraction_done=lambda: (march.time[NOW] - plan.t0) / (plan.t1 - plan.t0),
        progress=options.progress,
        time_limit=options.time_limit,
    )
    return _trajectory(march, status, tableau.stages, time.perf_counter() - start)


def _plan(problem: Problem, options: Options, name: str) -> Plan:
    t0, t1, step = float(problem.t0), float(problem.t1), options.step
    if step is None:
        raise ValueError(f"method {name!r} marches with a constant step: give step=, such as step=1e-3")
    if step < 64 * np.spacing(max(abs(t0), abs(t1))):
        raise ValueError(f"step is {step}, too small to advance the time from {t0} to {t1}")
    grid_points = max(1, int(np.ceil((t1 - t0) / step - SNAP)))
    outputs = _requested(options.output_times, t0, t1, SNAP * step)
    breakpoints = _apart(problem.inputs.breakpoints, outputs, t0, t1, step)
    stops = np.concatenate([outputs, breakpoints])
    order = np.argsort(stops, kind="stable")
    every = 0 if options.output_times is not None else options.every or -(-grid_points // DEFAULT_POINTS)
    return Plan(t0, t1, float(step), grid_points, every, stops[order], order < len(outputs))


def _requested(times: NDArray[np.float64] | None, t0: float, t1: float, near: float) -> NDArray[np.float64]:
    """The output times strictly within the span; its ends are saved anyway."""
    if times is None:
        return np.empty(0)
    outside = times[(times < t0 - near) | (times > t1 + near)]
    if outside.size:
        raise ValueError(f"output time {outside[0]} is outside the span from {t0} to {t1}")
    return times[(times > t0 + near) & (times < t1 - near)]


def _apart(
    breakpoints: NDArray[np.float64], outputs: NDArray[np.float64], t0: float, t1: float, step: float
) -> NDArray[np.float64]:
    """The breakpoints within the span: on a grid point if next to it, apart from outputs and each other."""
    near = SNAP * step
    inside = breakpoints[(breakpoints > t0 + near) & (breakpoints < t1 - near)]
    grid = t0 + np.round((inside - t0) / step) * step
    inside = np.where(np.abs(inside - grid) > near, inside, grid)
    if outputs.size and inside.size:
        after = np.searchsorted(outputs, inside)
        gaps = [np.abs(inside - outputs[np.clip(after + side, 0, len(outputs) - 1)]) for side in (-1, 0)]
        inside = inside[np.minimum(*gaps) > near]
    return inside[np.diff(inside, prepend=-np.inf) > near]


def _march(problem: Problem, plan: Plan, stages: int) -> March:
    x = np.array(problem.initial_state, dtype=np.float64)
    n, channels = len(x), max(1, len(problem.inputs.first))
    points = 2 + int(plan.save_at_stop.sum()) + (plan.grid_points // plan.every if plan.every else 0)
    march = March(
        counts=np.zeros(5, dtype=np.int64),
        time=np.array([plan.t0, np.nan]),
        x=x,
        x_stage=np.empty(n),
        x_new=np.empty(n),
        slope=np.zeros(n),
        slopes=np.zeros(stages * n),
        u=np.zeros(channels),
        reader=reader_for(problem.inputs),
        saved_t=np.empty(points),
        saved_x=np.empty((points, n)),
    )
    march.counts[FAILED_STATE] = -1
    _save_if_new(march)
    return march


def _save_if_new(march: March) -> None:
    place = march.counts[SAVED]
    if place == 0 or march.saved_t[place - 1] < march.time[NOW]:
        march.saved_t[place], march.saved_x[place] = march.time[NOW], march.x
        march.counts[SAVED] = place + 1


def _trajectory(march: March, status: Status, stages: int, wall_time: float) -> Trajectory:
    """The saved points; a run that was cut short ends with its last state."""
    _save_if_new(march)
    points, steps = int(march.counts[SAVED]), int(march.counts[STEPS])
    return Trajectory(
        t=march.saved_t[:points].copy(),
        states=march.saved_x[:points].copy(),
        status=status,
        statistics=Statistics(steps=steps, evaluations=steps * stages, wall_time=wall_time),
        failed_at=float(march.time[FAILED_AT]),
        failed_state=int(march.counts[FAILED_STATE]),
    )
