"""`qddot show`."""

from functools import partial

from qddot.command import Command, argument, compute, path

COMMAND = Command(
    partial(compute, "qddot.runner.commands.show", "show"),
    "Show a model: its tables, static equilibrium and modes; or a study: what drives it, as a table and a figure.",
    (
        argument("name", metavar="NAME", help="A model's name, a generated module, or a study (.toml)."),
        argument("--parameters", metavar="SET", help="Parameter set for the modes; all sets by default."),
        path("--into", "Folder for the figure of a study's inputs", "results"),
    ),
)
