"""`qddot plot RUN.nc ...`: the figure of a run, or of several over each other, as a picture or to point at."""

from collections.abc import Sequence
from pathlib import Path

from qddot.runner.files import named
from qddot.runner.pictures.arrange import run_picture, runs_picture
from qddot.runner.pictures.picture import Picture
from qddot.runner.report.interactive import section
from qddot.runner.report.page import write_page
from qddot.runner.report.saved_run import SavedRun, read_run
from qddot.words import from_here

#: The most runs over each other that can be told apart.
MOST_RUNS = 6
_PAGE = ".html"


def plot_runs(paths: Sequence[Path], quantities: Sequence[str], as_page: bool, into: Path | None) -> int:
    """Draw one run, or several over each other, a panel for each quantity; those that are worth a look by default."""
    if len(paths) > MOST_RUNS:
        raise ValueError(f"{len(paths)} runs over each other; at most {MOST_RUNS} can be told apart")
    for k, name in enumerate(quantities):
        if name in quantities[:k]:
            raise ValueError(f"--quantity: {name!r} is given twice")
    into = _target(paths, quantities, as_page, into)
    runs = {called: read_run(path) for called, path in zip(_called(paths), paths, strict=True)}
    try:
        picture = _picture(runs, quantities)
    except ValueError as error:
        raise ValueError(f"--quantity: {error}") from error
    if into.suffix == _PAGE:
        _write_page(picture, paths, into)
    else:
        from qddot.runner.pictures.figures import draw  # noqa: PLC0415 - matplotlib is slow to import

        draw(picture, into)
    print(f"wrote {from_here(into)}")
    return 0


def _picture(runs: dict[str, SavedRun], quantities: Sequence[str]) -> Picture:
    if len(runs) == 1:
        ((called, run),) = runs.items()
        return run_picture(run, run.headlines, run.title or called, quantities)
    titles = {run.title for run in runs.values() if run.title}
    title = f"{titles.pop()}: " if len(titles) == 1 else ""
    both = {called: (run, run.headlines) for called, run in runs.items()}
    return runs_picture(both, title + " and ".join(runs), quantities)


def _target(paths: Sequence[Path], quantities: Sequence[str], as_page: bool, into: Path | None) -> Path:
    """Where it is written: beside the first run, if nothing is said, where `qddot run` has not written its figure."""
    if into is not None:
        if as_page and into.suffix != _PAGE:
            raise ValueError(f"--into {into}: with --html expected a name that ends in {_PAGE}")
        return into
    stem = f"{paths[0].stem}_plot" if len(paths) == 1 else "_over_".join(path.stem for path in paths)
    return paths[0].with_name(f"{named(stem, quantity=quantities)}{_PAGE if as_page else '.png'}")


def _called(paths: Sequence[Path]) -> list[str]:
    """What runs are called: the names of their files, with the folders where those are the same."""
    for k, path in enumerate(paths):
        if path.resolve() in [other.resolve() for other in paths[:k]]:
            raise ValueError(f"{path} is given twice; expected runs that differ")
    stems = [path.stem for path in paths]
    return stems if len(set(stems)) == len(stems) else [str(path.with_suffix("")) for path in paths]


def _write_page(picture: Picture, paths: Sequence[Path], into: Path) -> None:
    part, plots = section("Over time", picture)
    write_page(into, picture.title, f"Drawn by qddot from {', '.join(map(str, paths))}.", [part], plots)
