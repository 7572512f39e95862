"""`qddot report STUDY`: a study, its run and what follows from it, on one page."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from qddot import origin
from qddot.runner.commands.run import PATIENCE, chosen, note, told
from qddot.runner.files import named, ready, written_aside
from qddot.runner.load import Model
from qddot.runner.report.page import embedded
from qddot.runner.report.pdf import BROWSERS, browser, print_page
from qddot.runner.report.progress import progress_bar
from qddot.runner.report.study_page import write
from qddot.words import from_here

#: Letters of equations beyond which they get a page of their own.
_LARGE = 400_000


def report(
    path: Path,
    settings: Sequence[str],
    row: int | None,
    into: Path | None,
    pdf: bool,
    equations_page: Callable[[str], str],
) -> int:
    """Run a study and write its page, results/STUDY.html by default. 1 where the run failed: what there is is on it.

    settings, row: as of `run`. equations_page: gives the equations of a model, by name or file, as an HTML page.
    """
    study = chosen(path, settings, row)
    if into is None:
        into = Path("results") / f"{named(path.stem, row=told(study.tables, row), set=settings)}.html"
    ready(into)
    with progress_bar(path.stem) as bar:
        solution = study.run(progress=bar, on_failure="return")
    if solution.statistics.wall_time > PATIENCE:
        solution = replace(solution, between=None)
        note("note:", f"a run of more than {PATIENCE:g} s: extremes and plots are those of its saved points")
    if not solution.success:
        note("[red]error:[/red]", solution.message)
    page = write(study, solution, _equations(study.model, equations_page, into), row, into)
    print(f"wrote {from_here(page)}")
    print_as_pdf(page, pdf)
    return 0 if solution.success else 1


def print_as_pdf(page: Path, wanted: bool) -> None:
    """Print a page beside itself, where that is wanted and a browser is installed, and say what became of it."""
    program = browser() if wanted else None
    if program is not None:
        print(f"wrote {from_here(print_page(program, page, page.with_suffix('.pdf')))}")
    elif wanted:
        print(f"no PDF: none of {', '.join(BROWSERS)} is installed")


def _equations(model: Model, equations_page: Callable[[str], str], into: Path) -> str:
    """The equations as HTML, or a link to a page of their own beside the report; nothing without the model's source."""
    source = _source(model)
    if source is None:
        return ""
    page = equations_page(source)
    if len(page) < _LARGE:
        return embedded(page)
    beside = into.with_name(f"{into.stem}_equations.html")
    with written_aside(beside) as aside:
        aside.write_text(page, encoding="utf-8")
    print(f"wrote {from_here(beside)}")
    return f'<p>They are long: <a href="{beside.name}">a page of their own</a>.</p>'


def _source(model: Model) -> str | None:
    """The model as the generator finds it: its name, or its own file; None where that is not there."""
    module = Path(model.module.__file__ or "")
    file = next(iter(origin.read(module)), None) if module.is_file() else None
    if file is None or not file.is_file():
        return None
    return origin.shipped(file) or str(file)
