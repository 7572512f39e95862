"""A model's inputs by name, as the table of channels that its kernels read."""

from collections.abc import Mapping

import numpy as np

from runner.checks import finite, shown, unknown
from runner.inputs.shapes import constant
from runner.inputs.signal import AMPLITUDE, C0, FREQUENCY, PHASE, START, InputTable, Signal, stack
from runner.tables import Tables

#: Jump relative to the largest value that counts as a jump rather than rounding.
JUMP = 1e-9


def bind(tables: Tables, inputs: Mapping[str, Signal | float] | None = None) -> InputTable:
    """The table of all input channels of a model, in its kernels' order; inputs not given are 0.

    inputs: name -> Signal or number, in the unit of that input. Rate channels follow from the signal of their value.
    Raises ValueError for an unknown name, a rate given by hand, a value that is no signal or finite number, and a
    signal with jumps whose rate the model's right-hand side reads.
    """
    signals = _signals(tables, {} if inputs is None else inputs)
    for channel in tables.inputs[: tables.rhs_inputs]:
        if channel.rate_of:
            check_continuous(channel.rate_of, signals[channel.rate_of], channel.name)
    channels = [signals[channel.rate_of or channel.name] for channel in tables.inputs]
    return stack(channels, [int(bool(channel.rate_of)) for channel in tables.inputs])


def _signals(tables: Tables, inputs: Mapping[str, Signal | float]) -> dict[str, Signal]:
    if not isinstance(inputs, Mapping):
        free = [channel.name for channel in tables.inputs if not channel.rate_of]
        such = f", such as {{{free[0]!r}: ...}}" if free else ""
        raise ValueError(f"inputs is {shown(inputs)}, expected a mapping from names to signals or numbers{such}")
    rate_of = {channel.name: channel.rate_of for channel in tables.inputs}
    free = [name for name, value in rate_of.items() if not value]
    for name in inputs:
        if name not in rate_of:
            raise ValueError(f"model {tables.name}: {unknown('input', name, free)}")
        if rate_of[name]:
            raise ValueError(f"model {tables.name}: {name} is the rate of {rate_of[name]}; give {rate_of[name]}")
    zero = constant(0.0)
    return {name: as_signal(f"input {name}", inputs[name]) if name in inputs else zero for name in free}


def as_signal(what: str, value: Signal | float) -> Signal:
    """The signal, or the constant of this number; raises ValueError naming `what`."""
    return value if isinstance(value, Signal) else constant(finite(what, value))


def check_continuous(name: str, signal: Signal, rate_name: str) -> None:
    """Refuse a jump, which has no rate: a wheel does not climb a step in no time."""
    pieces = signal.pieces
    before, length = pieces[:-1], np.diff(pieces[:, START])
    sines = before[:, AMPLITUDE] * np.sin(before[:, FREQUENCY] * length + before[:, PHASE])
    ends = np.polynomial.polynomial.polyval(length, before[:, C0 : C0 + 4].T, tensor=False) + sines
    starts = pieces[1:, C0] + pieces[1:, AMPLITUDE] * np.sin(pieces[1:, PHASE])
    sizes = (ends, starts, pieces[:, AMPLITUDE])  # a half-sine is 0 at both ends, but for rounding
    largest = max(np.abs(each).max(initial=0.0) for each in sizes)
    jumps = np.flatnonzero(np.abs(starts - ends) > JUMP * largest)
    if jumps.size and signal.rate != 0.0:
        at = (pieces[jumps[0] + 1, START] - signal.offset) / signal.rate
        raise ValueError(
            f"input {name} jumps at t = {at:.9g}, but the model reads its rate {rate_name}; give it a ramp"
        )
