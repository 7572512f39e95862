"""`qddot batch`."""

from typing import Any

from qddot.command import FIGURE, SET, STUDY, Command, argument, compute, flag, path
from qddot.extras import drawn


def batch(figure: bool | None, **given: Any) -> int:
    """Run all runs of a study's sweep."""
    return compute("qddot.runner.commands.batch", "batch", figure=drawn(figure), **given)


COMMAND = Command(
    batch,
    "Run all runs of a study's sweep, or go on with a batch that was stopped.",
    (
        STUDY,
        path("--out", "The Zarr store; results/STUDY.zarr by default."),
        SET,
        argument("--workers", type=int, help="Compute in so many Dask worker processes."),
        argument("--scheduler", metavar="TCP://...", help="Compute on a Dask scheduler's workers."),
        flag("--fresh", "Remove a store that is there, and compute all again."),
        flag("--keep-kernels", "Keep to the kernels that the store was begun with, though the model changed."),
        FIGURE,
    ),
)
