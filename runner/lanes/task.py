"""A batch of runs checked, broadcast and laid out as the compiled loops read it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from runner import abi
from runner.checks import unknown
from runner.lanes.pack import BATCH
from runner.lanes.signals import BatchTable, count_runs, stack_runs
from runner.lanes.starts import constants_of, equilibria
from runner.load import Model
from runner.memory import address, record
from runner.methods import Method
from runner.options import Options
from runner.pointers import pointer

Floats = NDArray[np.float64]


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

    def record(self, lanes_kernel: Any, functions: Mapping[str, int]) -> np.void:
        """The record of a batch that compiled loops read; the arrays must live as long.

        functions: addresses of those that the method's loop calls.
        """
        tables, options = self.model.tables, self.options
        inputs = vars(self.inputs)
        shared = {name: address(each) for name, each in (self.arrays | inputs).items() if name != "hops"}
        watched = len(tables.inputs) if self.needs_outputs else tables.rhs_inputs
        outputs = pointer(self.model.kernel("outputs"), abi.VECTOR_KERNEL, "outputs") if self.needs_outputs else 0
        return record(
            BATCH,
            **shared,
            **functions,
            runs=self.runs,
            n=len(tables.states),
            channels=len(tables.inputs),
            n_inputs=tables.rhs_inputs,
            n_watched=watched,
            hops=self.inputs.hops,
            **{f"n_{way}": int((inputs[way] < tables.rhs_inputs).sum()) for way in ("even", "guided")},
            **{f"all_{way}": int((inputs[way] < watched).sum()) for way in ("even", "guided")},
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


def make_task(
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
    chosen, given = parameters if isinstance(parameters, tuple) and len(parameters) == 2 else (None, parameters)
    if not isinstance(given, Mapping):
        chosen, given = given, {}
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
