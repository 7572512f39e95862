"""`qddot export`."""

from functools import partial
from pathlib import Path

from qddot.command import STORE, Command, argument, call

COMMAND = Command(
    partial(call, "qddot.runner.commands.export", "export"),
    "Export a batch as a table, one line a run.",
    (STORE, argument("--to", metavar="FILE", type=Path, required=True, help="FILE.csv or FILE.parquet.")),
)
