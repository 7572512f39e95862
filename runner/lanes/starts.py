"""What every run of a batch starts with: its constants and its static equilibrium, for all runs at once."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.assembly import AssemblyError, assembled_on, manifold_of
from qddot.runner.equilibrium import AT_REST, EquilibriumError, rest, still
from qddot.runner.inputs.signal import InputTable, Signal
from qddot.runner.lanes.signals import BatchTable
from qddot.runner.load import Model
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import intrinsic
from qddot.runner.machine.pointers import call_kernel, caller, pointer

Floats = NDArray[np.float64]

#: Newton iterations for all runs together; a run that needs more or is hard gets the careful search of its own.
MOST_ITERATIONS = 12
#: Condition number, rows scaled, above which the careful search has a look.
DOUBTFUL = 1e9


@intrinsic
def _call_constants(typing_context: Any, where: Any, p: Any, c: Any) -> Any:
    """Call the kernel constants(p, c) at an address."""
    return caller(abi.SIGNATURES["constants"])


def _constants(where, p, c):
    for run in range(len(p)):
        _call_constants(where, p[run], c[run])


def _results(where, t, x, u, c, results):
    for run in range(len(x)):
        call_kernel(where, t[run], x[run], u[run], c[run], results[run])


_TABLE = types.Array(types.float64, 2, "C")


@cache
def _compiled_constants() -> Any:
    return compiled(types.void(types.int64, _TABLE, _TABLE))(_constants)


@cache
def _compiled_results() -> Any:
    return compiled(types.void(types.int64, abi.VECTOR, _TABLE, _TABLE, _TABLE, _TABLE))(_results)


def _address(model: Model, name: str) -> int:
    return pointer(model.kernel(name), abi.SIGNATURES[name], name)


def constants_of(model: Model, p: Floats) -> Floats:
    """Constants (runs, n_constants) for parameters (runs, n_parameters); a ValueError names the run it fails for."""
    c = np.zeros((len(p), len(model.tables.constant_names)))
    _compiled_constants()(_address(model, "constants"), np.ascontiguousarray(p), c)
    for run in np.flatnonzero(~np.isfinite(c).all(axis=1)):
        try:
            model.constants(p[run])
        except ValueError as error:
            raise ValueError(f"run {run}: {error}") from None
    return c


def inputs_at(table: BatchTable, t: Floats) -> Floats:
    """All channels of all runs (runs, channels) at times t (runs,); input rates are 0."""
    u = np.zeros((len(t), max(1, len(table.order))))
    for i in np.flatnonzero(table.order == 0):
        tau = table.rate[:, i] * t + table.offset[:, i]
        for k in np.unique(table.table[:, i]):
            chosen = table.table[:, i] == k
            pieces = np.ascontiguousarray(table.pieces[table.first[k] : table.last[k] + 1])
            u[chosen, i] = Signal(pieces, np.empty(0))(tau[chosen])
    return u


def equilibria(model: Model, c: Floats, table: BatchTable, t0: Floats, guess: Floats) -> tuple[Floats, dict[int, str]]:
    """The static equilibria (runs, n_states) for constants c (runs, n_constants), with the inputs at t0 (runs,).

    guess: the states (runs, n_states) at which the searches start; velocities do not matter.
    Newton's method for all runs at once; runs it does not settle are searched for one by one, as in `equilibrium`.
    A run that has none is a row of NaN, its reason under its number. Raises EquilibriumError where no run has one.
    """
    runs, (free, rows), pattern = len(c), still(model), model.tables.patterns["jacobian"]
    x, u = np.zeros((runs, len(model.state_names))), inputs_at(table, t0)
    x[:, free] = guess[:, free]
    slopes, entries = np.zeros_like(x), np.zeros((runs, pattern.entries))
    rhs, jacobian = _address(model, "rhs"), _address(model, "jacobian")
    settled = np.zeros(runs, dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(0 if model.tables.constraints else MOST_ITERATIONS):  # those are fulfilled run by run
            try:
                _compiled_results()(rhs, t0, x, u, c, slopes)
                _compiled_results()(jacobian, t0, x, u, c, entries)
                r, J = slopes[:, rows], pattern.dense(entries)[:, rows[:, None], free]
                scale = np.abs(J).max(axis=2, initial=0.0, keepdims=True)
                inverse = np.linalg.inv(J / scale)
            except np.linalg.LinAlgError:
                break
            condition = np.abs(inverse).sum(axis=2).max(axis=1) * len(free)
            terms = (np.abs(J) @ np.abs(x[:, free, None]))[:, :, 0] + 1.0
            settled = (np.abs(r) <= 1e-3 * AT_REST * terms).all(axis=1) & (condition < DOUBTFUL)
            if settled.all():
                break
            x[:, free] -= np.where(settled[:, None], 0.0, (inverse @ (r[:, :, None] / scale))[:, :, 0])
    reasons: dict[int, str] = {}
    for run in map(int, np.flatnonzero(~(settled & np.isfinite(x).all(axis=1)))):
        try:
            x[run] = rest(model, c[run], table_of(table, run), float(t0[run]), guess[run])
        except EquilibriumError as error:
            x[run], reasons[run] = np.nan, str(error)
    if runs and len(reasons) == runs:
        raise EquilibriumError(f"run 0: {reasons[0]}")
    return x, reasons


def assemblies(
    model: Model, c: Floats, table: BatchTable, t0: Floats, x: Floats, guess: Floats, named: Sequence[str] | None
) -> tuple[Floats, dict[int, str]]:
    """Initial states (runs, n_states) on the constraints of a model, and why there are none, by the number of the run.

    x: those given; named: the states that these hold, all of them where None. guess: where the searches start.
    Raises AssemblyError where no run has one.
    """
    found, reasons = np.full(x.shape, np.nan), dict[int, str]()
    same = repeated(t0, table.table, table.rate, table.offset)
    for run in range(len(x)):
        held = x[run] if named is None else {name: float(x[run, model.state_names.index(name)]) for name in named}
        try:
            if not same[run]:
                manifold = manifold_of(model, c[run], table_of(table, run), float(t0[run]))
            found[run] = assembled_on(replace(manifold, c=c[run]), held, guess[run])
        except AssemblyError as error:
            reasons[run] = str(error)
    if len(x) and len(reasons) == len(x):
        raise AssemblyError(f"run 0: {reasons[0]}")
    return found, reasons


def repeated(*rows: NDArray[Any]) -> NDArray[np.bool_]:
    """Which runs (runs,) have the same in all of these (runs, ...) as the run before; what is no number is the same."""
    same = np.ones(len(rows[0]), dtype=bool)
    same[:1] = False
    for each in rows:
        alike = (each[1:] == each[:-1]) | (np.isnan(each[1:]) & np.isnan(each[:-1]))
        same[1:] &= alike.all(axis=tuple(range(1, alike.ndim)))
    return same


def table_of(table: BatchTable, run: int) -> InputTable:
    """The inputs of one run, as a run alone takes them."""
    chosen, rate, offset = table.table[run], table.rate[run], table.offset[run]
    times = [
        np.sort((table.breaks[table.break_first[k] : table.break_last[k]] - shift) / speed)
        for k, speed, shift in zip(chosen, rate, offset, strict=True)
        if speed != 0.0
    ]
    return InputTable(
        pieces=table.pieces,
        first=table.first[chosen],
        last=table.last[chosen],
        rate=rate.copy(),
        offset=offset.copy(),
        order=table.order,
        breakpoints=np.unique(np.concatenate(times)) if times else np.empty(0),
    )
