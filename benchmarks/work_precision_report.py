"""Work-precision diagrams and tables of significant correct digits."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.timing import machine
from benchmarks.work_precision_runs import NON_STIFF_METHODS, SCIPY, STIFF_METHODS, Point
from qddot.drawing import COLOURS
from qddot.runner.files import written_aside

COLUMNS = 3
GREYS = {"RK45": "0.2", "DOP853": "0.45", "LSODA": "0.65", "Radau": "0.2", "BDF": "0.45"}
MARKERS = {"RK45": "s", "DOP853": "D", "LSODA": "v", "Radau": "s", "BDF": "D"}


def draw(points: Sequence[Point], problems: Sequence[str], title: str, path: Path) -> Path:
    """For each problem, evaluations and, below, time over the digits reached: low and far right is good."""
    rows = 2 * -(-len(problems) // COLUMNS)
    figure = Figure(figsize=(3.9 * COLUMNS, 0.9 + 2.45 * rows), layout="constrained")
    axes = figure.subplots(rows, COLUMNS, squeeze=False)
    lines: dict[str, Any] = {}
    for i, problem in enumerate(problems):
        own = [point for point in points if point.problem == problem and not point.failure]
        for axis, work, label in (
            (axes[2 * (i // COLUMNS), i % COLUMNS], "evaluations", "evaluations"),
            (axes[2 * (i // COLUMNS) + 1, i % COLUMNS], "least", "time in s"),
        ):
            for method in dict.fromkeys(point.method for point in own):
                mine = [point for point in own if point.method == method]
                digits = [point.digits for point in mine]
                (lines[method],) = axis.plot(digits, [getattr(each, work) for each in mine], **_style(method))
            axis.set_yscale("log")
            low, high = axis.get_ylim()
            axis.set_ylim(min(low, high / 10.0), max(high, low * 10.0))  # At least one decade.
            axis.minorticks_off()
            axis.set_ylabel(label if i % COLUMNS == 0 else "")
            axis.grid(color="0.9", linewidth=0.6)
            axis.spines[["top", "right"]].set_visible(False)
        axes[2 * (i // COLUMNS), i % COLUMNS].set_title(problem, fontsize="medium")
        axes[2 * (i // COLUMNS) + 1, i % COLUMNS].set_xlabel("significant correct digits")
    for axis in axes.T.reshape(COLUMNS, -1, 2)[len(problems) % COLUMNS or COLUMNS :, -1].ravel():
        axis.set_axis_off()
    figure.legend(
        list(lines.values()), list(lines), title=title, loc="outside upper center", ncols=len(lines), frameon=False
    )
    FigureCanvasAgg(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_aside(path) as aside:
        figure.savefig(aside, dpi=130, format=path.suffix.removeprefix("."))
    return path


def _style(method: str) -> dict[str, Any]:
    if method.startswith(SCIPY):
        name = method.removeprefix(SCIPY)
        return {"color": GREYS[name], "linestyle": "--", "marker": MARKERS[name], "markersize": 3, "linewidth": 1}
    own = NON_STIFF_METHODS if method in NON_STIFF_METHODS else STIFF_METHODS
    return {"color": COLOURS[own.index(method)], "marker": "o", "markersize": 3.5, "linewidth": 1.4}


def table(points: Sequence[Point]) -> str:
    """Significant correct digits as a Markdown table: a row for each problem and method, a column for each rtol."""
    rtols = sorted({point.rtol for point in points}, reverse=True)
    head = ["problem", "method", *(f"{rtol:.0e}" for rtol in rtols)]
    lines = [f"| {' | '.join(head)} |", "|---|---|" + len(rtols) * "---:|"]
    found = {(point.problem, point.method, point.rtol): point for point in points}
    for problem, method in dict.fromkeys((point.problem, point.method) for point in points):
        cells = [_cell(found.get((problem, method, rtol))) for rtol in rtols]
        lines.append(f"| {problem} | {method} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _cell(point: Point | None) -> str:
    if point is None:
        return ""
    return f"{point.digits:.1f}" if not point.failure else point.failure.lower().replace("_", " ").split(".")[0]


def write(points: Sequence[Point], table_path: Path, data_path: Path) -> None:
    """The table as Markdown, and every point with the machine as JSON; numbers that are missing are null."""
    header = (
        "# Significant correct digits at the end point\n\n-log10 of the largest relative error; atol = rtol * scale of "
        "the problem, and components below scale count absolutely. Empty: left out, as the run before took long.\n\n"
    )
    rows = [
        {name: None if isinstance(value, float) and not np.isfinite(value) else value for name, value in row.items()}
        for row in map(asdict, points)
    ]
    for path, text in (
        (table_path, header + table(points)),
        (data_path, json.dumps({"machine": machine(), "points": rows}, indent=1)),
    ):
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_aside(path) as aside:
            Path(aside).write_text(text, "utf-8")
