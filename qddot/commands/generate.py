"""`qddot generate`."""

from functools import partial

from qddot.command import MODELS, Command, call, flag, path

COMMAND = Command(
    partial(call, "qddot.codegen.command", "generate"),
    "Derive models and write their kernels and equations.",
    (
        MODELS,
        path("--into", "Folder to write to; for shipped models generated/, where you stand."),
        flag("--check", "Write nothing; say which files differ, and exit with 1 where one does."),
        flag("--diff", "With --check: print how they differ."),
    ),
)
