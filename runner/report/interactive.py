"""Pictures on a page: plots to point at and to zoom into, drawn by what `page` brings along."""

import math
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.notebook import thinned
from qddot.runner.pictures.picture import COLOURS, Curve, Panel, Picture
from qddot.runner.report.page import Section, plot

Vector = NDArray[np.float64]

#: The most points of a curve, and the digits of its values.
POINTS, DIGITS = 2400, 6


def plots(picture: Picture, first: int = 0) -> tuple[str, list[dict[str, Any]]]:
    """The places of the panels as HTML and what is drawn in them; first: how many plots the page has before."""
    drawn = [_plot(panel, picture.x, f"plot_{first + k + 1}") for k, panel in enumerate(picture.panels)]
    places = "".join(plot(first + k, _title(panel)) for k, panel in enumerate(picture.panels))
    return places, drawn


def section(title: str, picture: Picture, first: int = 0, before: str = "") -> tuple[Section, list[dict[str, Any]]]:
    """A section of a page with the picture's plots; before: HTML that stands above them."""
    places, drawn = plots(picture, first)
    notes = "".join(f'<p class="note">{escape(note)}</p>' for note in picture.notes)
    return Section(title, before + places + notes), drawn


def _title(panel: Panel) -> str:
    """What is said above a plot; levels of curves that are raised in a picture are not raised here."""
    above = panel.above.partition(";")[0] if panel.spacing else panel.above
    return above or ", ".join(curve.name for curve in panel.curves)


def _plot(panel: Panel, x: str, name: str) -> dict[str, Any]:
    return {
        "name": name,
        "x": x,
        "y": panel.axis,
        "unit": panel.unit,
        "cursor": True,
        "traces": [_trace(curve) for curve in panel.curves],
    }


def _trace(curve: Curve) -> dict[str, Any]:
    columns = [curve.values, *(curve.band or ())]
    at = np.unique(np.concatenate([thinned(curve.x, column, POINTS) for column in columns]))
    at = at[::-1] if len(at) and curve.x[at[0]] > curve.x[at[-1]] else at  # a page draws from left to right
    trace: dict[str, Any] = {"name": curve.name, "x": along(curve.x[at]), "y": numbers(curve.values[at])}
    trace["colour"] = COLOURS[curve.colour % len(COLOURS)]
    if curve.dashed:
        trace["dash"] = "dash"
    if curve.band is not None:
        trace["low"], trace["high"] = (numbers(edge[at]) for edge in curve.band)
    return trace


def numbers(values: Vector, digits: int = DIGITS) -> list[float | None]:
    """Numbers as a page has them, short; None for those that are not finite, where the curve has a gap."""
    return [float(f"{value:.{digits}g}") if math.isfinite(value) else None for value in values]


def along(x: Vector) -> list[float]:
    """Places along an axis to a millionth of its length or better, however far from 0 it begins."""
    length = float(np.ptp(x)) if len(x) else 0.0
    return [float(value) for value in np.round(x, 7 - math.floor(math.log10(length)))] if length else x.tolist()
