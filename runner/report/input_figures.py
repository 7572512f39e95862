"""Drawing a study's inputs."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qddot.runner.pictures.figures import draw_panel, dress, plain, save
from qddot.runner.pictures.picture import COLOURS, Picture
from qddot.runner.report.input_curves import Spectrum

#: Inches of a panel over time or distance, and of a spectrum.
HEIGHT, TALL = 2.2, 4.0


def draw_inputs(title: str, pictures: Sequence[Picture], spectrum: Spectrum | None, path: Path) -> Path:
    """Draw panels, and a spectrum, one under the other and write the picture (PNG, SVG or PDF by its suffix)."""
    panels = [(panel, picture.x) for picture in pictures for panel in picture.panels]
    heights = [HEIGHT] * len(panels) + [TALL] * (spectrum is not None)
    figure = Figure(figsize=(8.0, 0.6 + sum(heights)), layout="constrained")
    axes = list(figure.subplots(len(heights), squeeze=False, height_ratios=heights)[:, 0]) if heights else []
    for axis, (panel, below) in zip(axes, panels, strict=False):
        draw_panel(axis, panel)
        axis.set_xlabel(below)
    if spectrum is not None:
        _spectrum(axes[-1], spectrum)
    figure.align_ylabels(axes)
    figure.suptitle(plain(title), fontsize="medium")
    figure.supxlabel(plain("\n".join(note for each in pictures for note in each.notes)), fontsize="x-small")
    return save(figure, path)


def _spectrum(axis: Axes, spectrum: Spectrum) -> None:
    colours = iter(COLOURS * len(spectrum.lines))
    for line in spectrum.lines:
        colour = line.colour or next(colours)
        axis.plot(line.x, line.y, line.style, color=colour, linewidth=1.1, markersize=4, label=line.label or None)
    axis.set(xlabel="spatial frequency, cycles/m", ylabel="PSD, m³", xscale="log", yscale="log")
    for x, y, text in spectrum.notes:
        axis.annotate(
            text, (x, y), xytext=(4, 0), textcoords="offset points", fontsize="small", color="0.4", va="center"
        )
    dress(axis, 3)
