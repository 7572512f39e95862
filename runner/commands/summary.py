"""`qddot summary`: a batch in short."""

from pathlib import Path

from qddot.runner.batch.results import Results
from qddot.runner.report.batch_tables import print_summary, wide_console


def summary(store: Path) -> int:
    """Print how many runs there are and failed, the metrics, and the reasons of failures."""
    print_summary(wide_console(), Results(store))
    return 0
