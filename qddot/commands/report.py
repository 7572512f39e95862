"""`qddot report`."""

from pathlib import Path

from qddot.command import Command, path, switch, working


def report(claims: Path, into: Path, pdf: bool) -> int:
    """Write the report, the equations of its model in it."""
    from qddot.codegen.equations.command import equations_page
    from qddot.paper.command import write_report

    with working():
        write_report(claims, equations_page("m113"), into, pdf)
    return 0


COMMAND = Command(
    report,
    "Write the report of the M113 paper: one HTML page with equations, claims, plots and an animation; and as PDF.",
    (
        path("--claims", "What `qddot paper` wrote", "results/paper/claims.json"),
        path("--into", "The page to write", "results/paper/report.html"),
        switch("--pdf", "Print it as PDF, too, where a browser is installed, or not."),
    ),
)
