"""`qddot new`."""

from functools import partial

from qddot.command import Command, argument, call, path

COMMAND = Command(
    partial(call, "qddot.codegen.new", "new"),
    "Write a commented model of your own and a study of it, to begin with.",
    (
        argument("name", metavar="NAME", help="What the model is called: NAME.py and NAME.toml."),
        path("--into", "Folder to write to", "."),
    ),
)
