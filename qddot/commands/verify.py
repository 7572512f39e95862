"""`qddot verify`."""

from functools import partial

from qddot.command import JSON, Command, compute, path

COMMAND = Command(
    partial(compute, "qddot.paper.command", "verification"),
    "Verify section 3.1 of the M113 paper: six schemes against the analytic solution.",
    (path("--into", "Folder for the figures", "results/verification"), JSON),
)
