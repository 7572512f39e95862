"""Many runs of one model by one call."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from runner import abi
from runner.checks import unknown
from runner.lanes.kernel import lane_rhs
from runner.lanes.pack import BATCH
from runner.lanes.scalar import run_one_by_one
from runner.lanes.signals import BatchTable, count_runs, stack_runs
from runner.lanes.starts import constants_of, equilibria
from runner.lanes.threads import run_in_lanes
from runner.load import Model
from runner.memory import address, record
from runner.methods import Method, find_method
from runner.options import Options
from runner.pointers import pointer
from runner.problem import Status

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Batch:
    """What a batch of runs gives; row r of every array is that of run r.

    final (runs, n_states): the state at the end of the span, or the last good one of a run that failed. samples
    (runs, n_samples, n_names) at sample_times (runs, n_samples), NaN where a run did not get there; names: what stands
    in them. status (runs,): of `Status`, as integers. failed_at (runs,): time, NaN where nothing failed; failed_state:
    index of the state that left first, or -1. steps, failed_attempts, evaluations (runs,). wall_time in s.
    in_lanes: whether the runs went in SIMD lanes; otherwise `reason` says why each went alone.
    """

    final: Floats
    samples: Floats
    sample_times: Floats
    names: tuple[str, ...]
    status: NDArray[np.int64]
    failed_at: Floats
    failed_state: NDArray[np.int64]
    steps: NDArray[np.int64]
    failed_attempts: NDArray[np.int64]
    evaluations: NDArray[np.int64]
    wall_time: float
    in_lanes: bool
    reason: str = ""

    @property
    def success(self) -> NDArray[np.bool_]:
        """Which runs reached the end of their span, (runs,)."""
        return self.status == int(Status.FINISHED)


@dataclass(frozen=True, eq=False)
class Task:
    """A batch as its drivers take it: all arrays of all runs, C-contiguous, those of the results among them."""

    model: Model
    method: Method
    options: Options
    arrays: dict[str, NDArray[Any]]
    inputs: BatchTable
    runs: int
    needs_outputs: bool

    def record(self, lanes_kernel: Any) -> np.void:
        """The record of a batch that compiled loops read; the arrays must live as long."""
        tables, options = self.model.tables, self.options
        shared = {name: address(array) for name, array in (self.arrays | vars(self.inputs)).items()}
        outputs = pointer(self.model.kernel("outputs"), abi.VECTOR_KERNEL, "outputs") if self.needs_outputs else 0
        return record(
            BATCH,
            **shared,
            runs=self.runs,
            n=len(tables.states),
            channels=len(tables.inputs),
            n_inputs=tables.rhs_inputs,
            n_constants=self.arrays["constants"].shape[1],
            n_outputs=len(tables.outputs),
            n_pieces=len(self.inputs.pieces),
            rhs=pointer(lanes_kernel, abi.LANE_KERNEL, "lane_rhs"),
            outputs=outputs,
            n_samples=self.arrays["times"].shape[1],
            n_columns=len(self.arrays["columns"]),
            needs_outputs=self.needs_outputs,
            step=options.step or 0.0,
            limit=options.divergence_limit,
            rtol=options.rtol,
            max_step=options.max_step or 0.0,
            first_step=options.first_step or 0.0,
            max_steps=options.max_steps or 0,
        )


def simulate_batch(
    model: Model,
    span: tuple[ArrayLike, ArrayLike],
    *,
    method: str = "rk4",
    runs: int | None = None,
    parameters: Any = None,
    initial: Mapping[str, ArrayLike] | ArrayLike | None = None,
    inputs: Any = None,
    samples: int | ArrayLike | None = None,
    names: Sequence[str] | None = None,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    time_limit: float | None = None,
    **options: Any,
) -> Batch:
    """Integrate many runs of a model, eight at once in SIMD lanes on each thread.

    Whatever differs from run to run is given as an array with one entry (or row) for each, what does not as one value.
    span: (t0, t1) in s, each a number or (runs,). parameters: as in `simulate`, each value a number or (runs,); or
    (runs, n_parameters). initial: by name or as an array (n_states,) or (runs, n_states); None starts each run from its
    static equilibrium. inputs: name -> a signal or number for all runs, `per_run(signal, rate, offset)`, or one signal
    or number for each; or a mapping name -> signal or number for each run. samples: number of evenly spaced times from
    t0 to t1 of each run, or times (n,) for all, at which `names` (states and outputs; all states by default) are
    stored: methods of constant step land there, the others interpolate. threads: as many as there are cores by default.
    options: those of `Options` that have to do with steps and tolerances. runs: where nothing else tells the number.
    A run that fails stops alone; its status, time and state are in the result. Raises ValueError for anything given
    wrongly, EquilibriumError naming the run that has no static state to start from.
    """
    started = time.perf_counter()
    chosen = find_method(method)
    task = _task(model, chosen, _options(options), span, runs, parameters, initial, inputs, samples, names)
    kernel = lane_rhs(model)
    reason = _reason(model, chosen, kernel)
    if task.runs == 0:
        pass
    elif reason:
        run_one_by_one(task, progress, time_limit)
    else:
        run_in_lanes(task, kernel, threads, progress, time_limit)
    arrays = task.arrays
    columns = [*model.state_names, *(output.name for output in model.tables.outputs)]
    results = ("final", "samples", "status", "failed_at", "failed_state", "steps", "failed_attempts", "evaluations")
    return Batch(
        **{name: arrays[name] for name in results},
        sample_times=arrays["times"],
        names=tuple(columns[i] for i in arrays["columns"]),
        wall_time=time.perf_counter() - started,
        in_lanes=not reason,
        reason=reason,
    )


#: Methods that run in lanes.
IN_LANES = ("euler", "heun", "midpoint", "rk4", "ode23", "ode45", "tsit5", "dop853", "vern7")


def _reason(model: Model, method: Method, kernel: Any) -> str:
    if method.name not in IN_LANES:
        return f"method {method.name} does not run in lanes; {', '.join(IN_LANES)} do"
    return "" if kernel is not None else f"model {model.name} has no lane kernel: it calls a function without vectors"


_OPTIONS = ("step", "rtol", "atol", "max_step", "first_step", "max_steps", "divergence_limit")


def _options(given: Mapping[str, Any]) -> Options:
    for name in given:
        if name not in _OPTIONS:
            raise ValueError(unknown("option", name, _OPTIONS))
    return Options(**given)


def _task(
    model: Model,
    method: Method,
    options: Options,
    span: Any,
    runs: int | None,
    parameters: Any,
    initial: Any,
    inputs: Any,
    samples: Any,
    names: Sequence[str] | None,
) -> Task:
    """Everything checked, broadcast to all runs and laid out."""
    t0, t1 = (_numbers("span", each) for each in _pair(span))
    p = _parameters(model, parameters)
    x0 = None if initial is None else _initial(model, initial)
    count = _count(runs, {"span": t0, "the end of the span": t1, "parameters": p[:, 0], "initial": x0}, inputs)
    t0, t1 = np.broadcast_to(t0, count).copy(), np.broadcast_to(t1, count).copy()
    _check_spans(t0, t1, method, options)
    constants = constants_of(model, np.broadcast_to(p, (count, p.shape[1])).copy())
    table = stack_runs(model.tables, inputs, count)
    n = len(model.state_names)
    start = equilibria(model, constants, table, t0) if x0 is None else np.broadcast_to(x0, (count, n)).copy()
    times, columns = _sample_times(samples, t0, t1), _columns(model, names)
    whole = {"status": 0, "failed_state": -1, "steps": 0, "failed_attempts": 0, "evaluations": 0}
    arrays: dict[str, NDArray[Any]] = {
        "t0": t0,
        "t1": t1,
        "initial": start,
        "constants": constants,
        "times": times,
        "columns": columns,
        "atol": np.maximum(np.broadcast_to(options.atol, n), 1e-300),
        "next": np.zeros(1, dtype=np.int64),
        "final": np.full((count, n), np.nan),
        "samples": np.full((count, times.shape[1], len(columns)), np.nan),
        "failed_at": np.full(count, np.nan),
        **{name: np.full(count, value, dtype=np.int64) for name, value in whole.items()},
    }
    return Task(model, method, options, arrays, table, count, bool((columns >= n).any()))


def _pair(span: Any) -> tuple[Any, Any]:
    if not isinstance(span, tuple | list) or len(span) != 2:
        raise ValueError(f"span is {span!r}, expected (start, end), each a number or one for each run")
    return span[0], span[1]


def _numbers(what: str, value: Any) -> Floats:
    """A number, or one for each run, as (1,) or (runs,)."""
    array = np.atleast_1d(np.asarray(value, dtype=np.float64))
    if array.ndim != 1 or not np.isfinite(array).all():
        raise ValueError(f"{what} is {value!r}, expected a finite number or one for each run")
    return array


def _count(runs: int | None, arrays: Mapping[str, Floats | None], inputs: Any) -> int:
    """The number of runs on which everything that has one row for each agrees."""
    sizes = {name: len(array) for name, array in arrays.items() if array is not None and len(array) != 1}
    sizes |= count_runs(inputs)
    if runs is not None:
        sizes["runs"] = runs
    if len(set(sizes.values())) > 1:
        told = ", ".join(f"{name}: {size}" for name, size in sizes.items())
        raise ValueError(f"the number of runs is not clear; found {told}")
    return next(iter(sizes.values()), 1)


def _parameters(model: Model, parameters: Any) -> Floats:
    """Parameters (1 or runs, n_parameters)."""
    names = [parameter.name for parameter in model.tables.parameters]
    if parameters is not None and not isinstance(parameters, str | Mapping | tuple):
        p = np.array(parameters, dtype=np.float64)
        if p.ndim != 2 or p.shape[1] != len(names) or not np.isfinite(p).all():
            raise ValueError(f"parameters has shape {p.shape}, expected (runs, {len(names)}) of finite numbers")
        return p
    chosen, given = (parameters, {}) if parameters is None or isinstance(parameters, str) else (None, parameters)
    if isinstance(parameters, tuple) and len(parameters) == 2:
        chosen, given = parameters
    single = {name: float(np.ravel(value)[0]) if np.size(value) else 0.0 for name, value in given.items()}
    base = model.parameter_values((chosen, single))
    columns = {name: _numbers(f"model {model.name}: parameter {name}", value) for name, value in given.items()}
    count = _count(None, {f"parameter {name}": column for name, column in columns.items()}, None)
    p = np.tile(base, (count, 1))
    for name, column in columns.items():
        p[:, names.index(name)] = column
    return p


def _initial(model: Model, initial: Any) -> Floats:
    """Initial states (1 or runs, n_states)."""
    if isinstance(initial, Mapping):
        columns = {name: _numbers(f"initial {name}", value) for name, value in initial.items()}
        x = np.zeros((_count(None, columns, None), len(model.state_names)))
        for name, column in columns.items():
            if name not in model.state_names:
                raise ValueError(f"model {model.name}: {unknown('state', name, model.state_names)}")
            x[:, model.state_names.index(name)] = column
        return x
    x = np.atleast_2d(np.array(initial, dtype=np.float64))
    if x.ndim != 2 or x.shape[1] != len(model.state_names) or not np.isfinite(x).all():
        raise ValueError(f"initial has shape {x.shape}, expected (runs, {len(model.state_names)}) of finite numbers")
    return x


def _check_spans(t0: Floats, t1: Floats, method: Method, options: Options) -> None:
    if not (t0 < t1).all():
        run = int(np.argmin(t0 < t1))
        raise ValueError(f"span of run {run} is ({t0[run]}, {t1[run]}), expected a start before the end")
    if method.family == "fixed":
        if options.step is None:
            raise ValueError(f"method {method.name!r} marches with a constant step: give step=, such as step=1e-3")
        largest = max(np.abs(t0).max(initial=0.0), np.abs(t1).max(initial=0.0))
        if options.step < 64 * np.spacing(largest):
            raise ValueError(f"step is {options.step}, too small to advance the time to {largest}")


def _sample_times(samples: Any, t0: Floats, t1: Floats) -> Floats:
    """Times (runs, n_samples)."""
    if samples is None:
        return np.zeros((len(t0), 0))
    if isinstance(samples, int | np.integer):
        if samples < 2:
            raise ValueError(f"samples is {samples}, expected 2 or more, or rising times")
        return np.ascontiguousarray(np.linspace(t0, t1, int(samples), axis=1))
    times = np.array(samples, dtype=np.float64)
    if times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise ValueError("samples: expected how many, or a row of finite, rising times")
    return np.tile(times, (len(t0), 1))


def _columns(model: Model, names: Sequence[str] | None) -> NDArray[np.int64]:
    known = [*model.state_names, *(output.name for output in model.tables.outputs)]
    if names is None:
        return np.arange(len(model.state_names))
    for name in names:
        if name not in known:
            raise ValueError(f"model {model.name}: {unknown('state or output', name, known)}")
    return np.array([known.index(name) for name in names], dtype=np.int64)
