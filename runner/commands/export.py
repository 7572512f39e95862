"""`qddot export`: the rows of a batch as a table."""

from pathlib import Path

from qddot.runner.batch.export import export as written
from qddot.runner.batch.results import Results
from qddot.runner.report.batch_tables import status_of, wrote


def export(store: Path, to: Path) -> int:
    """Export the rows of a store. 1 where it is damaged."""
    results = Results(store)
    wrote(results, written(results, to))
    return status_of(results)
