"""`qddot report` of a batch: what it says of all runs, and the runs to choose from, on one page."""

from pathlib import Path

from qddot.runner.batch.results import Results
from qddot.runner.commands.report import print_as_pdf
from qddot.runner.files import ready
from qddot.runner.report.batch_page import write
from qddot.runner.report.batch_tables import status_of, wrote


def report_batch(store: Path, into: Path | None, pdf: bool) -> int:
    """Write the page of a batch, STORE.html beside its store by default. 1 where the store is damaged."""
    results = Results(store)
    into = into or store.with_name(f"{store.name.removesuffix('.zarr')}.html")
    ready(into)
    wrote(results, write(results, into))
    print_as_pdf(into, pdf)
    return status_of(results)
