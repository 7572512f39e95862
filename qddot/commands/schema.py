"""`qddot schema`."""

from functools import partial
from pathlib import Path

from qddot.command import Command, argument, call

COMMAND = Command(
    partial(call, "qddot.runner.commands.schema", "schema"),
    "Give the JSON Schema of studies, for editors.",
    (argument("--into", dest="path", metavar="PATH", type=Path, help="Write it here; printed by default."),),
)
