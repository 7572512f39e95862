"""What a batch is given, checked, as arrays of one row or of one for each run."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import checks
from qddot.runner.checks import shown, unknown, whole
from qddot.runner.equilibrium import still
from qddot.runner.frame.spans import check_advances
from qddot.runner.lanes.signals import count_runs
from qddot.runner.load import Model
from qddot.runner.method import Method
from qddot.runner.options import Options

Floats = NDArray[np.float64]

#: Of one run.
MOST_SAMPLES = 2**31


def pair(span: Any) -> tuple[Any, Any]:
    """Start and end of a span."""
    if not isinstance(span, tuple | list) or len(span) != 2:
        raise ValueError(f"span is {shown(span)}, expected (start, end), each a number or one for each run")
    return span[0], span[1]


def numbers(what: str, value: Any) -> Floats:
    """A number, or one for each run, as (1,) or (runs,)."""
    expected = "a finite number or one for each run"
    return checks.row(what, np.atleast_1d(checks.numbers(what, value, expected)), expected)


def agreed_count(runs: int | None, arrays: Mapping[str, Floats | None], inputs: Any) -> int:
    """The number of runs on which everything that has one row for each agrees."""
    sizes = {name: len(array) for name, array in arrays.items() if array is not None and len(array) != 1}
    sizes |= count_runs(inputs)
    if runs is not None:
        sizes["runs"] = whole("runs", runs, least=0)
    if len(set(sizes.values())) > 1:
        told = ", ".join(f"{name}: {size}" for name, size in sizes.items())
        raise ValueError(f"the number of runs is not clear; found {told}")
    return next(iter(sizes.values()), 1)


def parameter_rows(model: Model, parameters: Any) -> Floats:
    """Parameters (1 or runs, n_parameters)."""
    names = [parameter.name for parameter in model.tables.parameters]
    if parameters is not None and not isinstance(parameters, str | Mapping | tuple):
        p = checks.numbers("parameters", parameters, f"(runs, {len(names)}) of finite numbers")
        if p.ndim != 2 or p.shape[1] != len(names) or not np.isfinite(p).all():
            raise ValueError(f"parameters has shape {p.shape}, expected (runs, {len(names)}) of finite numbers")
        return p
    chosen, given = parameters if isinstance(parameters, tuple) and len(parameters) == 2 else (None, parameters)
    if not isinstance(given, Mapping):
        chosen, given = given, {}
    columns = {name: numbers(f"model {model.name}: parameter {name}", value) for name, value in given.items()}
    single = {name: float(column[0]) if len(column) else 0.0 for name, column in columns.items()}
    base = model.parameter_values((chosen, single))
    count = agreed_count(None, {f"parameter {name}": column for name, column in columns.items()}, None)
    p = np.tile(base, (count, 1))
    for name, column in columns.items():
        p[:, names.index(name)] = column
    return p


def initial_rows(model: Model, initial: Any) -> Floats:
    """Initial states (1 or runs, n_states)."""
    return _rows(model, "initial", initial, "state", model.state_names)


def guess_rows(model: Model, guess: Any) -> Floats:
    """States (1 or runs, n_states) where the searches for static states start; velocities do not matter."""
    return _rows(model, "guess", guess, "coordinate", [model.state_names[i] for i in still(model)[0]])


def _rows(model: Model, what: str, given: Any, kind: str, names: Sequence[str]) -> Floats:
    """States (1 or runs, n_states), from an array or, these of them, by name."""
    if isinstance(given, Mapping):
        columns = {name: numbers(f"{what} {name}", value) for name, value in given.items()}
        x = np.zeros((agreed_count(None, columns, None), len(model.state_names)))
        for name, column in columns.items():
            if name not in names:
                raise ValueError(f"model {model.name}: {unknown(kind, name, names)}")
            x[:, model.state_names.index(name)] = column
        return x
    n = len(model.state_names)
    x = np.atleast_2d(checks.numbers(what, given, f"(runs, {n}) of finite numbers"))
    if x.ndim != 2 or x.shape[1] != n or not np.isfinite(x).all():
        raise ValueError(f"{what} has shape {x.shape}, expected (runs, {n}) of finite numbers")
    return x


def check_spans(t0: Floats, t1: Floats, method: Method, options: Options) -> None:
    """ValueError naming the run that does not end after it starts, or a step that is missing or too small."""
    if not (t0 < t1).all():
        run = int(np.argmin(t0 < t1))
        hint = "; qddot.simulate goes backward" if t1[run] < t0[run] else ""
        raise ValueError(f"span of run {run} is ({t0[run]}, {t1[run]}), expected a start before the end{hint}")
    check_advances(options, max(np.abs(t0).max(initial=0.0), np.abs(t1).max(initial=0.0)))
    if method.family == "fixed":
        if options.step is None:
            raise ValueError(f"method {method.name!r} marches with a constant step: give step=, such as step=1e-3")
        largest = max(np.abs(t0).max(initial=0.0), np.abs(t1).max(initial=0.0))
        if options.step < 64 * np.spacing(largest):
            raise ValueError(f"step is {options.step}, too small to advance the time to {largest}")


def output_rows(given: Any, t0: Floats, t1: Floats) -> Floats:
    """Output times (runs, n_times)."""
    if given is None:
        return np.zeros((len(t0), 0))
    if isinstance(given, int | np.integer) and not isinstance(given, bool):
        if not 2 <= given <= MOST_SAMPLES:
            raise ValueError(f"output_times is {shown(given)}, expected 2 to {MOST_SAMPLES}, or rising times")
        return np.ascontiguousarray(np.linspace(t0, t1, int(given), axis=1))
    times = checks.numbers("output_times", given, "how many, or a row of finite, rising times")
    if times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise ValueError(f"output_times is {shown(given)}, expected how many, or a row of finite, rising times")
    return np.tile(times, (len(t0), 1))


def wanted_columns(model: Model, names: Sequence[str] | None) -> NDArray[np.int64]:
    """Columns of the states and outputs of these names, states first; all states where there are none."""
    known = [*model.state_names, *(output.name for output in model.tables.outputs)]
    if names is None:
        return np.arange(len(model.state_names))
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise ValueError(f"names is {shown(names)}, expected a list of names")
    for name in names:
        if not isinstance(name, str) or name not in known:
            raise ValueError(f"model {model.name}: {unknown('state or output', name, known)}")
    return np.array([known.index(name) for name in names], dtype=np.int64)
