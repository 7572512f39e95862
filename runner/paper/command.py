"""`qddot verify`: the verification of section 3.1 as a table, figures, or JSON."""

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from runner.paper.verification import Verification, verify
from runner.report.tables import plain_table

#: What the paper ran, whose claims are checked, and what it printed, which is shown beside it.
RUN, PRINTED = "as_run", "as_printed"


def verification(into: Path, as_json: bool) -> int:
    """Verify both parameter sets; 1 where a claim does not hold for the one that the paper ran."""
    found = [verify(RUN), verify(PRINTED)]
    claims = found[0].claims()
    if as_json:
        tables = {each.parameter_set: _records(each) for each in found}
        print(json.dumps({"claims": claims, "tables": tables}, indent=1))
    else:
        _show(found, claims, into)
    return 0 if all(claims.values()) else 1


def _show(found: list[Verification], claims: dict[str, bool], into: Path) -> None:
    from runner.paper.figures import draw_errors, draw_schemes  # noqa: PLC0415 - matplotlib is slow to import

    console = Console()
    for each in found:
        console.print(_table(each), "")
    for claim, holds in claims.items():
        console.print(f"{'[green]holds[/green]  ' if holds else '[red]differs[/red]'}  {claim}", highlight=False)
    for draw, name in ((draw_schemes, "figure_2"), (draw_errors, "figure_3")):
        console.print(f"wrote {draw(found[0], into / f'{name}.png')}", highlight=False, soft_wrap=True)


def _table(each: Verification) -> Table:
    stiffness = "as the paper ran it" if each.parameter_set == RUN else "as the paper prints it"
    numbers = ("steps", "points", "the\npaper", "rejected", "evaluations", "largest\nerror m", "time\nms")
    table = plain_table(f"Tyre stiffness {stiffness}", "scheme", *numbers, numbers=len(numbers))
    for record in _records(each):
        reported = "" if record["reported"] is None else str(record["reported"])
        counts = (str(record[key]) for key in ("rejected", "evaluations"))
        error, time = f"{record['largest_error']:.3g}", f"{1e3 * record['wall_time']:.2f}"
        table.add_row(record["scheme"], str(record["steps"]), str(record["points"]), reported, *counts, error, time)
    return table


def _records(each: Verification) -> list[dict[str, Any]]:
    return [
        {
            "scheme": row.scheme,
            "steps": row.solution.statistics.steps,
            "points": row.points,
            "reported": row.reported if each.parameter_set == RUN else None,
            "rejected": row.solution.statistics.failed_attempts,
            "evaluations": row.solution.statistics.evaluations,
            "largest_error": row.largest_error,
            "wall_time": row.solution.statistics.wall_time,
        }
        for row in each.rows
    ]
