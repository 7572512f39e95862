"""`qddot run`."""

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from qddot.command import FIGURE, SET, STUDY, Command, argument, compute, path
from qddot.extras import drawn


def run(study: Path, into: Path, figure: bool | None, settings: Sequence[str], row: int | None) -> int:
    """Run a study, its figure drawn beside."""
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
    ),
)
