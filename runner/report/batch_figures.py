"""Figures of a batch: metrics over one axis of the sweep, maps over two, trajectories of chosen runs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from qddot.runner.batch.outcome import NOT_RUN
from qddot.runner.batch.results import Results
from qddot.runner.checks import unknown
from qddot.runner.pictures.figures import panels, save, wrapped
from qddot.runner.pictures.picture import COLOURS
from qddot.runner.pictures.scales import greatest, legible, named, scaled
from qddot.runner.report.batch_axes import grid, gridded, longest, numeric
from qddot.words import counted

#: The most lines in a panel that are told apart, the most maps, and the most runs of which trajectories are drawn.
MOST_LINES, MOST_MAPS, MOST_RUNS = 7, 6, 7
#: Sampled runs beside each other that make a place of a band, and the least and the most such places.
CLOUD, LEAST_CLOUDS, MOST_CLOUDS = 40, 8, 60

Vector = NDArray[np.float64]


def draw(
    results: Results, path: Path, metrics: Sequence[str] = (), over: Sequence[str] = (), runs: Sequence[int] = ()
) -> Path:
    """Draw the metrics over one axis or two, or the kept trajectories of these runs, into a PNG, SVG or PDF file.

    All metrics by default, over the two longest axes of a sweep, or the only one. Raises ValueError for names and runs
    that do not exist.
    """
    shown = list(metrics) or list(results.metrics)
    for name in shown:
        if name not in results.metrics:
            raise ValueError(f"--metric: {unknown('metric', name, results.metrics)}")
        if shown.count(name) > 1:
            raise ValueError(f"--metric: {name!r} is given twice")
    if not shown and over:
        raise ValueError("--over: there are no metrics in this store, and trajectories are drawn over time")
    if runs or not shown:
        return save(_trajectories(results, runs or [int(run) for run in results.finished[:MOST_RUNS]]), path)
    axes = list(over) or longest(results)
    for name in axes:
        if name not in results.axes:
            raise ValueError(f"--over: {unknown('axis', name, results.axes)}")
        if axes.count(name) > 1:
            raise ValueError(f"--over: {name!r} is given twice")
    if not len(results.finished):
        raise ValueError(f"{results.path}: no run reached its end, so there is nothing to draw")
    if len(axes) not in (1, 2):
        raise ValueError(f"--over: {len(axes)} axes; a figure shows metrics over one or two: {', '.join(results.axes)}")
    figure = _lines(results, shown, axes[0]) if len(axes) == 1 else _maps(results, shown, axes)
    return save(figure, path)


def _label(results: Results, name: str) -> str:
    return named(name, legible(results.unit(name)))


def _scale(results: Results, axis: str) -> str:
    return str(results.data[axis].attrs["scale"])


def _lines(results: Results, metrics: Sequence[str], axis: str) -> Figure:
    """A panel for each unit; a line for each metric, or for each setting of the other axes."""
    units: dict[str, list[str]] = {}
    for name in metrics:
        units.setdefault(results.unit(name), []).append(name)
    figure, axes = panels(len(units), 2.2, title=results.heading, share_x=True)
    x, order = _positions(results, axis)
    for panel, names in zip(axes, units.values(), strict=True):
        colours = iter(COLOURS * 20)
        factor, unit = scaled(results.unit(names[0]), greatest([results.column(name) for name in names]))
        for name in names:
            _series(results, panel, name, axis, (x, factor * results.column(name)), colours)
        panel.set_ylabel(named(names[0], unit) if len(names) == 1 else unit or "1")
        _legend(panel)
    if order is not None:
        axes[-1].set_xticks(range(len(order)), order)
    axes[-1].set_xscale(_scale(results, axis))
    axes[-1].set_xlabel(_label(results, axis))
    return figure


def _positions(results: Results, axis: str) -> tuple[Vector, list[str] | None]:
    """Abscissae (n_runs,) of an axis; words stand side by side."""
    values = results.column(axis)
    if numeric(results, axis):
        return values.astype(np.float64), None
    order = list(dict.fromkeys(map(str, values)))
    return np.array([order.index(str(value)) for value in values], dtype=np.float64), order


def _series(results: Results, panel: Any, name: str, axis: str, values: tuple[Vector, Vector], colours: Any) -> None:
    x, y = values
    others = [i for i, names in enumerate(results.data.attrs["groups"]) if axis not in names]
    shape = [int(size) for size in results.data.attrs["shape"]]
    lines = int(np.prod([shape[i] for i in others])) if others else 1
    if axis in results.data.attrs["sampled"]:
        _cloud(panel, x, y, name, next(colours))
    elif lines > MOST_LINES:
        _band(panel, x, y, name, next(colours))
    else:
        place = next(i for i, names in enumerate(results.data.attrs["groups"]) if axis in names)
        runs = np.moveaxis(np.arange(len(x)).reshape(shape), place, -1).reshape(lines, -1)
        for row in runs:
            other = ", ".join(f"{each} = {results.text(each, int(row[0]))}" for each in _firsts(results, others))
            label = ", ".join(text for text in (name, other) if text)
            marker = ("o-" if len(row) <= 40 else "-") if numeric(results, axis) else "o"
            panel.plot(x[row], y[row], marker, color=next(colours), linewidth=1.2, markersize=3, label=label)


def _firsts(results: Results, groups: Sequence[int]) -> list[str]:
    named = [(results.data.attrs["groups"][i][0], results.data.attrs["shape"][i]) for i in groups]
    return [name for name, size in named if size > 1]


def _cloud(panel: Any, x: Vector, y: Vector, name: str, colour: str) -> None:
    """Points; of many, the median and the middle nine tenths of neighbours in x, over points that are hardly seen."""
    there = np.isfinite(y)
    count = int(np.count_nonzero(there)) // CLOUD
    if count < LEAST_CLOUDS or not np.issubdtype(x.dtype, np.floating):
        panel.plot(x, y, ".", color=colour, markersize=3, alpha=0.6, label=name)
        return
    panel.plot(x, y, ".", color=colour, markersize=2, alpha=0.08, markeredgewidth=0, rasterized=True)
    parts = np.array_split(np.flatnonzero(there)[np.argsort(x[there], kind="stable")], min(count, MOST_CLOUDS))
    at = np.array([np.median(x[part]) for part in parts])
    _quantiles(panel, at, [y[part] for part in parts], f"{name}, median and 90 % of the runs", colour)


def _band(panel: Any, x: Vector, y: Vector, name: str, colour: str) -> None:
    """Median and the middle nine tenths over all runs with the same abscissa."""
    there = np.isfinite(y)
    at = np.unique(x[there])
    parts = [y[there & (x == each)] for each in at]
    _quantiles(panel, at, parts, f"{name}, median and 90 % of the runs", colour)


def _quantiles(panel: Any, at: Vector, parts: Sequence[Vector], label: str, colour: str) -> None:
    low, middle, high = np.array([np.quantile(part, [0.05, 0.5, 0.95]) for part in parts]).T
    panel.plot(at, middle, "-", color=colour, linewidth=1.2, label=label)
    panel.fill_between(at, low, high, color=colour, alpha=0.2, linewidth=0)


def _maps(results: Results, metrics: Sequence[str], axes: Sequence[str]) -> Figure:
    """A map for each metric, colours for its value; points where the axes are sampled."""
    if len(metrics) > MOST_MAPS:
        raise ValueError(f"--metric: {len(metrics)} metrics make {len(metrics)} maps; choose at most {MOST_MAPS}")
    columns = min(2, len(metrics))
    rows = -(-len(metrics) // columns)
    figure = Figure(figsize=(4.6 * columns + 0.4, 3.7 * rows + 0.5), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.1, h_pad=0.08, wspace=0.04)  # type: ignore[union-attr, call-arg]
    maps = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel in maps[len(metrics) :]:
        panel.remove()
    x, y = (_positions(results, axis)[0] for axis in axes)
    for panel, name in zip(maps, metrics, strict=False):
        factor, unit = scaled(results.unit(name), greatest([results.column(name)]))
        drawn = _map(panel, x, y, factor * results.column(name))
        figure.colorbar(drawn, ax=panel, label=named(name, unit))
        best = _best(results, name)
        if len(best) == 1:
            panel.plot(x[best], y[best], "*", color="white", markeredgecolor="black", markersize=12, label="★ best")
        elif len(best):
            panel.set_title(f"best: {counted(len(best), 'run')} alike", fontsize="small", loc="left")
        panel.set(xlabel=_label(results, axes[0]), ylabel=_label(results, axes[1]))
        panel.set(xscale=_scale(results, axes[0]), yscale=_scale(results, axes[1]))
        _legend(panel)
    figure.suptitle(wrapped(results.heading), fontsize="medium")
    return figure


def _best(results: Results, name: str) -> NDArray[np.int64]:
    """The runs whose value of a metric is the best, to rounding."""
    order = results.best_first(name)
    values = results.column(name)[order]
    return order[np.isclose(values, values[:1], rtol=1e-9, atol=0.0)] if len(order) else order


def _map(panel: Any, x: Vector, y: Vector, z: Vector) -> Any:
    if not gridded(x, y):  # every run is a point of its own
        return panel.scatter(x, y, c=z, s=8, cmap="viridis", linewidths=0)
    columns, rows, mean = grid(x, y, z)  # over the axes that are not shown
    return panel.pcolormesh(columns, rows, mean, cmap="viridis", shading="nearest", rasterized=True)


def _trajectories(results: Results, runs: Sequence[int]) -> Figure:
    if not results.kept:
        raise ValueError(f'{results.path}: no trajectories were kept; set keep = ["..."] under [outputs] in the study')
    if len(runs) > MOST_RUNS:
        raise ValueError(f"--runs: {len(runs)} runs; at most {MOST_RUNS} can be told apart")
    for run in runs:
        if not 0 <= run < len(results.status):
            raise ValueError(f"--runs: there is no run {run}; the runs are 0 to {len(results.status) - 1}")
        if results.status[run] == NOT_RUN:
            raise ValueError(f"--runs: run {run} is not computed yet; the batch is {results.partial}")
    figure, axes = panels(len(results.kept), 2.2, title=results.heading, share_x=True)
    t = results.data["time"].to_numpy()
    for panel, name in zip(axes, results.kept, strict=True):
        for run, colour in zip(runs, COLOURS, strict=False):
            label = f"{run}: {results.setting(run)}" if results.axes else name
            panel.plot(t, results.data[name][run], color=colour, linewidth=1.2, label=label)
        panel.set_ylabel(_label(results, name))
        panel.margins(x=0.0)
    _legend(axes[0])
    axes[-1].set_xlabel("t, s")
    return figure


def _legend(panel: Any) -> None:
    """A legend of several entries; of a single one what it says that the axis does not."""
    labels = panel.get_legend_handles_labels()[1]
    if len(labels) == 1 and not panel.get_ylabel().startswith(labels[0]):
        panel.set_title(labels[0], fontsize="small", loc="left")
    if len(labels) < 2:
        return
    above = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.0}
    panel.legend(**above, fontsize="small", frameon=False, ncols=2)
