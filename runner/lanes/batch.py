"""Many runs of one model by one call."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from qddot.runner.checks import positive, shown, unknown, whole
from qddot.runner.compiling import working_time
from qddot.runner.exact.batch import propagate_batch
from qddot.runner.lanes.kernel import lane_rhs
from qddot.runner.lanes.scalar import run_one_by_one
from qddot.runner.lanes.task import Task, make_task
from qddot.runner.lanes.threads import run_in_lanes
from qddot.runner.load import Model, as_model
from qddot.runner.methods import Method, find_method
from qddot.runner.options import Options
from qddot.runner.problem import Status

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Batch:
    """What a batch of runs gives; row r of every array is that of run r.

    final (runs, n_states): the state at the end of the span, or the last good one of a run that failed. samples
    (runs, n_samples, n_names) at sample_times (runs, n_samples), NaN where a run did not get there; names: what stands
    in them. status (runs,): of `Status`, as integers. failed_at (runs,): time, NaN where nothing failed; failed_state:
    index of the state that left first, or -1. steps, failed_attempts, evaluations (runs,). wall_time in s,
    without compiling. not_started: why a run has no static state to start from, by its number.
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
    not_started: Mapping[int, str] = field(default_factory=dict)

    @property
    def success(self) -> NDArray[np.bool_]:
        """Which runs reached the end of their span, (runs,)."""
        return self.status == int(Status.FINISHED)


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
    A run that fails, or that has no static state to start from, fails alone; its status, time and state or its reason
    are in the result. Raises ValueError for anything given wrongly, EquilibriumError where no run has a static state.
    """
    started = working_time()
    chosen, model = find_method(method), as_model(model)
    if threads is not None:
        whole("threads", threads)
    task = make_task(model, chosen, _options(options), span, runs, parameters, initial, inputs, samples, names)
    if time_limit is not None:
        positive("time_limit", time_limit)
    if not (progress is None or callable(progress)):
        raise ValueError(f"progress is {shown(progress)}, expected a function of the part done")
    reason = _compute(task, threads, progress, time_limit)
    _withdraw(task)
    return Batch(
        **{name: task.arrays[name] for name in _RESULTS},
        sample_times=task.arrays["times"],
        names=task.names,
        wall_time=working_time() - started,
        in_lanes=not reason,
        reason=reason,
        not_started=task.not_started,
    )


def _withdraw(task: Task) -> None:
    """Let the results of the runs that had no initial state say so."""
    rows = list(task.not_started)
    for name, value in (("status", int(Status.NOT_STARTED)), ("failed_at", np.nan), ("failed_state", -1)):
        task.arrays[name][rows] = value
    for name in ("steps", "failed_attempts", "evaluations"):
        task.arrays[name][rows] = 0


_RESULTS = ("final", "samples", "status", "failed_at", "failed_state", "steps", "failed_attempts", "evaluations")


def _compute(
    task: Task, threads: int | None, progress: Callable[[float], None] | None, time_limit: float | None
) -> str:
    """Run all runs into the arrays of the task; returns why they did not go in lanes, nothing where they did."""
    kernel = lane_rhs(task.model)
    reason = _reason(task.model, task.method, kernel)
    if task.runs == 0:
        pass
    elif task.method.family == "exact":
        arrays = task.arrays | vars(task.inputs)
        limit = task.options.divergence_limit
        propagate_batch(task.model, arrays, limit=limit, threads=threads, progress=progress, time_limit=time_limit)
    elif reason:
        run_one_by_one(task, progress, time_limit)
    else:
        run_in_lanes(task, kernel, threads, progress, time_limit)
    return reason


#: Methods that run in lanes.
IN_LANES = ("euler", "heun", "midpoint", "rk4", "ode23", "ode45", "tsit5", "dop853", "vern7")


def _reason(model: Model, method: Method, kernel: Any) -> str:
    if method.family == "exact":
        return "exact propagation takes every run by its own matrices, on all threads"
    if method.name not in IN_LANES:
        return f"method {method.name} does not run in lanes; {', '.join(IN_LANES)} do"
    return "" if kernel is not None else f"model {model.name} has no lane kernel: it calls a function without vectors"


_OPTIONS = ("step", "rtol", "atol", "max_step", "first_step", "max_steps", "divergence_limit")


def _options(given: Mapping[str, Any]) -> Options:
    for name in given:
        if name not in _OPTIONS:
            raise ValueError(unknown("option", name, _OPTIONS))
    return Options(**given)
