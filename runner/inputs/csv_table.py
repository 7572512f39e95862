"""Signals from the columns of a CSV file, with their units."""

import csv
import io
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import finite, unknown
from qddot.runner.inputs.signal import Signal
from qddot.runner.inputs.tables import resampled, table_at
from qddot.units.worth import AngleError, DimensionError, conversion, to_base

#: Delimiters in the order of preference: a file with semicolons or tabs may have decimal commas.
DELIMITERS = (";", "\t", ",")
#: Most samples of a table that is resampled.
MOST_SAMPLES = 10_000_000
#: A heading such as `force [kN]` or `force (kN)`.
HEADING = re.compile(r"^\s*(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))?\s*$")


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
    rows = _rows(path)
    heading = [] if _is_row(path, *rows[0]) else [_heading(cell) for cell in rows.pop(0)[1]]
    if len(rows) < 2:
        raise ValueError(f"{path}: {len(rows)} rows of numbers; a table needs two or more")
    _check_widths(path, rows, heading)
    times = _column(path, rows, heading, time, time_unit, argument[1])
    values = _column(path, rows, heading, value, value_unit, unit)
    if resample is None:
        return times, values, lambda i: f"{path}, line {rows[i][0]}"
    if not finite("resample", resample) > 0:
        raise ValueError(f"resample is {resample}, expected a spacing greater than 0")
    table_at(times, values, "linear", None, lambda i: f"{path}, line {rows[i][0]}", argument[0])
    if times[-1] - times[0] > MOST_SAMPLES * resample:
        raise ValueError(f"{path}: resample is {resample:g}: that is more than {MOST_SAMPLES} samples")
    return *resampled(times, values, resample), lambda i: f"{path}, resampled at {resample}, sample {i}"


def _check_widths(path: Path, rows: list[tuple[int, list[str]]], heading: list[tuple[str, str | None]]) -> None:
    """A row wider than the heading is most often one with decimal commas between commas."""
    for line, row in rows if heading else ():
        if len(row) > len(heading) and any(row[len(heading) :]):
            raise ValueError(
                f"{path}, line {line}: {len(row)} columns where the heading has {len(heading)}; "
                "numbers with decimal commas need ; or tabs between the columns"
            )


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line numbers and cells of the lines that are neither empty nor comments."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not UTF-8 text ({error.reason} at byte {error.start}); save it as UTF-8") from None
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{path}: the file has no rows")
    delimiter = next((each for each in DELIMITERS if each in lines[0]), ",")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True)
    rows = [(reader.line_num, row) for row in reader]
    rows = [(line, row) for line, row in rows if any(map(str.strip, row)) and not row[0].lstrip().startswith("#")]
    decimal_comma = delimiter != ","
    return [(line, [_with_point(cell) if decimal_comma else cell.strip() for cell in row]) for line, row in rows]


def _with_point(cell: str) -> str:
    """`1,5` as `1.5`; a cell with both signs, such as `1.234,5`, stays as it is and is no number."""
    cell = cell.strip()
    return cell.replace(",", ".") if re.fullmatch(r"[-+]?\d*,\d*([eE][-+]?\d+)?", cell) else cell


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _is_row(path: Path, line: int, cells: list[str]) -> bool:
    """Whether the first line is one of numbers, and no heading; a line of numbers with a slip in it is refused."""
    numbers = [_is_number(cell) for cell in cells]
    if not all(numbers) and all(re.match(r"[-+]?[.,]?[0-9]", cell) for cell in cells):
        wrong = cells[numbers.index(False)]
        raise ValueError(f"{path}, line {line}: {wrong!r} is not a number, and a heading begins with no digit")
    return all(numbers)


def _heading(cell: str) -> tuple[str, str | None]:
    match = HEADING.match(cell)
    assert match is not None  # the pattern matches every line
    unit = match["square"] if match["square"] is not None else match["round"]
    return match["name"], unit.strip() if unit is not None else None


def _column(
    path: Path,
    rows: list[tuple[int, list[str]]],
    heading: list[tuple[str, str | None]],
    which: str | int,
    declared: str | None,
    wanted: str | None,
) -> NDArray[np.float64]:
    """The numbers of one column in the unit wanted."""
    place = _place(path, [name for name, _ in heading], which)
    name, unit = heading[place] if place < len(heading) else (str(place), None)
    if unit and declared and unit != declared:
        raise ValueError(f"{path}, column {name!r}: the heading says [{unit}], declared is [{declared}]")
    numbers = np.array([_number(path, line, name, row, place) for line, row in rows])
    return _converted(f"{path}, column {name!r}", numbers, unit or declared, wanted)


def _place(path: Path, names: list[str], which: str | int) -> int:
    if isinstance(which, int):
        if which < 0:
            raise ValueError(f"column {which}: columns are counted from 0")
        return which
    name = _heading(which)[0]
    if not names:
        raise ValueError(f"{path}: no heading, so there is no column {which!r}; give the column's place, from 0")
    if name not in names:
        raise ValueError(f"{path}: {unknown('column', name, names)}")
    if names.count(name) > 1:
        raise ValueError(f"{path}: column {name!r} occurs {names.count(name)} times; give its place, from 0")
    return names.index(name)


def _number(path: Path, line: int, name: str, row: list[str], place: int) -> float:
    if place >= len(row):
        raise ValueError(f"{path}, line {line}: no column {name!r}; the line has {len(row)} of {place + 1} columns")
    if not _is_number(row[place]):
        raise ValueError(f"{path}, line {line}, column {name!r}: {row[place]!r} is not a number")
    return float(row[place])


def _converted(where: str, numbers: NDArray[np.float64], unit: str | None, wanted: str | None) -> NDArray[np.float64]:
    if not unit or unit == wanted:
        return numbers
    try:
        convert = conversion(unit, wanted) if wanted else to_base(unit)
    except AngleError as error:
        raise ValueError(f"{where}: [{unit}] {error}") from None
    except DimensionError:
        raise ValueError(f"{where}: [{unit}] cannot be turned into [{wanted}]") from None
    except ValueError as error:
        raise ValueError(f"{where}: unknown unit [{unit}]: {error}") from None
    return np.asarray(convert(numbers), dtype=np.float64)
