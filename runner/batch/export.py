"""The rows of a batch as CSV or Parquet: one line a run."""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from qddot.runner.batch.outcome import NOT_RUN
from qddot.runner.batch.results import Results
from qddot.runner.files import written_aside

FORMATS = (".csv", ".parquet")


def export(results: Results, path: Path) -> Path:
    """Write run, axes, status, failed_at and metrics of all runs; units in the headings, or in the fields' metadata.

    Trajectories stay in the store. Of a batch that is not finished, runs that are missing have the status not_run; the
    metadata of a Parquet table say how far it is. Raises ValueError for a name that ends in neither .csv nor .parquet.
    """
    if path.suffix not in FORMATS:
        raise ValueError(f"--to {path}: expected a name that ends in {' or '.join(FORMATS)}")
    with written_aside(path) as aside:
        if path.suffix == ".csv":
            _write_csv(results, aside)
        else:
            _write_parquet(results, aside)
    return path


def _columns(results: Results) -> Iterator[tuple[str, str, Any]]:
    """Name, unit and values of each column."""
    yield "run", "", np.arange(len(results.status))
    for axis in results.axes:
        yield axis, results.unit(axis), results.column(axis)
    said = results.data["status"].attrs
    names = dict(zip(said["flag_values"], said["flag_meanings"].split(), strict=True))
    yield "status", "", np.array([names[int(code)] for code in results.status], dtype=object)
    yield "failed_at", "s", np.where(results.status == NOT_RUN, np.nan, results.data["failed_at"])
    for name in results.metrics:
        yield name, results.unit(name), results.column(name)


def _write_csv(results: Results, path: Path) -> None:
    columns = list(_columns(results))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name} [{unit}]" if unit else name for name, unit, _ in columns])
        writer.writerows(zip(*(values.tolist() for _, _, values in columns), strict=True))


def _write_parquet(results: Results, path: Path) -> None:
    try:
        import pyarrow  # noqa: PLC0415 - an optional library
        import pyarrow.parquet  # noqa: PLC0415
    except ImportError:
        raise ValueError("Parquet needs pyarrow: pip install 'qddot[parquet]'; or export to .csv") from None
    columns = list(_columns(results))
    arrays = [pyarrow.array(values.tolist()) for _, _, values in columns]
    fields = [
        pyarrow.field(name, array.type, metadata={"units": unit})
        for (name, unit, _), array in zip(columns, arrays, strict=True)
    ]
    said = {"title": results.title} | ({"partial": results.partial} if results.partial else {})
    schema = pyarrow.schema(fields, metadata=said)
    pyarrow.parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=schema), path)
