"""Drawing curves. This file imports no compiler: `background` runs it in a process of its own while the run goes on."""

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from qddot.runner.files import written_aside

if TYPE_CHECKING:
    from qddot.runner.report.curves import Curves

#: Colours that stay apart for colour-blind readers (Wong, Nature Methods 8 (2011) 441).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")


def draw(curves: "Curves", path: Path) -> Path:
    """Draw the panels one under the other and write the picture (PNG, SVG or PDF by its suffix)."""
    height = 1.1 + 1.9 * len(curves.panels)
    figure = Figure(figsize=(8.0, height))
    figure.subplots_adjust(left=0.12, right=0.97, bottom=0.5 / height, top=1 - 0.6 / height, hspace=0.28)
    axes = figure.subplots(len(curves.panels), sharex=True, squeeze=False)[:, 0]
    for axis, panel in zip(axes, curves.panels, strict=True):
        for curve, colour in zip(panel, COLOURS * len(panel), strict=False):
            axis.plot(curves.t, curve.values, color=colour, linewidth=1.2, label=curve.label)
        axis.set_ylabel(", ".join(dict.fromkeys(curve.unit for curve in panel)))
        dress(axis, min(3, len(panel)))
    axes[-1].set_xlabel("t in s")
    figure.align_ylabels(axes)
    figure.suptitle(curves.title, fontsize="medium", y=1 - 0.1 / height, va="top")
    return save(figure, path)


def panels(
    count: int, height: float = 2.9, *, title: str = "", below: str = "", share_x: bool = False
) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels under each other, each `height` inches high, on a light grid and without a box.

    below: what stands below the last panel. share_x: one horizontal axis for all, its numbers below the last panel.
    """
    figure = Figure(figsize=(8.0, 1.0 + height * count), layout="constrained")
    axes = list(figure.subplots(count, sharex=share_x, squeeze=False)[:, 0])
    for axis in axes:
        lighten(axis)
    axes[-1].set_xlabel(below)
    figure.suptitle(title, fontsize="medium")
    return figure, axes


def lighten(axis: Axes) -> None:
    """A light grid and no box."""
    axis.grid(color="0.9", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)


def dress(axis: Axes, columns: int) -> None:
    """A light grid, no box, and a legend of so many columns above."""
    lighten(axis)
    axis.margins(x=0.0, y=0.15)
    corner = (1.0, 1.0)
    axis.legend(
        loc="lower right", bbox_to_anchor=corner, borderaxespad=0.0, fontsize="small", frameon=False, ncols=columns
    )


def save(figure: Figure, path: Path) -> Path:
    """Write a figure (PNG, SVG or PDF by its suffix)."""
    FigureCanvasAgg(figure)
    with written_aside(path) as aside:
        suffix = path.suffix.removeprefix(".") or "png"
        quick = {"compress_level": 1} if suffix == "png" else None
        figure.savefig(aside, dpi=150, format=suffix, pil_kwargs=quick)
    return path
