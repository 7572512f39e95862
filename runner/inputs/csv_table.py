"""Signals from the columns of a CSV file, with their units."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import finite
from qddot.runner.inputs.signal import Signal
from qddot.runner.inputs.tables import resampled, table_at
from qddot.units.columns import read_columns

#: Most samples of a table that is resampled.
MOST_SAMPLES = 10_000_000


def table_from_csv(
    path: str | Path,
    *,
    time: str | int = 0,
    value: str | int = 1,
    time_unit: str | None = None,
    value_unit: str | None = None,
    unit: str | None = None,
    kind: str = "linear",
    resample: float | None = None,
    argument: tuple[str, str] = ("time", "s"),
) -> Signal:
    """A table from two columns of a CSV file, given by heading or by place from 0.

    Delimiter `;`, tab or `,`; with the first two numbers may have decimal commas. Lines that start with # are comments.
    A unit stands in the heading, `force [kN]`, or is declared by time_unit and value_unit. Times become s; values
    become `unit`, or SI base units where it is not given; columns without a unit are taken as they are.
    resample: see `samples_from_csv`; by default every row stays. argument: what the first column is, and its unit: a
    road's is ("distance", "m"). Raises ValueError naming file, line and column.
    """
    t, values, place = samples_from_csv(path, time, value, time_unit, value_unit, unit, resample, argument)
    return table_at(t, values, kind, None, place, argument[0])


def samples_from_csv(
    path: str | Path,
    time: str | int = 0,
    value: str | int = 1,
    time_unit: str | None = None,
    value_unit: str | None = None,
    unit: str | None = None,
    resample: float | None = None,
    argument: tuple[str, str] = ("time", "s"),
) -> tuple[NDArray[np.float64], NDArray[np.float64], Callable[[int], str]]:
    """Arguments, values and the function that names the place of a row, checked; otherwise as `table_from_csv`.

    resample: a spacing at which to take means of the rows' lines, which keep the integral.
    """
    path = Path(path)
    columns = read_columns(path)
    times = np.array(columns.numbers(time, time_unit, argument[1]))
    values = np.array(columns.numbers(value, value_unit, unit))
    if resample is None:
        return times, values, columns.line
    if not finite("resample", resample) > 0:
        raise ValueError(f"resample is {resample}, expected a spacing greater than 0")
    table_at(times, values, "linear", None, columns.line, argument[0])
    if times[-1] - times[0] > MOST_SAMPLES * resample:
        raise ValueError(f"{path}: resample is {resample:g}: that is more than {MOST_SAMPLES} samples")
    return *resampled(times, values, resample), lambda i: f"{path}, resampled at {resample}, sample {i}"
