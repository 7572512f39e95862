"""A model's inputs by name, as the table of channels that its kernels read."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from qddot.runner.checks import finite, shown
from qddot.runner.inputs.instants import INSET
from qddot.runner.inputs.shapes import constant
from qddot.runner.inputs.signal import START, InputTable, Signal, derivative_pieces, jumps, stack
from qddot.runner.tables import REST, TIME, Channel, Tables


def bind(
    tables: Tables, inputs: Mapping[str, Signal | float] | None, sides: Mapping[str, Signal] = MappingProxyType({})
) -> InputTable:
    """The table of all input channels of a model, in its kernels' order; inputs not given are 0.

    inputs: name -> Signal or number, in the unit of that input. Rates follow from the signal of their value. sides: of
    conditions in time, see `switching`.
    Raises ValueError for an unknown name, a rate given by hand, a value that is no signal or finite number, and a
    signal with jumps whose rate, or with kinks whose second rate, the model's right-hand side reads.
    """
    signals = _signals(tables, {} if inputs is None else inputs)
    for channel in sorted(tables.inputs[: tables.rhs_inputs], key=lambda each: -each.order):
        if channel.order:
            check_smooth(channel, signals[channel.input])
    signals |= {REST: constant(0.0)}
    found = [sides[channel.name] if channel.input == TIME else signals[channel.input] for channel in tables.courses]
    found += [constant(0.0) for _ in tables.modes]
    return stack(found, [channel.order for channel in tables.inputs])


def _signals(tables: Tables, inputs: Mapping[str, Signal | float]) -> dict[str, Signal]:
    if not isinstance(inputs, Mapping):
        such = f", such as {{{tables.free_inputs[0]!r}: ...}}" if tables.free_inputs else ""
        raise ValueError(f"inputs is {shown(inputs)}, expected a mapping from names to signals or numbers{such}")
    for name in inputs:
        tables.refuse_derivative(name)
    zero = constant(0.0)
    return {name: as_signal(f"input {name}", inputs[name]) if name in inputs else zero for name in tables.free_inputs}


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


def check_smooth(channel: Channel, signal: Signal) -> None:
    """Refuse a jump of what has a rate: a wheel does not climb a step in no time, nor a trolley change its speed."""
    pieces, tells = signal.pieces, ("jumps", "has a kink, where its rate jumps,")
    for order in range(channel.order):
        found = jumps(pieces)
        if found.size and signal.rate != 0.0:
            at = (signal.pieces[found[0], START] - signal.offset) / signal.rate
            reads = f"the model reads {channel.what.replace('the', 'its')} {channel.name}"
            instead = "give it a ramp" if channel.order == 1 else "give it a course whose rate is continuous"
            times = ("once", "twice")[channel.order - order - 1]
            instead += f", or smooth it, {times}, by qddot.signal.smoothed(signal, width)"
            raise ValueError(f"input {channel.input} {tells[order]} at t = {at:.9g}, but {reads}; {instead}")
        pieces = derivative_pieces(pieces)
