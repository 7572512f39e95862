"""The inputs of many runs as one table: pieces that runs share are stored once, whatever their rates and offsets."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import numbers, row, shown
from qddot.runner.inputs.bind import as_signal, check_smooth, check_told_apart
from qddot.runner.inputs.instants import INSET
from qddot.runner.inputs.shapes import constant
from qddot.runner.inputs.short import stops_within
from qddot.runner.inputs.signal import Signal
from qddot.runner.lanes.guides import ways
from qddot.runner.lanes.tables import EVEN, GUIDED
from qddot.runner.tables import REST, TIME, Tables

#: What may be given once or for each run.
EACH = "a finite number, or one for each run"


@dataclass(frozen=True, eq=False)
class SignalPerRun:
    """One signal that every run reads at its own tau = rate*t + offset; rate, offset: a number or (runs,)."""

    signal: Signal
    rate: ArrayLike = 1.0
    offset: ArrayLike = 0.0


def per_run(signal: Signal, rate: ArrayLike = 1.0, offset: ArrayLike = 0.0) -> SignalPerRun:
    """A signal read by each run of a batch at rate*t + offset, each a number or (runs,); the signal is stored once.

    A road under an axle that is `place` m ahead, at the speeds v (runs,): per_run(road, rate=v, offset=place). One
    pulse at the times t (runs,): per_run(pulse_train(times=[0], ...), offset=-t).
    """
    if not isinstance(signal, Signal):
        raise ValueError(f"signal is {shown(signal)}, expected a signal, such as qddot.signal.table gives")
    given = {"rate": rate, "offset": offset}
    for name, value in given.items():
        row(name, np.atleast_1d(numbers(name, value, EACH)), EACH)
    return SignalPerRun(signal, rate, offset)


#: What may stand for one input: for all runs, or one for each.
BatchInput = Signal | SignalPerRun | float | Sequence[Signal | float] | NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BatchTable:
    """All inputs of all runs. table, rate, offset (runs, channels); order (channels,): of the time derivative.

    Table k is pieces[first[k] : last[k] + 1] with breaks[break_first[k] : break_last[k]]. way (channels,): how lanes
    find its pieces; even, guided: the channels of either way; buckets, guide, guide_first, hops: see `guides`.
    """

    table: NDArray[np.int64]
    rate: NDArray[np.float64]
    offset: NDArray[np.float64]
    order: NDArray[np.int64]
    way: NDArray[np.int64]
    even: NDArray[np.int64]
    guided: NDArray[np.int64]
    pieces: NDArray[np.float64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    buckets: NDArray[np.int64]
    guide: NDArray[np.int64]
    guide_first: NDArray[np.int64]
    hops: int
    break_first: NDArray[np.int64]
    break_last: NDArray[np.int64]
    breaks: NDArray[np.float64]

    def walked(self) -> "BatchTable":
        """The same for lanes that go from piece to piece, as their steps end where pieces do: none computes places."""
        none = np.zeros(0, dtype=np.int64)
        return replace(self, way=np.zeros_like(self.way), even=none, guided=none)


class _Tables:
    """Distinct piece arrays, numbered in the order in which they are first met."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[int, int], int] = {}
        self.signals: list[Signal] = []

    def number(self, signal: Signal) -> int:
        key = (id(signal.pieces), id(signal.breakpoints))
        if key not in self._numbers:
            self._numbers[key] = len(self.signals)
            self.signals.append(signal)
        return self._numbers[key]


def count_runs(inputs: Any) -> dict[str, int]:
    """What says how many runs there are -> that number."""
    if isinstance(inputs, Mapping):
        sizes = {f"input {name}": _size(value) for name, value in inputs.items()}
        return {name: size for name, size in sizes.items() if size is not None}
    if inputs is None:
        return {}
    if isinstance(inputs, str) or not isinstance(inputs, Sequence) or not all(isinstance(x, Mapping) for x in inputs):
        raise ValueError(f"inputs is {shown(inputs)}, expected a mapping from names to signals, or one for each run")
    return {"inputs": len(inputs)}


def _size(value: Any) -> int | None:
    if isinstance(value, SignalPerRun):
        try:
            shape = np.broadcast_shapes(np.shape(value.rate), np.shape(value.offset))
        except ValueError:
            shapes = f"{np.shape(value.rate)} and {np.shape(value.offset)}"
            raise ValueError(f"rate and offset of a signal are for different numbers of runs: {shapes}") from None
        return shape[0] if shape else None
    return len(value) if _for_each(value) else None


