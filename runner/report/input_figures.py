"""Drawing a study's inputs."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qddot.runner.pictures.figures import dress, save
from qddot.runner.pictures.picture import COLOURS
from qddot.runner.report.input_curves import Sheet

#: Inches of a panel over time or distance, and of a spectrum.
HEIGHT, TALL = 2.2, 4.0


def draw_inputs(title: str, sheets: Sequence[Sheet], path: Path) -> Path:
    """Draw the panels one under the other and write the picture (PNG, SVG or PDF by its suffix)."""
    heights = [TALL if sheet.logarithmic else HEIGHT for sheet in sheets]
    figure = Figure(figsize=(8.0, 0.6 + sum(heights)), layout="constrained")
    axes = figure.subplots(len(sheets), squeeze=False, height_ratios=heights)[:, 0]
    for axis, sheet in zip(axes, sheets, strict=True):
        _panel(axis, sheet)
    figure.align_ylabels(axes)
    figure.suptitle(title, fontsize="medium")
    return save(figure, path)


def _panel(axis: Axes, sheet: Sheet) -> None:
    colours = iter(COLOURS * len(sheet.lines))
    for line in sheet.lines:
        colour = line.colour or next(colours)
        axis.plot(line.x, line.y, line.style, color=colour, linewidth=1.1, markersize=4, label=line.label or None)
    axis.set_xlabel(sheet.x_label)
    axis.set_ylabel(sheet.y_label)
    if sheet.logarithmic:
        axis.set_xscale("log")
        axis.set_yscale("log")
    for x, y, text in sheet.notes:
        axis.annotate(
            text, (x, y), xytext=(4, 0), textcoords="offset points", fontsize="small", color="0.4", va="center"
        )
    dress(axis, min(3, sum(bool(line.label) for line in sheet.lines)))
