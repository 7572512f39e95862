"""`qddot paper`."""

from functools import partial

from qddot.command import JSON, Command, argument, compute, path

COMMAND = Command(
    partial(compute, "qddot.paper.command", "paper"),
    "Compute the M113 paper again and judge its claims; exits with 1 where one is no longer met.",
    (
        path("--claims", "Settings and claims; the paper's by default.", dest="path"),
        argument("--parameters", metavar="SET", help="Parameter set of the M113 in place of the paper's."),
        path("--into", "Folder for the figures and the claims", "results/paper"),
        JSON,
    ),
)
