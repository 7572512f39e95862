"""The report of a batch: its metrics, its runs to choose from in all plots at once, and what was kept over time."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.batch.results import Results
from qddot.runner.pictures.arrange import batch_picture
from qddot.runner.pictures.scales import greatest, legible, named, scaled
from qddot.runner.report.batch_axes import gridded, longest, numeric
from qddot.runner.report.batch_tables import counts, valueless
from qddot.runner.report.interactive import along, numbers, section
from qddot.runner.report.page import Section, linked_plot, part_of_page, table, write_page
from qddot.runner.report.study_page import introduction
from qddot.runner.tables import Quantity
from qddot.words import counted

#: The most runs that a page holds, metrics that it draws, trajectories, and points of one.
MOST, METRICS, TRAJECTORIES, POINTS = 10_000, 12, 300, 160


def write(results: Results, into: Path) -> Path:
    """Write the page. Raises OSError where it cannot be, ValueError where no run reached its end."""
    if not len(results.finished):
        raise ValueError(f"{results.path}: no run reached its end, so there is nothing to report")
    sections, plots = [_about(results)], list[dict[str, Any]]()
    if results.metrics:
        sections.append(Section("Metrics", _metrics(results)))
    shown = _evenly(results.finished, MOST)
    columns = [_column(results, name, shown) for name in (*results.axes, *results.metrics)]
    sections.append(_runs(results, shown, columns))
    if results.kept:
        part, plots = section("Over time", _over_time(results))
        sections.append(part)
    source = (
        f"Computed by qddot into {results.path.name}; the runs chosen, and the data of every plot, can be downloaded."
    )
    own = {
        "runs": {"numbers": shown.tolist(), "columns": columns, "over": _over(results), "kept": _kept(results, shown)}
    }
    return write_page(into, results.heading, source, sections, plots, own)


def _evenly(runs: NDArray[np.int64], most: int) -> NDArray[np.int64]:
    """At most so many of some runs, evenly."""
    return runs[np.unique(np.linspace(0, len(runs) - 1, min(most, len(runs))).round().astype(np.int64))]


def _about(results: Results) -> Section:
    attrs = results.data.attrs
    axes = [
        f"{name}, {counted(len(np.unique(results.column(name))), 'value')}"
        + (f" from {results.text(name, low)} to {results.text(name, high)}" if numeric(results, name) else "")
        for name in results.axes
        for low, high in [(int(np.argmin(results.column(name))), int(np.argmax(results.column(name))))]
    ]
    rows = [("model", attrs["model"]), ("runs", counts(results)), *(("axis", each) for each in axes)]
    made = table(("", ""), rows)
    words = introduction(attrs["study"])
    failures = table(("runs", "first", "reason"), [tuple(map(str, each)) for each in _failures(results)], (0, 1))
    return Section(
        "The batch",
        (f"<p>{escape(words)}</p>" if words else "")
        + made
        + (f"<h3>Runs that failed</h3>{failures}" if results.failures() else "")
        + (f'<p class="differs">{escape(results.damaged)}</p>' if results.damaged else "")
        + f"<details><summary>The study</summary><pre>{escape(attrs['study'])}</pre></details>",
    )


def _failures(results: Results) -> list[tuple[int, int, str]]:
    return [(count, first, reason) for count, reason, first in results.failures()]


def _metrics(results: Results) -> str:
    heads = ("metric", "meaning", "unit", "best", "in run", "5 %", "median", "95 %", "worst", "in run")
    rows = []
    for name in results.metrics:
        order = results.best_first(name)
        values = results.column(name)[order]
        meaning = str(results.data[name].attrs.get("long_name", ""))
        told = [f"{value:.4g}" for value in (*np.quantile(values, [0.05, 0.5, 0.95]), values[-1])] if len(order) else []
        best = [f"{values[0]:.4g}", str(order[0])] if len(order) else []
        row = [*best, *told, str(order[-1])] if len(order) else ["–"] * 7
        rows.append((name, meaning, legible(results.unit(name)), *row))
    notes = "".join(f'<p class="note">{escape(line)}</p>' for line in valueless(results))
    return table(heads, rows, range(3, 10)) + notes


def _column(results: Results, name: str, shown: NDArray[np.int64]) -> dict[str, Any]:
    """A column of the page: its values in a unit to look at; words by their place in `words`."""
    values = results.column(name)[shown]
    kind, better = ("axis", "") if name in results.axes else ("metric", results.data[name].attrs.get("better", ""))
    column: dict[str, Any] = {"name": name, "label": name, "unit": "", "kind": kind, "better": better}
    if not numeric(results, name):
        words = list(dict.fromkeys(map(str, values)))
        return {**column, "words": words, "values": [words.index(str(value)) for value in values]}
    values = values.astype(np.float64)
    given = results.unit(name)
    factor, unit = (1.0, legible(given)) if kind == "axis" else scaled(given, greatest([values]))
    log = kind == "axis" and results.data[name].attrs["scale"] == "log"
    return {**column, "label": named(name, unit), "unit": unit, "log": log, "values": numbers(factor * values)}


def _over(results: Results) -> list[str]:
    """What metrics are drawn over: two axes that are a grid, or one."""
    axes = longest(results)
    if len(axes) == 2 and gridded(*(results.column(name).astype(np.float64) for name in axes)):
        return axes
    return (axes or [*results.axes, *results.metrics])[:1]


def _runs(results: Results, shown: NDArray[np.int64], columns: Sequence[dict[str, Any]]) -> Section:
    """The section whose plots and tables show which runs are chosen, and let others be chosen."""
    drawn = results.metrics[:METRICS]
    options = "".join(f"<option>{escape(each['name'])}</option>" for each in columns)
    notes = []
    if len(shown) < len(results.finished):
        notes.append(f"Every {len(results.finished) / len(shown):.3g}th of {len(results.finished)} runs is shown here.")
    if len(drawn) < len(results.metrics):
        notes.append(f"Not drawn, but in the tables: {', '.join(results.metrics[METRICS:])}.")
    kept = [name for name in results.kept if len(shown)]
    plots = [
        linked_plot(f"{name} of the runs", "runs", name) + linked_plot(f"Shares of {name}", "shares", name)
        for name in drawn
    ]
    plots += [linked_plot(f"{name} over time, runs that are chosen on top", "time", name) for name in kept]
    content = Template(part_of_page("runs.html")).substitute(
        notes="".join(f'<p class="note">{escape(note)}</p>' for note in notes), options=options, plots="".join(plots)
    )
    return Section("Runs", content, script=part_of_page("runs.js"))


def _kept(results: Results, shown: NDArray[np.int64]) -> dict[str, Any]:
    """Trajectories of some of the runs (by their place on the page), as a page has them."""
    places = _evenly(np.arange(len(shown)), TRAJECTORIES)
    time = results.data["time"].to_numpy() if results.kept else np.zeros(0)
    at = _evenly(np.arange(len(time)), POINTS) if len(time) else np.zeros(0, dtype=np.int64)
    found = []
    for name in results.kept:
        values = results.data[name].to_numpy()[shown[places]][:, at]
        factor, unit = scaled(results.unit(name), greatest([values]))
        found.append({"name": name, "label": named(name, unit), "rows": [numbers(factor * row, 5) for row in values]})
    return {"places": places.tolist(), "time": along(time[at]), "quantities": found}


def _over_time(results: Results) -> Any:
    runs = results.finished
    time = results.data["time"].to_numpy()
    samples = {
        Quantity(name, results.unit(name), str(results.data[name].attrs.get("long_name", ""))): results.data[
            name
        ].to_numpy()[runs]
        for name in results.kept
    }
    return batch_picture(np.broadcast_to(time, (len(runs), len(time))), samples, "", runs.tolist())
