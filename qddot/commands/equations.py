"""`qddot equations`."""

from functools import partial

from qddot.command import MODELS, Command, call, flag, path

COMMAND = Command(
    partial(call, "qddot.codegen.equations.command", "equations"),
    "Show the derived equations, and write them as HTML and, where LaTeX is installed, as PDF.",
    (
        MODELS,
        path("--into", "Folder for the HTML pages and PDFs", "results/equations"),
        flag("--quiet", "Print no equations, only what was written."),
    ),
)
