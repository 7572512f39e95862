"""Drawing pictures with matplotlib, which is slow to import. Nothing here imports a compiler."""

import io
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from qddot.runner.files import written_aside
from qddot.runner.pictures.picture import COLOURS

if TYPE_CHECKING:
    from qddot.runner.pictures.picture import Panel, Picture


#: Inches: width, a panel's height, between panels, above the first and below the last of them, and a line of text.
_WIDTH, _PANEL, _GAP, _TOP, _BELOW, _LINE = 8.0, 1.45, 0.36, 0.36, 0.52, 0.17
#: Where panels begin and end across, and the letters of a line of the title, of a note, and at a vertical axis.
_LEFT, _RIGHT, _TITLE, _NOTE, _AXIS = 0.125, 0.97, 88, 118, 20
#: Letters in a row of a legend, of which an entry takes some for its line.
_ROW, _HANDLE = 100, 7


class Drawn(Figure):
    """A matplotlib figure that a notebook shows, whether or not pyplot was imported."""

    def _repr_png_(self) -> bytes:
        written = io.BytesIO()
        self.savefig(written, format="png", dpi=100)
        return written.getvalue()


def drawn(picture: "Picture") -> Drawn:
    """The panels one under the other."""
    title = textwrap.wrap(picture.title, _TITLE)
    notes = [line for note in picture.notes for line in textwrap.wrap(note, _NOTE)]
    rows = [_legend_rows(panel)[0] for panel in picture.panels]
    gaps = [_LINE * max(0, row - 1) for row in rows]
    top = _TOP + 1.25 * _LINE * len(title) + (gaps[0] if gaps else 0.0)
    below = _BELOW + _LINE * len(notes)
    between = _GAP + max(gaps[1:], default=0.0)
    count = len(picture.panels)
    height = top + below + _PANEL * count + between * (count - 1)
    figure = Drawn(figsize=(_WIDTH, height))
    figure.subplots_adjust(
        left=_LEFT, right=_RIGHT, bottom=below / height, top=1 - top / height, hspace=between / _PANEL
    )
    axes = list(figure.subplots(count, sharex=True, squeeze=False)[:, 0]) if count else []
    for axis, panel in zip(axes, picture.panels, strict=True):
        draw_panel(axis, panel)
    if count:
        axes[-1].set_xlabel(plain(picture.x))
        figure.align_ylabels(axes)
    figure.suptitle(plain("\n".join(title)), fontsize="medium", y=1 - 0.1 / height, va="top")
    figure.text(_LEFT, 0.06 / height, plain("\n".join(notes)), fontsize="x-small", color="0.35", va="bottom")
    return figure


def draw(picture: "Picture", path: Path) -> Path:
    """Write the picture (PNG, SVG or PDF by its suffix)."""
    return save(drawn(picture), path)


def plain(text: str) -> str:
    """A text as it is: no mathematics for matplotlib between dollars."""
    return text.replace("$", r"\$")


def draw_panel(axis: Axes, panel: "Panel") -> None:
    """Draw the curves of a panel, with what stands beside and above it."""
    for curve in panel.curves:
        colour = COLOURS[curve.colour % len(COLOURS)]
        style = "--" if curve.dashed else "-"
        axis.plot(curve.x, curve.values + curve.raised, style, color=colour, linewidth=1.2, label=plain(curve.name))
        if curve.band is not None:
            low, high = (edge + curve.raised for edge in curve.band)
            axis.fill_between(curve.x, low, high, color=colour, alpha=0.2, linewidth=0)
    axis.set_ylabel(plain("\n".join(textwrap.wrap(panel.axis, _AXIS)[:3])))
    lighten(axis)
    axis.margins(x=0.0, y=0.15)
    axis.set_title(plain(panel.above), fontsize="small", color="0.35", loc="left", pad=4)
    if panel.spacing:
        axis.set_yticks([curve.raised for curve in panel.curves], [plain(curve.name) for curve in panel.curves])
        axis.set_ylabel("")
    elif panel.legend:
        _legend(axis, _legend_rows(panel)[1])


def _legend_rows(panel: "Panel") -> tuple[int, int]:
    """Rows and columns of the legend above a panel, what else stands there taken off its first row."""
    if not panel.legend or not panel.curves:
        return int(bool(panel.above)), 0
    lengths = [len(curve.name) + _HANDLE for curve in panel.curves]
    room = _ROW - len(panel.above)
    columns = len(lengths) if sum(lengths) <= room else max(1, room // max(lengths))
    return -(-len(panel.curves) // columns), columns


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
    figure.suptitle(wrapped(title), fontsize="medium")
    return figure, axes


def wrapped(title: str) -> str:
    """A title in lines that a figure has room for."""
    return plain("\n".join(textwrap.wrap(title, _TITLE)))


def lighten(axis: Axes) -> None:
    """A light grid and no box."""
    axis.grid(color="0.9", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)


def dress(axis: Axes, columns: int) -> None:
    """A light grid, no box, and a legend of so many columns above."""
    lighten(axis)
    axis.margins(x=0.0, y=0.15)
    if len(axis.get_legend_handles_labels()[1]) > 1:
        _legend(axis, columns)


def _legend(axis: Axes, columns: int) -> None:
    axis.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.0,
        fontsize="small",
        frameon=False,
        ncols=columns,
        borderpad=0.2,
        labelspacing=0.2,
    )


def save(figure: Figure, path: Path) -> Path:
    """Write a figure (PNG, SVG or PDF by its suffix)."""
    FigureCanvasAgg(figure)
    with written_aside(path) as aside:
        suffix = path.suffix.removeprefix(".") or "png"
        quick: dict[str, Any] = {"pil_kwargs": {"compress_level": 1}} if suffix == "png" else {}
        figure.savefig(aside, dpi=150, format=suffix, **quick)
    return path
