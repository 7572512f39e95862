"""Throughput of the batches and shares of dgemm's peak, as bars."""

from collections.abc import Callable, Sequence
from math import isfinite
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.timing import Table, Timing, machine
from runner.report.figures import COLOURS, save

#: qddot's own bars, those of other tools.
OURS, THEIRS = COLOURS[0], "0.6"


def draw_all(tables: Sequence[Table], folder: Path) -> list[Path]:
    """throughput.png of the tables of batches, share_of_peak.png of those with shares; paths of what was drawn."""
    batches = [table for table in tables if table.per == "run"]
    shares = [table for table in tables if any(row.share is not None for row in table.rows)]
    paths = []
    if batches:
        paths.append(_draw(batches, "runs per second", _throughput, folder / "throughput.png", alike=False))
    if shares:
        paths.append(
            _draw(shares, "% of dgemm's peak on as many threads", _share, folder / "share_of_peak.png", alike=True)
        )
    return paths


def _throughput(row: Timing) -> float | None:
    return 1.0 / row.least if isfinite(row.least) else None


def _share(row: Timing) -> float | None:
    return None if row.share is None or not isfinite(row.least) else 100.0 * row.share


def _draw(
    tables: Sequence[Table], unit: str, value_of: Callable[[Timing], float | None], path: Path, *, alike: bool
) -> Path:
    """A panel for each table, the longest bar on top, its number at its end; alike: all of the same scale."""
    bars = [[(row.name, value) for row in table.rows if (value := value_of(row)) is not None] for table in tables]
    heights = [len(panel) + 1.2 for panel in bars]
    figure = Figure(figsize=(8.0, 0.6 + 0.27 * sum(heights)), layout="constrained")
    axes = figure.subplots(len(tables), squeeze=False, sharex=alike, height_ratios=heights)[:, 0]
    for axis, table, panel in zip(axes, tables, bars, strict=True):
        _panel(axis, table.title, sorted(panel, key=lambda bar: bar[1]))
    axes[-1].set_xlabel(unit)
    figure.suptitle(f"{unit[0].upper()}{unit[1:]}: {machine()}", fontsize="medium")
    return save(figure, path)


def _panel(axis: Axes, title: str, bars: Sequence[tuple[str, float]]) -> None:
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
