"""`qddot identify`: fit, judge, print, draw and store."""

import json
from dataclasses import asdict
from datetime import date
from pathlib import Path

from rich.console import Console

from qddot.runner.identify.fit import fit
from qddot.runner.identify.judge import judge
from qddot.runner.identify.problem import read
from qddot.runner.identify.store import estimates, save
from qddot.runner.report.identified_tables import estimates_table, observations_table, quality
from qddot.runner.report.progress import progress_bar


def identify(path: Path, into: Path, as_json: bool) -> int:
    """Fit the unknowns; 1 where the search did not end at a minimum. Everything found is written either way."""
    problem = read(path)
    with progress_bar(path.stem) as bar:
        found = fit(problem, bar)
    judgement = judge(problem, found)
    unknowns = estimates(problem, found, judgement)
    written = save(problem, found, judgement, into, date.today())
    if as_json:
        said = {"estimates": [asdict(each) for each in unknowns], "notes": judgement.notes, "file": str(written)}
        print(json.dumps(said | {"chi_squared": judgement.chi_squared, "fits": judgement.fits}, indent=1))
        return 0 if found.converged else 1
    from qddot.runner.report.identified_figure import draw  # noqa: PLC0415 - matplotlib is slow to import

    console = Console()
    console.print(f"[bold]{problem.given.title}[/bold]")
    console.print(quality(problem, found, judgement), highlight=False)
    console.print(estimates_table(unknowns), "")
    console.print(observations_table(problem, found))
    for note in judgement.notes:
        console.print(f"note: {note}", highlight=False)
    for file in (written, draw(problem, found, into / f"{problem.given.name}.png")):
        console.print(f"wrote {file}", highlight=False, soft_wrap=True)
    return 0 if found.converged else 1
