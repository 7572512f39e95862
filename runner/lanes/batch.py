"""Many runs of one model by one call."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from qddot.runner.checks import positive, shown, unknown, whole
from qddot.runner.exact.batch import propagate_batch
from qddot.runner.keywords import BatchKeywords
from qddot.runner.lanes.choice import chosen
from qddot.runner.lanes.result import Batch
from qddot.runner.lanes.scalar import run_one_by_one
from qddot.runner.lanes.task import Task, make_task
from qddot.runner.lanes.threads import run_in_lanes
from qddot.runner.lanes.way import way_of
from qddot.runner.load import Model, as_model
from qddot.runner.machine.compiling import working_time
from qddot.runner.methods import Method, find_method
from qddot.runner.options import MANY, Options
from qddot.runner.problem import Status
from qddot.runner.takers import fitted, misfit, taken


def simulate_batch(
    model: Model,
    span: tuple[ArrayLike, ArrayLike],
    *,
    method: str = "rk4",
    runs: int | None = None,
    parameters: Any = None,
    initial: Mapping[str, ArrayLike] | ArrayLike | None = None,
    guess: Mapping[str, ArrayLike] | ArrayLike | None = None,
    inputs: Any = None,
    output_times: int | ArrayLike | None = None,
    samples: int | ArrayLike | None = None,
    names: Sequence[str] | None = None,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    time_limit: float | None = None,
    **options: Unpack[BatchKeywords],
) -> Batch:
    """Integrate many runs of a model, eight at once in SIMD lanes on each thread.

    Whatever differs from run to run is given as an array with one entry (or row) for each, what does not as one value.
    span: (t0, t1) in s, each a number or (runs,). parameters: as in `simulate`, each value a number or (runs,); or
    (runs, n_parameters). initial: by name or as an array (n_states,) or (runs, n_states); None starts each run from its
    static equilibrium, for which the search starts at `guess`, coordinates by name or states, likewise. inputs: name ->
    a signal or number for all runs, `per_run(signal, rate, offset)`, or one signal or number for each; or a mapping
    name -> signal or number for each run. output_times: times (n,) for all runs, or how many evenly spaced ones from t0
    to t1 of each, at which `names` (states and outputs; all states by default) are stored: methods of constant step
    land there, the others interpolate. samples: its old name. threads: as many as there are cores by default, for runs
    that do not go one by one. options: those of `BatchKeywords` that the method takes. runs: where nothing else tells
    the number.
    A run that fails, or that has no static state to start from, fails alone; its status, time and state or its reason
    are in the result. Raises ValueError for anything given wrongly, EquilibriumError where no run has a static state.
    """
    started = working_time()
    given, model = find_method(method), as_model(model)
    if threads is not None:
        whole("threads", threads)
    times = _output_times(output_times, samples)
    task = make_task(
        model, given, _options(given, options), span, runs, parameters, initial, guess, inputs, times, names
    )
    if names is not None and times is None:
        raise ValueError("names are those of what is stored at output_times, which are not given; give both or neither")
    if time_limit is not None:
        positive("time_limit", time_limit)
    if not (progress is None or callable(progress)):
        raise ValueError(f"progress is {shown(progress)}, expected a function of the part done")
    task, why = chosen(task) if given.family == "auto" else (task, "")
    reason = _compute(task, threads, progress, time_limit)
    _withdraw(task)
    return Batch(
        **{name: task.arrays[name] for name in _RESULTS},
        failed_state=np.array([*model.state_names, ""])[task.arrays["failed_state"]],
        output_times=task.arrays["times"],
        quantities=task.quantities,
        wall_time=working_time() - started,
        in_lanes=not reason,
        reason=reason,
        method=f"{task.method.name}, since {why}" if why else task.method.name,
        not_started=task.not_started,
    )


def _withdraw(task: Task) -> None:
    """Let the results of the runs that had no initial state say so."""
    rows = list(task.not_started)
    for name, value in (("status", int(Status.NOT_STARTED)), ("failed_at", np.nan), ("failed_state", -1)):
        task.arrays[name][rows] = value
    for name in ("steps", "failed_attempts", "evaluations"):
        task.arrays[name][rows] = 0


_RESULTS = ("final", "samples", "status", "failed_at", "steps", "failed_attempts", "evaluations")


def _compute(
    task: Task, threads: int | None, progress: Callable[[float], None] | None, time_limit: float | None
) -> str:
    """Run all runs into the arrays of the task; returns why they did not go in lanes, nothing where they did."""
    engine, reason = way_of(task.model, task.method, task.options)
    if engine == "alone" and threads not in (None, 1):
        raise ValueError(f"threads is {threads}, but these runs go one by one: {reason}; leave it out")
    if task.runs == 0:
        pass
    elif engine == "exact":
        arrays = task.arrays | vars(task.inputs)
        limit = task.options.divergence_limit
        propagate_batch(task.model, arrays, limit=limit, threads=threads, progress=progress, time_limit=time_limit)
    elif engine == "lanes":
        run_in_lanes(task, threads, progress, time_limit)
    else:
        run_one_by_one(task, progress, time_limit)
    return reason


def _output_times(output_times: Any, samples: Any) -> Any:
    if samples is None:
        return output_times
    warnings.warn("samples= is output_times= now; the old name goes with version 0.3", DeprecationWarning, 3)
    if output_times is not None:
        raise ValueError("output_times and samples are both given, and mean the same; give output_times")
    return samples


def _options(method: Method, given: Mapping[str, Any]) -> Options:
    own = taken(method, many=True)
    for name, value in given.items():
        if name not in MANY:
            raise ValueError(unknown("option", name, MANY))
        if name not in own and value is not None:
            instead = "give output_times" if name == "step" and method.family == "exact" else ""
            raise ValueError(f"{name}: {misfit(method, own, name, instead)}")
    made = Options(**given)
    return made if method.family == "auto" else fitted(made, method)
