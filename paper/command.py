"""`qddot verify` and `qddot paper`: tables, figures, or JSON."""

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from qddot.paper.curves import plots_of
from qddot.paper.reproduce import Reproduction, reproduce
from qddot.paper.tables import cheapest_table, claims_page, claims_table, notes, records, speeds_table
from qddot.paper.verification import Verification, verify
from qddot.report import BROWSERS, browser, plain_table, print_page, progress_bar, written_aside

#: Settings and claims of the paper.
PAPER = Path(__file__).parent.parent / "studies" / "paper" / "paper.toml"
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
    from qddot.paper.verification_figures import (  # noqa: PLC0415 - matplotlib is slow to import
        draw_errors,
        draw_schemes,
    )

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


def paper(path: Path | None, into: Path, as_json: bool, parameters: str | None = None) -> int:
    """Compute the whole paper; 1 where a claim that was met when last looked at is no longer met.

    path: settings and claims, those that come with qddot by default. parameters: a parameter set in place of the
    paper's; what is written goes to a folder of its name, and every verdict is as good as any other.
    """
    found = reproduce(path or PAPER, progress_bar, parameters)
    status = 1 if parameters is None and any(each.worse for each in found.claims) else 0
    into = into if parameters is None else into / parameters
    said = {
        "title": found.paper.title,
        "parameter_set": parameters,
        "claims": records(found.claims),
        "numbers": found.numbers,
        "plots": plots_of(found),
    }
    if as_json:
        print(json.dumps(said, indent=1))
        return status
    page = claims_page(found.claims, parameters)
    written = [into / "claims.json", into / "claims.md"]
    for file, text in zip(written, (json.dumps(said, indent=1) + "\n", page), strict=True):
        with written_aside(file) as aside:
            aside.write_text(text, encoding="utf-8")
    _tell(found, written, into)
    return status


def _tell(found: Reproduction, written: list[Path], into: Path) -> None:
    from qddot.paper.section_figures import draw_all  # noqa: PLC0415 - matplotlib is slow to import

    console = Console()
    console.print(f"[bold]{found.paper.title}[/bold]\n")
    for table in (cheapest_table(found.cost), speeds_table(found.driving), claims_table(found.claims)):
        console.print(table, "")
    for note in notes(found):
        console.print(note, highlight=False)
    for file in (*written, *draw_all(found, into)):
        console.print(f"wrote {file}", highlight=False, soft_wrap=True)


def write_report(claims_file: Path, equations: str, into: Path, as_pdf: bool) -> None:
    """Write the report as HTML and, where a browser is installed, as PDF. equations: the model's, as an HTML page."""
    from qddot.paper.report import report  # noqa: PLC0415 - integrates, which `qddot paper` need not wait for

    page = report(PAPER, claims_file, equations, into)
    print(f"wrote {page}")
    program = browser() if as_pdf else None
    if program is not None:
        print(f"wrote {print_page(program, page, page.with_suffix('.pdf'))}")
    elif as_pdf:
        print(f"no PDF: none of {', '.join(BROWSERS)} is installed")
