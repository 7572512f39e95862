"""`qddot report`."""

from collections.abc import Sequence
from pathlib import Path

from qddot.command import SET, Command, argument, call, path, switch, working

#: What `qddot paper` writes, and where the page of the paper goes, if nothing is said.
CLAIMS, PAPER_PAGE = Path("results/paper/claims.json"), Path("results/paper/report.html")


def report(
    study: Path | None,
    settings: Sequence[str],
    row: int | None,
    claims: Path | None,
    into: Path | None,
    pdf: bool,
) -> int:
    """Write the report of a study, or of the paper, the equations of its model in it."""
    from qddot.codegen.equations.command import equations_page

    if study is None:
        for option, given in (("--set", settings), ("--row", row is not None)):
            if given:
                raise ValueError(f"{option} is of a study, and none is given: qddot report STUDY.toml")
        from qddot.paper.command import write_report

        with working():
            write_report(claims or CLAIMS, equations_page("m113"), into or PAPER_PAGE, pdf)
        return 0
    if claims is not None:
        raise ValueError(f"--claims is of the paper, and a study is given, {study}")
    with working():
        return call(
            "qddot.runner.commands.report",
            "report",
            path=study,
            settings=settings,
            row=row,
            into=into,
            pdf=pdf,
            equations_page=equations_page,
        )


COMMAND = Command(
    report,
    "Write the report of a study: one HTML page with what was given, equations, plots, modes and energy; or, without a "
    "study, that of the M113 paper.",
    (
        argument("study", metavar="STUDY", nargs="?", type=Path, help="A study (.toml); none: the M113 paper."),
        SET,
        argument("--row", type=int, help="Report this run of the study's sweep, counted from 0."),
        path("--claims", "Of the paper: what `qddot paper` wrote; results/paper/claims.json by default."),
        path("--into", "The page to write; results/STUDY.html by default, results/paper/report.html of the paper."),
        switch("--pdf", "Print it as PDF, too, where a browser is installed, or not."),
    ),
)
