"""`qddot list`."""

from functools import partial

from qddot.command import Command, argument, call

COMMAND = Command(
    partial(call, "qddot.runner.commands.catalogue", "catalogue"),
    "List models, studies, the library's guns and roads, integration methods and metrics.",
    (
        argument(
            "what",
            metavar="WHAT",
            nargs="?",
            default="all",
            help="models, studies, library, methods or metrics; all by default.",
        ),
    ),
)
