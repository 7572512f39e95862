"""Throughput of the batches and shares of dgemm's peak, as bars."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.timing import Table, Timing, machine
from qddot.drawing import COLOURS, save

#: Colours of qddot's bars and those of other tools.
OURS, THEIRS = COLOURS[0], "0.6"

Bars = Sequence[tuple[str, float]]


@dataclass(frozen=True)
class Measure:
    """What bars are as long as; None where a row has none. alike: all panels have one scale."""

    file: str
    title: str
    unit: str
    value: Callable[[Table, Timing], float | None]
    alike: bool


def _throughput(table: Table, row: Timing) -> float | None:
    return 1.0 / row.least if table.per == "run" and isfinite(row.least) else None


def _share(table: Table, row: Timing) -> float | None:
    return 100.0 * row.share if row.share is not None and isfinite(row.least) else None


MEASURES = (
    Measure("throughput.png", "Throughput of batches", "runs per second", _throughput, alike=False),
    Measure("share_of_peak.png", "Share of dgemm's peak on as many threads", "%", _share, alike=True),
)


def draw_all(tables: Sequence[Table], folder: Path) -> list[Path]:
    """A figure for each measure that some table has; their paths."""
    paths = []
    for measure in MEASURES:
        panels = {table.title: _bars(table, measure) for table in tables}
        panels = {title: bars for title, bars in panels.items() if bars}
        if panels:
            paths.append(_draw(panels, measure, folder / measure.file))
    return paths


def _bars(table: Table, measure: Measure) -> Bars:
    """Name and length, the shortest first."""
    bars = [(row.name, value) for row in table.rows if (value := measure.value(table, row)) is not None]
    return sorted(bars, key=lambda bar: bar[1])


def _draw(panels: dict[str, Bars], measure: Measure, path: Path) -> Path:
    """A panel for each table, the longest bar on top, its number at its end."""
    heights = [len(bars) + 1.2 for bars in panels.values()]
    figure = Figure(figsize=(8.0, 0.6 + 0.27 * sum(heights)), layout="constrained")
    axes = figure.subplots(len(panels), squeeze=False, sharex=measure.alike, height_ratios=heights)[:, 0]
    for axis, (title, bars) in zip(axes, panels.items(), strict=True):
        _panel(axis, title, bars)
    axes[-1].set_xlabel(measure.unit)
    figure.suptitle(f"{measure.title}; {machine()}", fontsize="medium")
    return save(figure, path)


def _panel(axis: Axes, title: str, bars: Bars) -> None:
    names, values = zip(*bars, strict=True)
    colours = [OURS if name.startswith("qddot") else THEIRS for name in names]
    drawn = axis.barh(names, values, color=colours, height=0.7)
    axis.bar_label(drawn, [_number(value) for value in values], padding=3, fontsize="small")
    axis.set_title(title, fontsize="small", loc="left")
    axis.tick_params(axis="y", length=0, labelsize="small")
    axis.tick_params(axis="x", labelsize="small")
    axis.margins(x=0.12)
    axis.grid(axis="x", color="0.9", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right", "left"]].set_visible(False)


def _number(value: float) -> str:
    return f"{value:,.0f}".replace(",", " ") if value >= 100 else f"{value:.3g}"
