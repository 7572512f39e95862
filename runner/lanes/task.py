"""A batch of runs checked, broadcast and laid out as the compiled loops read it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.lanes.given import (
    agreed_count,
    check_spans,
    guess_rows,
    initial_rows,
    numbers,
    output_rows,
    pair,
    parameter_rows,
    wanted_columns,
)
from qddot.runner.lanes.pack import BATCH
from qddot.runner.lanes.signals import BatchTable, stack_runs
from qddot.runner.lanes.starts import assemblies, constants_of, equilibria
from qddot.runner.load import Model
from qddot.runner.machine.memory import address, record
from qddot.runner.machine.pointers import pointer
from qddot.runner.method import Method
from qddot.runner.options import Options
from qddot.runner.switching import sides_of_runs
from qddot.runner.tables import Quantity

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Task:
    """A batch as its drivers take it: all arrays of all runs, C-contiguous, those of the results among them.

    not_started: why runs have no initial state, by number; theirs is NaN, so that the loops leave them at once.
    """

    model: Model
    method: Method
    options: Options
    arrays: dict[str, NDArray[Any]]
    inputs: BatchTable
    runs: int
    needs_outputs: bool
    not_started: Mapping[int, str]

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What stands in the samples."""
        known = (*self.model.tables.states, *self.model.tables.outputs)
        return tuple(known[i] for i in self.arrays["columns"])

    def by(self, method: Method, options: Options) -> "Task":
        """The same runs by this method, with its options; to a constant step belong stops that `make_task` sets."""
        inputs = self.inputs.walked() if method.family == "taylor" else self.inputs
        return replace(self, method=method, options=options, inputs=inputs)

    def record(self, functions: Mapping[str, int]) -> np.void:
        """The record of a batch that compiled loops read; the arrays must live as long.

        functions: addresses of those that the method's loop calls, the right-hand side among them if it takes one.
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
            outputs=outputs,
            n_samples=self.arrays["times"].shape[1],
            n_columns=len(self.arrays["columns"]),
            needs_outputs=self.needs_outputs,
            step=options.step or 0.0,
            limit=options.divergence_limit,
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
    guess: Any,
    inputs: Any,
    output_times: Any,
    names: Sequence[str] | None,
) -> Task:
    """Everything checked, broadcast to all runs and laid out."""
    t0, t1 = (numbers("span", each) for each in pair(span))
    p = parameter_rows(model, parameters)
    x0 = None if initial is None else initial_rows(model, initial)
    constraints = model.tables.constraints
    if initial is not None and guess is not None and not constraints:
        raise ValueError("initial and guess are both given; guess is where the search for a static state starts")
    near = np.zeros((1, len(model.state_names)))
    if guess is not None:
        near = guess_rows(model, guess) if initial is None else initial_rows(model, guess)
    rows = {"span": t0, "the end of the span": t1, "parameters": p[:, 0], "initial": x0, "guess": near}
    count = agreed_count(runs, rows, inputs)
    t0, t1 = np.broadcast_to(t0, count).copy(), np.broadcast_to(t1, count).copy()
    check_spans(t0, t1, method, options)
    constants = constants_of(model, np.broadcast_to(p, (count, p.shape[1])).copy())
    found = sides_of_runs(model, constants, t0, t1)
    step = options.step if method.family == "fixed" else None
    table = stack_runs(model.tables, inputs, count, step, found)
    n = len(model.state_names)
    rtol, atol = options.tolerances(n)
    if x0 is None:
        start, reasons = equilibria(model, constants, table, t0, np.broadcast_to(near, (count, near.shape[1])))
    elif constraints:
        named = tuple(initial) if isinstance(initial, Mapping) else None
        given = np.broadcast_to(x0, (count, n)), np.broadcast_to(near, (count, n))
        start, reasons = assemblies(model, constants, table, t0, *given, named)
    else:
        start, reasons = np.broadcast_to(x0, (count, n)).copy(), dict[int, str]()
    times, columns = output_rows(output_times, t0, t1), wanted_columns(model, names)
    whole = {"status": 0, "failed_state": -1, "steps": 0, "failed_attempts": 0, "evaluations": 0}
    arrays: dict[str, NDArray[Any]] = {
        "t0": t0,
        "t1": t1,
        "initial": start,
        "constants": constants,
        "times": times,
        "columns": columns,
        "rtol": rtol,
        "atol": np.maximum(atol, 1e-300),
        "next": np.zeros(1, dtype=np.int64),
        "final": np.full((count, n), np.nan),
        "samples": np.full((count, times.shape[1], len(columns)), np.nan),
        "failed_at": np.full(count, np.nan),
        **{name: np.full(count, value, dtype=np.int64) for name, value in whole.items()},
    }
    task = Task(model, method, options, arrays, table, count, bool((columns >= n).any()), reasons)
    return task.by(method, options)
