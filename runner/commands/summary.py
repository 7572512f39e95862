"""`qddot summary`: a batch in short."""

from pathlib import Path

from qddot.runner.batch.results import Results
from qddot.runner.report.batch_tables import print_summary, status_of, wide_console


def summary(store: Path) -> int:
    """Print how many runs there are and failed, the metrics, and the reasons of failures. 1 where it is damaged."""
    results = Results(store)
    print_summary(wide_console(), results)
    return status_of(results)
