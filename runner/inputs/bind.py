"""A model's inputs by name, as the table of channels that its kernels read."""

from collections.abc import Mapping

import numpy as np

from qddot.runner.checks import finite, shown, unknown
from qddot.runner.inputs.instants import INSET
from qddot.runner.inputs.shapes import constant
from qddot.runner.inputs.signal import START, InputTable, Signal, jumps, stack
from qddot.runner.tables import Tables


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
    if isinstance(value, Signal):
        check_told_apart(what, value)
        return value
    if callable(value):
        raise ValueError(
            f"{what} is a function; give qddot.signal.sampled(function, start, end, tolerance=...), which makes a "
            "table of it, or qddot.signal.table(t, values)"
        )
    if isinstance(value, list | tuple) or np.ndim(value) > 0:
        raise ValueError(
            f"{what} is a row of {np.size(value)} values; give qddot.signal.table(t, values), which says "
            "when each holds"
        )
    return constant(finite(what, value))


def check_told_apart(what: str, signal: Signal) -> None:
    """Refuse breakpoints that rate and offset bring to times that are one: a pulse between them would be lost."""
    if signal.rate == 0.0 or len(signal.breakpoints) < 2 or (signal.rate, signal.offset) == (1.0, 0.0):
        return
    tau = np.sort(signal.breakpoints)
    times = (tau - signal.offset) / signal.rate
    lost = np.abs(np.diff(times)) <= INSET * np.abs(times[1:])
    lost &= np.diff(tau) > INSET * np.abs(tau[1:])
    for i in np.flatnonzero(lost)[:1]:
        raise ValueError(
            f"{what} has breakpoints {(tau[i + 1] - tau[i]) / abs(signal.rate):.6g} s apart at t = {times[i]!r}, where "
            f"floating-point times are {np.spacing(abs(times[i])):.3g} s apart; count time from nearer to them"
        )


def check_continuous(name: str, signal: Signal, rate_name: str) -> None:
    """Refuse a jump, which has no rate: a wheel does not climb a step in no time."""
    found = jumps(signal.pieces)
    if found.size and signal.rate != 0.0:
        at = (signal.pieces[found[0], START] - signal.offset) / signal.rate
        raise ValueError(
            f"input {name} jumps at t = {at:.9g}, but the model reads its rate {rate_name}; give it a ramp"
        )
