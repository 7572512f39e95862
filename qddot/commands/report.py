"""`qddot report`."""

from collections.abc import Sequence
from pathlib import Path

from qddot.command import SET, Command, argument, call, flag, path, switch, working

#: What `qddot paper` writes, and where the page of the paper goes, if nothing is said.
CLAIMS, PAPER_PAGE = Path("results/paper/claims.json"), Path("results/paper/report.html")


def report(
    study: Path | None,
    batch: bool,
    settings: Sequence[str],
    row: int | None,
    claims: Path | None,
    into: Path | None,
    pdf: bool,
) -> int:
    """Write the report of a study, of a batch, or of the paper, the equations of the model in it."""
    if study is not None and (batch or study.is_dir() or study.suffix == ".zarr"):
        for option, given in (("--set", settings), ("--row", row is not None), ("--claims", claims is not None)):
            if given:
                raise ValueError(f"{option}: the report is of a batch, {study}, which is shown as it was computed")
        from qddot.runner.files import store_of

        store = study if study.suffix != ".toml" else store_of(study)
        return call("qddot.runner.commands.report_batch", "report_batch", store=store, into=into, pdf=pdf)
    from qddot.codegen.equations.command import equations_page

    if study is None:
        for option, given in (("--set", settings), ("--row", row is not None), ("--batch", batch)):
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
    "Write the report of a study: one HTML page with what was given, equations, plots, modes and energy; of a batch: "
    "its metrics and runs, to choose from in all plots; or, with neither, that of the M113 paper.",
    (
        argument(
            "study",
            metavar="STUDY",
            nargs="?",
            type=Path,
            help="A study (.toml), or a batch's store; none: the M113 paper.",
        ),
        flag("--batch", "Report the study's batch, from results/STUDY.zarr, where `qddot batch` puts it."),
        SET,
        argument("--row", type=int, help="Report this run of the study's sweep, counted from 0."),
        path("--claims", "Of the paper: what `qddot paper` wrote; results/paper/claims.json by default."),
        path(
            "--into",
            "The page to write; results/STUDY.html by default, STORE.html of a batch, results/paper/report.html.",
        ),
        switch("--pdf", "Print it as PDF, too, where a browser is installed, or not."),
    ),
)