def stack_runs(
    tables: Tables,
    inputs: Any,
    runs: int,
    step: float | None = None,
    sides: Mapping[str, Sequence[Signal]] = MappingProxyType({}),
) -> BatchTable:
    """The table of all channels of all runs, in the kernels' order; inputs not given are 0.

    inputs: name -> what it is for all runs or for each, or one mapping name -> Signal or number for each run. step: a
    constant one, where curved pulses are shorter than it there are stops within them. sides: of conditions in time, for
    each run.
    Raises ValueError as `bind` does, naming the input and, where each run has its own, the run.
    """
    found, zero = _Tables(), constant(0.0)
    columns: dict[str, tuple[Any, Any, Any]] = {name: (found.number(zero), 0.0, 0.0) for name in tables.free_inputs}
    for name, value in (_by_name(tables, inputs, runs, zero) | dict(sides)).items():
        columns[name] = _column(found, f"input {name}", value)
    columns[REST] = (found.number(zero), 0.0, 0.0)
    shape = (runs, len(tables.inputs))
    table, rate, offset = np.zeros(shape, dtype=np.int64), np.zeros(shape), np.zeros(shape)
    for i in range(len(tables.courses), len(tables.inputs)):
        table[:, i] = found.number(zero)
    for i, channel in enumerate(tables.courses):
        table[:, i], rate[:, i], offset[:, i] = columns[channel.name if channel.input == TIME else channel.input]
    for i, channel in sorted(enumerate(tables.inputs[: tables.rhs_inputs]), key=lambda each: -each[1].order):
        for k in np.unique(table[:, i]):
            check_smooth(channel, found.signals[k])
    _check_finite(tables, rate, offset)
    _check_told_apart(tables, found.signals, table, rate, offset)
    order = np.array([channel.order for channel in tables.inputs], dtype=np.int64)
    if step is not None:
        fastest = [np.abs(rate[table == k]).max(initial=0.0) for k in range(len(found.signals))]
        found.signals = [_with_stops(signal, step * v) for signal, v in zip(found.signals, fastest, strict=True)]
    stacked = _stacked(found.signals)
    way, guides = ways(table, [signal.pieces for signal in found.signals], stacked["first"])
    way[order > 1] = 0  # what computes where a piece is knows values and rates
    even, guided = np.flatnonzero(way == EVEN), np.flatnonzero(way == GUIDED)
    return BatchTable(table, rate, offset, order, way, even, guided, **stacked, **guides)


def _by_name(tables: Tables, inputs: Any, runs: int, zero: Signal) -> dict[str, Any]:
    if inputs is None:
        return {}
    mappings = [inputs] if isinstance(inputs, Mapping) else list(inputs)
    names = list(dict.fromkeys(name for mapping in mappings for name in mapping))
    for name in names:
        tables.refuse_derivative(name)
    if isinstance(inputs, Mapping):
        return dict(inputs)
    return {name: [mapping.get(name, zero) for mapping in mappings] for name in names}


def _column(found: _Tables, what: str, value: Any) -> tuple[Any, Any, Any]:
    """Table, rate and offset of an input: numbers, or one for each run."""
    if isinstance(value, SignalPerRun):
        signal = as_signal(what, value.signal)
        rate, offset = np.asarray(value.rate, dtype=float), np.asarray(value.offset, dtype=float)
        return found.number(signal), signal.rate * rate, signal.rate * offset + signal.offset
    if not _for_each(value):
        signal = as_signal(what, value)
        return found.number(signal), signal.rate, signal.offset
    signals = [as_signal(f"{what} of run {i}", _plain(each)) for i, each in enumerate(value)]
    numbers = np.array([found.number(signal) for signal in signals], dtype=np.int64)
    return numbers, np.array([s.rate for s in signals]), np.array([s.offset for s in signals])


def _for_each(value: Any) -> bool:
    """Whether an input is given for each run: a row of what may stand for one."""
    return isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes) and np.shape(value) != ()


def _plain(value: Any) -> Any:
    return float(value) if isinstance(value, np.floating | np.integer) else value


def _check_finite(tables: Tables, rate: NDArray[np.float64], offset: NDArray[np.float64]) -> None:
    bad = np.argwhere(~(np.isfinite(rate) & np.isfinite(offset)))
    if bad.size:
        run, i = bad[0]
        raise ValueError(f"input {tables.inputs[i].name}: rate or offset of run {run} is not finite")


def _check_told_apart(
    tables: Tables,
    signals: list[Signal],
    table: NDArray[np.int64],
    rate: NDArray[np.float64],
    offset: NDArray[np.float64],
) -> None:
    """`check_told_apart` of the runs whose closest breakpoints may be one time at their farthest."""
    for k, signal in enumerate(signals):
        tau = np.sort(signal.breakpoints)
        gaps = np.diff(tau)[np.diff(tau) > INSET * np.abs(tau[1:])]
        if not gaps.size:
            continue
        farthest = np.maximum(np.abs(tau[0] - offset), np.abs(tau[-1] - offset))
        for run, i in np.argwhere((table == k) & (gaps.min() <= INSET * farthest)):
            if tables.inputs[i].order == 0:
                shifted = replace(signal, rate=rate[run, i], offset=offset[run, i])
                check_told_apart(f"input {tables.inputs[i].name} of run {run}", shifted)


def _with_stops(signal: Signal, longest: float) -> Signal:
    breakpoints = np.sort(signal.breakpoints)
    stops = stops_within(signal.pieces, breakpoints, longest)
    return replace(signal, breakpoints=np.union1d(breakpoints, stops)) if stops.size else signal


def _stacked(signals: list[Signal]) -> dict[str, Any]:
    """The piece arrays and breakpoints one behind the other; an array that several signals share is stored once."""
    blocks: dict[int, tuple[int, NDArray[np.float64]]] = {}
    length = 0
    for signal in signals:
        if id(signal.pieces) not in blocks:
            blocks[id(signal.pieces)] = (length, signal.pieces)
            length += len(signal.pieces)
    first = np.array([blocks[id(signal.pieces)][0] for signal in signals], dtype=np.int64)
    counts = [len(signal.breakpoints) for signal in signals]
    ends = np.cumsum(counts, dtype=np.int64)
    # The end of a piece is read from the start of the next: one row more than there are pieces.
    return {
        "pieces": np.ascontiguousarray(np.concatenate([*(block for _, block in blocks.values()), np.zeros((1, 8))])),
        "first": first,
        "last": first + np.array([len(signal.pieces) - 1 for signal in signals], dtype=np.int64),
        "break_first": ends - np.array(counts, dtype=np.int64),
        "break_last": ends,
        "breaks": np.concatenate([*(np.sort(signal.breakpoints) for signal in signals), np.zeros(1)]),
    }
