"""`python -m benchmarks.pages [NEW.json [OTHER.json]]`: what `make bench` measured, drawn into the pages that show it.

A page has places, `<!-- measured: single_run -->` to `<!-- end -->`, between which nothing is written by hand. The
results they are drawn from are kept as docs/speed.json, those of another machine as docs/speed_elsewhere.json; newer
files take their places first.
"""

import math
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from benchmarks.beside import beside
from benchmarks.compare import Measured, read
from benchmarks.report import markdown, seconds
from benchmarks.timing import Table, Timing
from qddot.runner.files import written_aside

ROOT = Path(__file__).parent.parent
KEPT = ROOT / "docs" / "speed.json"
ELSEWHERE = ROOT / "docs" / "speed_elsewhere.json"
PAGES = (ROOT / "README.md", ROOT / "docs" / "speed.md")
_PLACE = re.compile(r"(<!-- measured: ([\w ]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
#: Titles of the tables of which the front page shows a line, without their errors.
_FRONT = (
    "M113 driving over a sine road, one shot, 10 s",
    "M113, 10000 runs at error 1e-8, 2 s",
    "Chain of 160: derive and lower",
    "Cold commands, once",
)
#: Contenders shown there: the quickest of ours and of the others.
_SHOWN = 3


def drawn(text: str, measured: Measured, elsewhere: Measured) -> str:
    """A page with its places drawn anew. Raises ValueError for a place of which nothing is measured."""
    return _PLACE.sub(lambda place: place[1] + _place(place[2], measured, elsewhere) + place[4], text)


def places(text: str) -> list[str]:
    """The names of a page's places."""
    return [place[2] for place in _PLACE.finditer(text)]


def _place(name: str, measured: Measured, elsewhere: Measured) -> str:
    if name == BESIDE:
        return beside(measured, elsewhere)
    if name in OWN:
        return OWN[name](measured)
    if not measured.groups.get(name):
        raise ValueError(
            f"nothing is measured of {name}, expected one of {', '.join([*OWN, BESIDE, *measured.groups])}"
        )
    return "\n".join(map(markdown, measured.groups[name]))


def _machine(measured: Measured) -> str:
    tools = ", ".join(f"{name} {number}" for name, number in measured.versions.items())
    failures = "".join(f" {group} failed: {why}." for group, why in measured.failures.items())
    return f"{measured.machine}; {tools}.{failures}\n"


def _single_runs(measured: Measured) -> str:
    """One row a contender, one column a case: the least seconds, or - where it takes no part."""
    tables = measured.groups["single_run"]
    rows: dict[str, dict[str, Timing]] = {}
    for table in tables:
        for row in table.rows:
            rows.setdefault(row.name, {})[table.title] = row
    titles = [table.title for table in tables]
    lines = [f"| | {' | '.join(titles)} |", f"|---{len(titles) * '|---:'}|"]
    for name, found in sorted(rows.items(), key=lambda each: _typical(each[1], tables)):
        lines.append(f"| {name} | {' | '.join(_least(found.get(title)) for title in titles)} |")
    return "\n".join(lines) + "\n"


def _least(row: Timing | None) -> str:
    return seconds(row.least) if row is not None and math.isfinite(row.least) else "-"


def _typical(found: Mapping[str, Timing], tables: list[Table]) -> float:
    """The geometric mean of a contender's times over the best of each case; those of fewer cases come later."""
    ratios = [
        found[table.title].least / min(row.least for row in table.rows if math.isfinite(row.least))
        for table in tables
        if table.title in found and math.isfinite(found[table.title].least)
    ]
    return math.exp(math.fsum(map(math.log, ratios)) / len(ratios)) if ratios else math.inf


def _front(measured: Measured) -> str:
    """A line a table: the quickest of ours, and of the others."""
    tables = {table.title.split(", error")[0]: table for group in measured.groups.values() for table in group}
    return "".join(_line(tables[title]) for title in _FRONT if title in tables)


def _line(table: Table) -> str:
    shown = [row for ours in (True, False) for row in table.took_part(ours=ours)[:_SHOWN]]
    told = ", ".join(f"{row.name} {seconds(row.least)}" for row in shown)
    return f"- {table.title}{', a run' if table.per == 'run' else ''}: {told}.\n"


#: Places that are not just the tables of a group.
OWN: Mapping[str, Callable[[Measured], str]] = {
    "machine": _machine,
    "single runs": _single_runs,
    "front": _front,
}
#: That of both machines.
BESIDE = "two machines"


def main(arguments: list[str]) -> int:
    """Draw the pages; 2 where there are no results, or a page shows what was not measured."""
    try:
        given = [*map(Path, arguments)]
        sources = [*given, *(KEPT, ELSEWHERE)[len(given) :]]
        measured, elsewhere = map(read, sources)
        for source, kept in zip(given, (KEPT, ELSEWHERE), strict=False):
            with written_aside(kept) as aside:
                aside.write_bytes(source.read_bytes())
        for page in PAGES:
            text = drawn(page.read_text("utf-8"), measured, elsewhere)
            with written_aside(page) as aside:
                aside.write_text(text, "utf-8")
            print(f"wrote {page.relative_to(ROOT)}")
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
