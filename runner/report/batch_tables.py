"""The summary of a batch for the terminal."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from qddot.runner.batch.outcome import NOT_RUN
from qddot.runner.batch.results import Results
from qddot.runner.report.tables import plain_table


def wide_console() -> Console:
    """The terminal; where there is none, lines wide enough for a summary. Brackets in titles are no markup."""
    console = Console(markup=False, emoji=False)
    return console if console.is_terminal else Console(width=120, markup=False, emoji=False)


def counts(results: Results) -> str:
    """`10000 of 10000 runs, 3 failed`."""
    total, missing = len(results.status), int(np.count_nonzero(results.status == NOT_RUN))
    failed = total - missing - len(results.finished)
    return f"{total - missing} of {total} runs, {failed} failed"


def metrics_table(results: Results) -> Table:
    """Best, quantiles and worst of every metric, and the runs of the best and the worst."""
    table = plain_table("", "metric", "unit", "best", "run", "5 %", "median", "95 %", "worst", "run", numbers=8)
    for name in results.metrics:
        runs = results.best_first(name)
        if len(runs):
            values = results.column(name)[runs]
            numbers = (f"{each:.4g}" for each in (*np.quantile(values, [0.05, 0.5, 0.95]), values[-1]))
            table.add_row(name, results.unit(name), f"{values[0]:.4g}", str(runs[0]), *numbers, str(runs[-1]))
        else:
            table.add_row(name, results.unit(name), *("-" for _ in range(7)))
    return table


def valueless(results: Results) -> list[str]:
    """A line for each metric that finished runs have no value of."""
    lines = []
    for name in results.metrics:
        bad = results.finished[~np.isfinite(results.column(name)[results.finished])]
        if bad.size:
            runs = "1 finished run" if bad.size == 1 else f"{bad.size} finished runs"
            lines.append(f"{name} has no value in {runs}, first in run {bad[0]}: a sample is no finite number")
    return lines


def extremes_table(results: Results) -> Table:
    """The settings of the runs that are the best or the worst in something."""
    table = plain_table("", "run", *results.axes)
    ends = [results.best_first(name)[[0, -1]] for name in results.metrics if len(results.best_first(name))]
    for run in np.unique(np.array(ends, dtype=np.int64)):
        table.add_row(str(run), *(results.text(axis, int(run)) for axis in results.axes))
    return table


def failures_table(results: Results, most: int = 12) -> Table:
    """How often runs failed for what reason, and the first of each; empty where none did."""
    table = plain_table("Runs that failed", "runs", "first", "reason")
    failures = results.failures()
    for count, reason, first in failures[:most]:
        table.add_row(str(count), str(first), reason)
    if len(failures) > most:
        rest = sum(count for count, _, _ in failures[most:])
        table.add_row(str(rest), "", f"{len(failures) - most} other reasons")
    return table


def print_summary(console: Console, results: Results) -> None:
    """The title, how many runs there are and failed, the metrics, and the reasons of failures."""
    console.print(results.heading, style="bold", highlight=False)
    console.print(counts(results), highlight=False)
    if results.metrics:
        console.print(metrics_table(results))
        console.print(extremes_table(results))
        for line in valueless(results):
            console.print(f"note: {line}", highlight=False, soft_wrap=True)
    if results.failures():
        console.print(failures_table(results))


def wrote(results: Results, path: Path) -> None:
    """Say what was written, and of how many runs where some are not computed yet."""
    said = f"wrote {path}" + (f", {results.partial}" if results.partial else "")
    Console(markup=False, emoji=False).print(said, highlight=False, soft_wrap=True)


def status_of(results: Results) -> int:
    """The exit status of a command that shows results: 1 where some of them are damaged, which is told."""
    if results.damaged:
        tell_damage(f"{results.path} is {results.damaged}")
    return 1 if results.damaged else 0


def tell_damage(text: str) -> None:
    """Note, beside the results, what of a store was damaged."""
    Console(stderr=True, markup=False, emoji=False).print(f"note: {text}", highlight=False, soft_wrap=True)
