"""Signals from formulas: constant, sine, pulse trains."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from runner.checks import finite, unknown
from runner.inputs.signal import AMPLITUDE, C0, C1, FREQUENCY, PHASE, START, Signal

#: Pulse edges closer than this part of a duration are one edge.
SAME_EDGE = 1e-9


def constant(value: float) -> Signal:
    """The same value for ever."""
    pieces = np.zeros((1, 8))
    pieces[0, C0] = finite("value", value)
    return Signal(pieces, np.empty(0))


def sine(amplitude: float, frequency: float, phase: float = 0.0, mean: float = 0.0) -> Signal:
    """Mean + amplitude*sin(2 pi frequency t + phase); frequency in Hz, phase in rad."""
    pieces = np.zeros((1, 8))
    pieces[0, C0] = finite("mean", mean)
    pieces[0, AMPLITUDE] = finite("amplitude", amplitude)
    pieces[0, FREQUENCY] = 2 * np.pi * finite("frequency", frequency)
    pieces[0, PHASE] = finite("phase", phase)
    return Signal(pieces, np.empty(0))


class Segment(NamedTuple):
    """A part of a pulse of duration 1 and peak 1: from start to end it is value + slope*s + amplitude*sin(pi*s)."""

    start: float
    end: float
    value: float = 0.0
    slope: float = 0.0
    amplitude: float = 0.0


def _half_sine(rise: float) -> tuple[Segment, ...]:
    return (Segment(0.0, 1.0, amplitude=1.0),)


def _triangle(rise: float) -> tuple[Segment, ...]:
    return _trapezoid(0.5)


def _trapezoid(rise: float) -> tuple[Segment, ...]:
    rise = rise if rise > SAME_EDGE else 0.0
    ramp = 1.0 / rise if rise else 0.0
    parts = (
        Segment(0.0, rise, slope=ramp),
        Segment(rise, 1.0 - rise, value=1.0),
        Segment(1.0 - rise, 1.0, value=1.0, slope=-ramp),
    )
    return tuple(part for part in parts if part.end > part.start)


SHAPES = {"half_sine": _half_sine, "triangle": _triangle, "trapezoid": _trapezoid}


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

    shape: "half_sine", "triangle" or "trapezoid" (`rise`: the part of the duration that each ramp takes, 0 to 0.5; at 0
    it is a rectangle). Any two of peak, duration (s) and impulse = integral of one pulse give the third.
    Raises ValueError naming the argument.
    """
    if shape not in SHAPES:
        raise ValueError(unknown("pulse shape", shape, SHAPES))
    if not 0 <= finite("rise", rise) <= 0.5:
        raise ValueError(f"rise is {rise}, expected a part of the duration from 0 to 0.5")
    starts = np.sort(np.atleast_1d(np.asarray(times, dtype=np.float64)))
    if starts.ndim != 1 or starts.size == 0 or not np.isfinite(starts).all():
        raise ValueError(f"times is {times!r}, expected one or more finite times at which pulses start")
    segments = SHAPES[shape](rise)
    peak, duration = _peak_and_duration(peak, duration, impulse, _area(segments))
    return _superposed(segments, starts, peak, duration)


def _area(segments: tuple[Segment, ...]) -> float:
    lengths = np.array([part.end - part.start for part in segments])
    values = np.array([part.value for part in segments]) + 0.5 * lengths * [part.slope for part in segments]
    return float(values @ lengths + 2 / np.pi * sum(part.amplitude for part in segments))


def _peak_and_duration(
    peak: float | None, duration: float | None, impulse: float | None, area: float
) -> tuple[float, float]:
    """Peak and duration from any two of the three, where impulse = area * peak * duration."""
    given = {"peak": peak, "duration": duration, "impulse": impulse}
    known = {name: finite(name, value) for name, value in given.items() if value is not None}
    if len(known) != 2:
        found = " and ".join(known) or "none"
        raise ValueError(f"a pulse needs two of peak, duration and impulse; given: {found}")
    if known.get("duration", 1.0) <= 0:
        raise ValueError(f"duration is {duration}, expected a time greater than 0")
    if "peak" not in known:
        return known["impulse"] / (area * known["duration"]), known["duration"]
    if "duration" in known:
        return known["peak"], known["duration"]
    if known["impulse"] * known["peak"] <= 0:
        raise ValueError(f"peak {peak} and impulse {impulse} must have the same sign and not vanish")
    return known["peak"], known["impulse"] / (area * known["peak"])


def _superposed(segments: tuple[Segment, ...], starts: NDArray[np.float64], peak: float, duration: float) -> Signal:
    """The sum of the pulses. Sines of one frequency add up as phasors: an overlap of half-sines is exact, too."""
    near = SAME_EDGE * duration
    edges = np.unique(np.concatenate([starts + duration * at for part in segments for at in (part.start, part.end)]))
    knots = edges[np.diff(edges, prepend=-np.inf) > near]
    pieces = np.zeros((len(knots) + 1, 8))
    pieces[0, START], pieces[1:, START] = knots[0] - duration, knots
    phasors = np.zeros(len(pieces), dtype=np.complex128)
    for part in segments:
        begins = starts + duration * part.start
        firsts = np.searchsorted(knots, begins - near) + 1
        lasts = np.searchsorted(knots, starts + duration * part.end - near) + 1
        for begin, start, first, last in zip(begins, starts, firsts, lasts, strict=True):
            covered = slice(first, last)
            pieces[covered, C0] += peak * (part.value + part.slope * (pieces[covered, START] - begin) / duration)
            pieces[covered, C1] += peak * part.slope / duration
            phasors[covered] += peak * part.amplitude * np.exp(1j * np.pi * (pieces[covered, START] - start) / duration)
    pieces[:, AMPLITUDE], pieces[:, PHASE] = np.abs(phasors), np.angle(phasors)
    pieces[:, FREQUENCY] = np.where(phasors != 0, np.pi / duration, 0.0)
    return Signal(pieces, knots)
