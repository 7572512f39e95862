"""Signals from formulas: constant, sine, pulse trains.

A function of numbers here is a kind of input in studies, too, and its arguments are the keys; a function `NAME_pulse`
is a shape of pulses.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from qddot.runner.checks import finite, unknown
from qddot.runner.inputs.formulas import Angle, Frequency, Value
from qddot.runner.inputs.pulses import Pulse, Vector, sized, start_times, train
from qddot.runner.inputs.signal import AMPLITUDE, C0, C1, C2, C3, FREQUENCY, PHASE, START, Signal

#: A decaying pulse lasts until the plain exponential would have fallen to this part of the peak.
DECAY = 0.01
#: Cubics that make up a decaying pulse: they differ from it by less than 1e-6 of the peak.
DECAY_PIECES = 40
#: A ramp that takes a smaller part of its pulse is a jump, and a plateau that does is none.
UPRIGHT = 1e-9


def constant(value: Value) -> Signal:
    """The same value for ever."""
    pieces = np.zeros((1, 8))
    pieces[0, C0] = finite("value", value)
    return Signal(pieces, np.empty(0))


def sine(amplitude: Value, frequency: Frequency, phase: Angle = 0.0, mean: Value = 0.0) -> Signal:
    """Mean + amplitude*sin(2 pi frequency t + phase); frequency in Hz, phase in rad."""
    pieces = np.zeros((1, 8))
    pieces[0, C0] = finite("mean", mean)
    pieces[0, AMPLITUDE] = finite("amplitude", amplitude)
    pieces[0, FREQUENCY] = 2 * np.pi * finite("frequency", frequency)
    pieces[0, PHASE] = finite("phase", phase)
    return Signal(pieces, np.empty(0))


def hermite(starts: Vector, ends: Vector, values: Vector, slopes: Vector) -> Vector:
    """Pieces (n, 8) from starts to ends (n,): cubics with these values (n, 2) and slopes (n, 2) at both."""
    pieces = np.zeros((len(starts), 8))
    h = ends - starts
    chord = (values[:, 1] - values[:, 0]) / h
    pieces[:, START], pieces[:, C0], pieces[:, C1] = starts, values[:, 0], slopes[:, 0]
    pieces[:, C2] = (3 * chord - 2 * slopes[:, 0] - slopes[:, 1]) / h
    pieces[:, C3] = (slopes[:, 0] + slopes[:, 1] - 2 * chord) / h**2
    return pieces


def half_sine_pulse(rise: float) -> Pulse:
    """Half a wave of a sine."""
    pieces = np.zeros((1, 8))
    pieces[0, AMPLITUDE], pieces[0, FREQUENCY] = 1.0, np.pi
    return Pulse(pieces, np.array([0.0, 1.0]), 1.0)


def triangle_pulse(rise: float) -> Pulse:
    """Up and down in straight lines."""
    return trapezoid_pulse(0.5)


def trapezoid_pulse(rise: float) -> Pulse:
    """Up, level, and down, in straight lines."""
    rise = 0.5 if 1 - 2 * rise < UPRIGHT else rise if rise > UPRIGHT else 0.0
    edges = np.array([0.0, rise, 1.0 - rise, 1.0])
    slopes = np.array([1 / rise, 0.0, -1 / rise]) if rise else np.zeros(3)
    parts = np.diff(edges) > 0
    pieces = np.zeros((parts.sum(), 8))
    pieces[:, START] = edges[:-1][parts]
    pieces[:, C0] = np.array([0.0, 1.0, 1.0])[parts]
    pieces[:, C1] = slopes[parts]
    return Pulse(pieces, np.unique(edges), 1.0)


def exponential_pulse(rise: float) -> Pulse:
    """(exp(-k s) - DECAY) / (1 - DECAY) with exp(-k) = DECAY: from 1 to 0, without a jump at the end."""
    k, s = -np.log(DECAY), np.linspace(0.0, 1.0, DECAY_PIECES + 1)
    values, slopes = (np.exp(-k * s) - DECAY) / (1 - DECAY), -k * np.exp(-k * s) / (1 - DECAY)
    pieces = hermite(s[:-1], s[1:], np.stack([values[:-1], values[1:]], 1), np.stack([slopes[:-1], slopes[1:]], 1))
    return Pulse(pieces, np.array([0.0, 1.0]), 1.0)


def pulse_train(
    shape: str = "half_sine",
    *,
    times: ArrayLike,
    peak: float | None = None,
    duration: float | None = None,
    impulse: float | None = None,
    rise: float = 0.25,
) -> Signal:
    """Equal pulses that start at `times` (n,), zero between them; where pulses overlap, they add up.

    shape: "half_sine", "triangle", "trapezoid" (`rise`: the part of the duration that each ramp takes, 0 to 0.5; at 0
    it is a rectangle) or "exponential" (a jump to the peak, then peak (e^(-ks) - e^(-k)) / (1 - e^(-k)) with s = time
    since the start / duration and e^(-k) = 0.01: it reaches 0 at its duration, 4.6 time constants after the jump). Any
    two of peak, duration (s) and impulse = integral of one pulse give the third. However far from zero, a pulse has the
    values of its definition to rounding, and edges at the nearest floating-point times.
    Raises ValueError naming the argument, or the pulse whose edges are less than a thousand spacings of floating-point
    numbers apart: 15 ns a day after zero, 0.24 ms an epoch (1.7e9 s) after it.
    """
    if not isinstance(shape, str) or shape not in SHAPES:
        raise ValueError(unknown("pulse shape", shape, SHAPES))
    if not 0 <= finite("rise", rise) <= 0.5:
        raise ValueError(f"rise is {rise}, expected a part of the duration from 0 to 0.5")
    starts = start_times(times)
    return train(sized(SHAPES[shape](rise), peak, duration, impulse), starts)


#: Shapes of pulses by name, from the part of the duration that a ramp takes.
SHAPES: dict[str, Callable[[float], Pulse]] = {
    name.removesuffix("_pulse"): each for name, each in list(globals().items()) if name.endswith("_pulse")
}
