"""`qddot compare`."""

from functools import partial
from pathlib import Path

from qddot.command import Command, argument, call

COMMAND = Command(
    partial(call, "qddot.codegen.compare.command", "run"),
    "Compare hand-written equations of motion with those derived, term by term; exits with 1 where they differ.",
    (
        argument("path", metavar="EQUATIONS", type=Path, help="A text file of equations, see studies/paper/."),
        argument("--model", dest="name", metavar="NAME", help="The model, where the file names none."),
        argument("--latex", dest="form", action="store_const", const="latex", default="text", help="Print LaTeX."),
        argument("--json", dest="form", action="store_const", const="json", help="Print JSON."),
    ),
)
