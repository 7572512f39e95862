"""What a figure of a study's inputs shows: values over time, the road over distance, its spectrum."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.iso8608 import CLASSES, octave_bands, power_spectral_density
from qddot.runner.inputs.signal import Signal
from qddot.runner.pictures.points import points
from qddot.runner.pictures.scales import legible
from qddot.runner.tables import Channel

Vector = NDArray[np.float64]

#: The shortest part of a road that has a spectrum worth drawing, m.
SHORT_ROAD = 10.0


@dataclass(frozen=True, eq=False)
class Line:
    """A curve (x, y), its name (none: no entry in the legend) and how it is drawn."""

    x: Vector
    y: Vector
    label: str = ""
    style: str = "-"
    colour: str | None = None


@dataclass(frozen=True, eq=False)
class Sheet:
    """One panel: its lines and the names of its axes; logarithmic: both axes, with notes (x, y, text) beside lines."""

    lines: tuple[Line, ...]
    x_label: str
    y_label: str
    logarithmic: bool = False
    notes: tuple[tuple[float, float, str], ...] = ()


def over_time(signals: Mapping[str, Signal], channels: Mapping[str, Channel], span: tuple[float, float]) -> list[Sheet]:
    """The inputs over the span of the run, one panel a unit."""
    units = dict.fromkeys(channels[name].unit for name in signals)
    sheets = []
    for unit in units:
        names = [name for name in signals if channels[name].unit == unit]
        lines = tuple(
            Line(*points(signals[name], signals[name].breakpoint_times(), span), channels[name].meaning)
            for name in names
        )
        sheets.append(Sheet(lines, "t, s", legible(unit)))
    return sheets


def over_distance(road: Signal, reach: tuple[float, float]) -> Sheet:
    """The road between two distances, m."""
    return Sheet((Line(*points(road, road.breakpoints, reach), "road"),), "distance, m", "m")


def spectrum(road: Signal, reach: tuple[float, float], highest: float) -> Sheet | None:
    """The PSD of the road up to `highest` cycles/m and the limits of the ISO 8608 classes; none for a short road."""
    begin, end = reach
    if end - begin < SHORT_ROAD:
        return None
    frequencies, psd = power_spectral_density(road, begin, end, max(1, round((end - begin) / 50)))
    shown = (frequencies <= highest) & (psd > 0)
    if shown.sum() < 4:
        return None
    frequencies, psd = frequencies[shown], psd[shown]
    ends = np.array([frequencies[0], frequencies[-1]])
    limits = [2 * value for value in CLASSES.values()][:-1]
    lines = [Line(ends, limit * (ends / 0.1) ** -2.0, style=":", colour="0.6") for limit in limits]
    notes = tuple((ends[0], value * (ends[0] / 0.1) ** -2.0, name) for name, value in CLASSES.items())
    lines.append(Line(frequencies, psd, "displacement PSD (Welch)"))
    lines.append(Line(*octave_bands(frequencies, psd), "octave bands", "o"))
    return Sheet(tuple(lines), "spatial frequency, cycles/m", "PSD, m³", True, notes)


def integral(signal: Signal, x: Vector) -> float:
    """The integral of a signal over arguments x (n,) between which it has no breakpoint, by Gauss's rule."""
    places, weights = np.polynomial.legendre.leggauss(4)
    middle, half = (x[1:] + x[:-1]) / 2, np.diff(x) / 2
    return float(half @ (signal(middle[:, None] + np.outer(half, places)) @ weights))
