"""Figures of runs."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from runner.checks import unknown
from runner.files import written_aside
from runner.report.tables import headlines
from runner.solution import Solution

#: Colours that stay apart for colour-blind readers (Wong, Nature Methods 8 (2011) 441).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

#: The most quantities that a panel shows where nobody chose them.
_CROWD = 6


def default_panels(solution: Solution) -> tuple[tuple[str, ...], ...]:
    """Coordinates, outputs and the inputs that move, each kind grouped by unit, one panel a group."""
    panels: dict[tuple[str, str], list[str]] = {}
    for kind, names in headlines(solution).items():
        for name in names:
            panels.setdefault((kind, solution.quantity(name).unit), []).append(name)
    return tuple(tuple(names[:_CROWD]) for names in panels.values())


def trajectories(
    solution: Solution, path: Path, title: str, panels: Sequence[Sequence[str]] = (), from_start: Sequence[str] = ()
) -> Path:
    """Draw quantities over time, one panel under the other, and write the picture (PNG, SVG or PDF by its suffix).

    panels: names in each panel; `default_panels` where empty. from_start: names shown as change since the start.
    Raises ValueError with the nearest name for one that the run does not have.
    """
    chosen = panels or default_panels(solution)
    for name in [*(name for names in chosen for name in names), *from_start]:
        if name not in solution:
            raise ValueError(f"figure: {unknown('quantity', name, solution.names)}")
    height = 1.1 + 1.9 * len(chosen)
    figure = Figure(figsize=(8.0, height))
    figure.subplots_adjust(left=0.12, right=0.97, bottom=0.5 / height, top=1 - 0.6 / height, hspace=0.28)
    axes = figure.subplots(len(chosen), sharex=True, squeeze=False)[:, 0]
    for axis, names in zip(axes, chosen, strict=True):
        for name, colour in zip(names, COLOURS * len(names), strict=False):
            values = solution[name] - (solution[name][0] if name in from_start else 0.0)
            axis.plot(solution.t, values, color=colour, linewidth=1.2, label=_label(solution, name, from_start))
        units = dict.fromkeys(solution.quantity(name).unit for name in names)
        axis.set_ylabel(", ".join(units))
        axis.grid(color="0.9", linewidth=0.6)
        axis.spines[["top", "right"]].set_visible(False)
        above = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.0}
        axis.legend(**above, fontsize="small", frameon=False, ncols=min(3, len(names)))
        axis.margins(x=0.0, y=0.15)
    axes[-1].set_xlabel("t in s")
    figure.align_ylabels(axes)
    figure.suptitle(title, fontsize="medium", y=1 - 0.1 / height, va="top")
    FigureCanvasAgg(figure)
    with written_aside(path) as aside:
        figure.savefig(aside, dpi=150, format=path.suffix.removeprefix(".") or "png")
    return path


def _label(solution: Solution, name: str, from_start: Sequence[str]) -> str:
    meaning = solution.quantity(name).meaning or name
    return f"{meaning}, change since the start" if name in from_start else meaning
