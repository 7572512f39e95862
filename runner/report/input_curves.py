"""What a figure of a study's inputs shows: values over time, the road over distance, its spectrum."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.iso8608 import CLASSES, octave_bands, power_spectral_density
from qddot.runner.inputs.signal import Signal
from qddot.runner.pictures.panel import Line, panel_of
from qddot.runner.pictures.picture import Picture
from qddot.runner.pictures.points import points
from qddot.runner.tables import Channel

Vector = NDArray[np.float64]

#: The shortest part of a road that has a spectrum worth drawing, m.
SHORT_ROAD = 10.0


@dataclass(frozen=True, eq=False)
class Drawn:
    """A curve (x, y) of a spectrum, its name (none: no entry in the legend) and how it is drawn."""

    x: Vector
    y: Vector
    label: str = ""
    style: str = "-"
    colour: str | None = None


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The curves of a spectrum in m³ over cycles/m, and the names of classes (x, y, text) beside them."""

    lines: tuple[Drawn, ...]
    notes: tuple[tuple[float, float, str], ...]


def over_time(
    signals: Mapping[str, Signal], channels: Mapping[str, Channel], span: tuple[float, float], title: str = ""
) -> Picture:
    """The inputs over a time that has a length, s, one panel a unit; those of one size raised apart."""
    still: list[str] = []
    groups: dict[str, list[Line]] = {}
    for name, signal in signals.items():
        t, values = points(signal, signal.breakpoint_times(), span)
        if values.any():
            line = Line(t, values, name, channels[name].unit, channels[name].meaning)
            groups.setdefault(line.unit, []).append(line)
        else:
            still.append(name)
    notes = (f"0 throughout, not drawn: {', '.join(still)}",) if still else ()
    return Picture(title, tuple(panel_of(lines, (), apart=True) for lines in groups.values()), notes=notes)


def over_distance(road: Signal, reach: tuple[float, float]) -> Picture:
    """The road between two distances, m."""
    line = Line(*points(road, road.breakpoints, reach), "road", "m")
    return Picture("", (panel_of([line]),), x="distance, m")


def spectrum(road: Signal, reach: tuple[float, float], highest: float) -> Spectrum | None:
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
    lines = [Drawn(ends, limit * (ends / 0.1) ** -2.0, style=":", colour="0.6") for limit in limits]
    notes = tuple((ends[0], value * (ends[0] / 0.1) ** -2.0, name) for name, value in CLASSES.items())
    lines.append(Drawn(frequencies, psd, "displacement PSD (Welch)"))
    lines.append(Drawn(*octave_bands(frequencies, psd), "octave bands", "o"))
    return Spectrum(tuple(lines), notes)


def integral(signal: Signal, x: Vector) -> float:
    """The integral of a signal over arguments x (n,) between which it has no breakpoint, by Gauss's rule."""
    places, weights = np.polynomial.legendre.leggauss(4)
    middle, half = (x[1:] + x[:-1]) / 2, np.diff(x) / 2
    return float(half @ (signal(middle[:, None] + np.outer(half, places)) @ weights))
