"""`qddot run`."""

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from qddot.command import FIGURE, SET, STUDY, Command, argument, call, compute, flag, path
from qddot.extras import drawn


def run(study: Path, into: Path, figure: bool | None, settings: Sequence[str], row: int | None, watch: bool) -> int:
    """Run a study, its figure drawn beside; watch: again whenever a file changes."""
    if watch:
        options = ["--into", str(into), *(word for text in settings for word in ("--set", text))]
        options += [] if figure is None else ["--figure" if figure else "--no-figure"]
        options += [] if row is None else ["--row", str(row)]
        return call("qddot.runner.commands.watch", "watch", study=study, options=options)
    from qddot.runner.report.background import Drawing

    with Drawing() if drawn(figure) else nullcontext() as drawing:  # imports matplotlib while we import numba
        given = {"path": study, "into": into, "drawing": drawing, "settings": settings, "row": row}
        return compute("qddot.runner.commands.run", "run", **given)


COMMAND = Command(
    run,
    "Run a study once: a NetCDF file, a figure and a summary.",
    (
        STUDY,
        path("--into", "Folder for the results", "results"),
        FIGURE,
        SET,
        argument("--row", type=int, help="Run this run of the study's sweep, counted from 0."),
        flag("--watch", "Run again whenever the study, its model or a file that it names changes, until Ctrl-C."),
    ),
)
