"""`qddot identify`."""

from functools import partial
from pathlib import Path

from qddot.command import JSON, Command, argument, compute, path

COMMAND = Command(
    partial(compute, "qddot.runner.commands.identify", "identify"),
    "Fit unknowns of studies to observations, and say how sure each is.",
    (
        argument("path", metavar="STUDY", type=Path, help="A TOML file, see studies/paper/identify_*.toml."),
        path("--into", "Folder for the parameter set and the figure", "results/identified"),
        JSON,
    ),
)
