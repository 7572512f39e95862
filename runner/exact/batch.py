"""Many runs of one linear model, each propagated exactly with its own parameters, inputs and times, on all cores."""

from collections.abc import Callable, Mapping
from functools import cache
from itertools import count
from threading import Event
from typing import Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.exact.runs import RUNS, propagate_runs
from qddot.runner.exact.space import SPACE, Linear, space_for
from qddot.runner.inputs.piece import InputTable
from qddot.runner.load import Model
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import address, record
from qddot.runner.machine.pointers import pointer
from qddot.runner.workers import cores, on_threads

#: Runs that a thread takes at a time; between two such blocks it looks whether to stop.
BLOCK_OF_RUNS = 16
#: What every run is told or writes; see `propagate_batch`.
_SHARED = (
    *("t0", "t1", "initial", "constants", "table", "rate", "offset", "order", "pieces", "first", "last", "times"),
    *("columns", "samples", "final", "status", "failed_at", "failed_state", "steps", "evaluations"),
)


def propagate_batch(
    model: Model,
    arrays: Mapping[str, NDArray[Any]],
    *,
    limit: float = 1e100,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    time_limit: float | None = None,
) -> None:
    """Propagate all runs of a batch of a linear model; the results are those of `simulate` run by run, to rounding.

    arrays, all C-contiguous: t0, t1 (runs,); initial (runs, n_states); constants (runs, n_constants); table, rate,
    offset (runs, channels): channel i of run r reads the pieces first[k] to last[k], k = table[r, i], at rate*t +
    offset; order (channels,); pieces (n, 8); times (runs, n_samples), rising; columns (n_columns,): states, then
    outputs. Written: samples (runs, n_samples, n_columns), final (runs, n_states), status, failed_at, failed_state,
    steps, evaluations (runs,). Raises ValueError for a nonlinear model.
    """
    if not model.tables.linear:
        raise ValueError(f"model {model.name} is nonlinear, exact propagation needs a linear one")
    runs, numbers = len(arrays["t0"]), count()
    batch = _batch(model, arrays, limit)
    loop = _compiled_runs()

    def work(stop: Event) -> None:
        s, keep = _thread_space(model, arrays)
        while not stop.is_set():
            start = BLOCK_OF_RUNS * next(numbers)
            if start >= runs:
                break
            loop(batch, s, *keep[1:], start, min(runs, start + BLOCK_OF_RUNS))

    workers = max(1, min(threads or cores(), -(-runs // BLOCK_OF_RUNS)))
    on_threads(work, workers, arrays["status"], progress, time_limit)


def _batch(model: Model, arrays: Mapping[str, NDArray[Any]], limit: float) -> np.void:
    tables, columns = model.tables, arrays["columns"]
    needs_outputs = bool((columns >= len(tables.states)).any())
    outputs = pointer(model.kernel("outputs"), abi.VECTOR_KERNEL, "outputs") if needs_outputs else 0
    return record(
        RUNS,
        **{name: address(arrays[name]) for name in _SHARED},
        n_states=len(tables.states),
        all_channels=len(tables.inputs),
        n_constants=arrays["constants"].shape[1],
        n_samples=arrays["times"].shape[1],
        n_columns=len(columns),
        n_pieces=len(arrays["pieces"]),
        outputs=outputs,
        n_model_outputs=len(tables.outputs),
        limit=limit,
    )


def _thread_space(model: Model, arrays: Mapping[str, NDArray[Any]]) -> tuple[np.void, tuple[Any, ...]]:
    """A space for one thread, and what its loop wants beside it: A, B and the channels' cursors."""
    n, channels, driving = len(model.state_names), len(model.tables.inputs), model.tables.rhs_inputs
    none = np.zeros(max(1, channels), dtype=np.int64)
    table = InputTable(arrays["pieces"], none, none, np.zeros(1), np.zeros(1), none, np.zeros(0))
    linear = Linear(model.kernel("rhs"), model.matrix("jacobian"), model.matrix("input_jacobian"))
    s, kept = space_for(linear, table, driving, np.zeros(arrays["times"].shape[1] + 2))
    A, B = np.empty((n, n)), np.empty((n, driving + 1))
    integers = np.zeros((3, max(1, channels)), dtype=np.int64)
    return s, (kept, A, B, integers, np.zeros(max(1, channels)), np.zeros(max(1, len(model.tables.outputs))))


@cache
def _compiled_runs() -> Any:
    batch, space = (typeof(np.zeros(1, dtype=fields)[0]) for fields in (RUNS, SPACE))
    integers, number = types.Array(types.int64, 2, "C"), types.int64
    arguments = (batch, space, abi.MATRIX, abi.MATRIX, integers, abi.VECTOR, abi.VECTOR, number, number)
    return compiled(types.void(*arguments), nogil=True, _nrt=False)(propagate_runs)
