"""Results of two machines side by side: of each case the quickest of ours, and of the other tools there."""

from collections.abc import Iterator

from benchmarks.compare import Measured
from benchmarks.report import seconds
from benchmarks.timing import Table

#: Groups whose tables are contests with other tools.
CONTESTS = ("single_run", "batch", "c_loop")


def beside(first: Measured, second: Measured) -> str:
    """A Markdown table, a row a case that was measured on both machines."""
    cases = {table.title: table for table in _tables(second)}
    lines = [
        f"A: {first.machine}. B: {second.machine}.",
        "",
        "| | A: qddot | next best | times as long | B: qddot | next best | times as long |",
        f"|---|{2 * '---|---|---:|'}",
    ]
    for table in _tables(first):
        if table.title in cases:
            cells = [each for side in (table, cases[table.title]) for each in _cells(side)]
            lines.append(f"| {table.title}{', a run' if table.per == 'run' else ''} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _tables(measured: Measured) -> Iterator[Table]:
    """Those of contests in which one of ours and another took part."""
    for group in CONTESTS:
        for table in measured.groups.get(group, ()):
            if all(table.took_part(ours=ours) for ours in (True, False)):
                yield table


def _cells(table: Table) -> Iterator[str]:
    best, other = (min(table.took_part(ours=ours), key=lambda row: row.least) for ours in (True, False))
    yield f"{best.name.removeprefix('qddot ')} {seconds(best.least)}"
    yield f"{other.name} {seconds(other.least)}"
    yield f"{other.least / best.least:.2g}"
