"""`qddot run`: a study, its file of results, its figure, and what is said of it."""

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from qddot.runner.commands.ahead import compiling_ahead
from qddot.runner.files import named, ready
from qddot.runner.machine.compiling import compiled_for
from qddot.runner.pictures.arrange import run_picture
from qddot.runner.pictures.picture import Picture
from qddot.runner.report.background import Drawing
from qddot.runner.report.progress import progress_bar
from qddot.runner.report.tables import happened, not_finite, statistics, summary
from qddot.runner.solution import Solution
from qddot.runner.study.overrides import parsed
from qddot.runner.study.read import StudyError
from qddot.runner.study.ready import Study, read_study
from qddot.runner.study.rows import row_of
from qddot.runner.study.schema import StudyTable

#: Seconds of integration beyond which a run is not made again for what lies between its saved points.
PATIENCE = 20.0


def run(path: Path, into: Path, drawing: Drawing | None, settings: Sequence[str], row: int | None) -> int:
    """Run a study; write and print what came of it. 1 where the run failed on its way: what there is is kept.

    settings: "key=value" in place of the file's; row: the run of the study's sweep. Both stand in the files' names.
    """
    with compiling_ahead():
        return _run(path, into, drawing, settings, row)


def _run(path: Path, into: Path, drawing: Drawing | None, settings: Sequence[str], row: int | None) -> int:
    ready_study = chosen(path, settings, row)
    study = ready_study.tables
    which = told(study, row)
    data = into / f"{named(path.stem, row=which, set=settings)}.nc"
    for each in (data, data.with_name(f"{data.stem}.png")):
        ready(each)  # before anything is computed that could not be written
    with progress_bar(path.stem) as bar:
        solution = ready_study.run(progress=bar, on_failure="return")
    origin = {
        "title": study.title,
        "study": str(path.resolve()),
        "settings": " ".join(settings),
        "row": "" if row is None else str(row),
    }
    title = (study.title or path.stem) + ("" if row is None else f" (run {row})")
    return _write(study, replace(solution, metadata={**solution.metadata, **origin}), path, data, title, drawing)


def chosen(path: Path, settings: Sequence[str], row: int | None) -> Study:
    """The study with these settings, or a run of its sweep."""
    return read_study(path, parsed(settings)) if row is None else row_of(path, parsed(settings), row)


def told(study: StudyTable, row: int | None) -> list[int | str]:
    """Which run of a sweep it is, for names of files: none where there is no sweep; its own values are told to be."""
    if row is not None or not study.sweep.axes:
        return [] if row is None else [row]
    note("note:", "the study's own values, without its sweep: --row N runs one of its runs, `qddot batch` all")
    return ["base"]


def _write(study: StudyTable, solution: Solution, path: Path, data: Path, title: str, drawing: Drawing | None) -> int:
    console = Console(emoji=False, markup=False)
    if not solution.success:
        note("[red]error:[/red]", solution.message)
        title = f"{title} (partial: up to t = {solution.t[-1]:.6g} s)"
    if other := _other_study(data, path):
        note("note:", f"{data} held a run of {other}")
    picture = data.with_name(f"{data.stem}.png")
    seen = solution
    if solution.statistics.wall_time > PATIENCE:
        seen = replace(solution, between=None)
        note("note:", f"a run of more than {PATIENCE:g} s: extremes and figure are those of its saved points")
    if drawing is not None:
        drawing.begin(_picture(study, seen, path, title), picture)
    solution.save(data)
    console.print(title, style="bold", highlight=False)
    console.print(statistics(solution, compiled_for()), highlight=False, soft_wrap=True)
    console.print(summary(seen))
    for line in happened(solution):
        console.print(line, highlight=False, soft_wrap=True)
    for line in not_finite(solution):
        console.print(f"note: {line}", highlight=False, soft_wrap=True)
    console.print(f"wrote {data}", highlight=False, soft_wrap=True)
    if drawing is not None:
        drawing.finish()
        console.print(f"wrote {picture}", highlight=False, soft_wrap=True)
    return 0 if solution.success else 1


def note(kind: str, text: str) -> None:
    """Say something beside the results."""
    Console(stderr=True, emoji=False).print(f"{kind} {escape(text)}", highlight=False, soft_wrap=True)


def _other_study(data: Path, path: Path) -> str:
    """The other study whose run a file holds that will be replaced; nothing where it is this one, or not known."""
    from netCDF4 import Dataset  # noqa: PLC0415 - only a run that is saved needs it

    if not data.exists():
        return ""
    with contextlib.suppress(OSError, RuntimeError), Dataset(data) as file:
        study = str(getattr(file, "study", path.resolve()))
        return "" if study == str(path.resolve()) else study
    return ""


def _picture(study: StudyTable, solution: Solution, path: Path, title: str) -> Picture:
    try:
        return run_picture(solution.closely, solution.headlines, title, study.figure.panels, study.figure.from_start)
    except ValueError as error:
        raise StudyError(f"{path}: figure: {error}") from error
