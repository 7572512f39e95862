"""Columns of numbers in a CSV file, with their units: the lines, the headings, the numbers in the unit wanted."""

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

from qddot.units.worth import AngleError, DimensionError, conversion, to_base
from qddot.words import nearest

#: Delimiters in the order of preference: a file with semicolons or tabs may have decimal commas.
DELIMITERS = (";", "\t", ",")
#: A heading such as `force [kN]` or `force (kN)`.
HEADING = re.compile(r"^\s*(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\))?\s*$")

Row = tuple[int, list[str]]


@dataclass(frozen=True)
class Columns:
    """Rows of numbers, each with its line, and the headings with their units, none where the file has no heading."""

    path: Path
    rows: list[Row]
    heading: list[tuple[str, str | None]]

    def line(self, row: int) -> str:
        """Where a row stands."""
        return f"{self.path}, line {self.rows[row][0]}"

    def numbers(self, which: str | int, declared: str | None = None, wanted: str | None = None) -> list[float]:
        """The numbers of a column, given by heading or by place from 0, in the unit wanted, or in SI base units.

        declared: its unit where the heading has none; a column without a unit is taken as it is. Raises ValueError
        naming file, line and column.
        """
        place = self._place(which)
        name, unit = self.heading[place] if place < len(self.heading) else (str(place), None)
        where = f"{self.path}, column {name!r}"
        if unit and declared and unit != declared:
            raise ValueError(f"{where}: the heading says [{unit}], declared is [{declared}]")
        numbers = [self._number(line, name, row, place) for line, row in self.rows]
        return _converted(where, numbers, unit or declared, wanted)

    def _place(self, which: str | int) -> int:
        if isinstance(which, int):
            if which < 0:
                raise ValueError(f"column {which}: columns are counted from 0")
            return which
        name, names = _heading(which)[0], [name for name, _ in self.heading]
        if not names:
            raise ValueError(
                f"{self.path}: no heading, so there is no column {which!r}; give the column's place, from 0"
            )
        if name not in names:
            raise ValueError(f"{self.path}: unknown column {name!r}{nearest(name, names)} There are: {_list(names)}")
        if names.count(name) > 1:
            raise ValueError(f"{self.path}: column {name!r} occurs {names.count(name)} times; give its place, from 0")
        return names.index(name)

    def _number(self, line: int, name: str, row: list[str], place: int) -> float:
        if place >= len(row):
            raise ValueError(
                f"{self.path}, line {line}: no column {name!r}; the line has {len(row)} of {place + 1} columns"
            )
        if not _is_number(row[place]):
            raise ValueError(f"{self.path}, line {line}, column {name!r}: {row[place]!r} is not a number")
        return float(row[place])


def read_columns(path: Path) -> Columns:
    """The columns of a CSV file.

    Delimiter `;`, tab or `,`; with the first two numbers may have decimal commas. Lines that start with # are comments.
    Raises OSError, or ValueError naming file and line.
    """
    rows = _rows(path)
    heading = [] if _is_row(path, *rows[0]) else [_heading(cell) for cell in rows.pop(0)[1]]
    if len(rows) < 2:
        raise ValueError(f"{path}: {len(rows)} rows of numbers; a table needs two or more")
    _check_widths(path, rows, heading)
    return Columns(path, rows, heading)


def _check_widths(path: Path, rows: list[Row], heading: list[tuple[str, str | None]]) -> None:
    """A row wider than the heading is most often one with decimal commas between commas."""
    for line, row in rows if heading else ():
        if len(row) > len(heading) and any(row[len(heading) :]):
            raise ValueError(
                f"{path}, line {line}: {len(row)} columns where the heading has {len(heading)}; "
                "numbers with decimal commas need ; or tabs between the columns"
            )


def _rows(path: Path) -> list[Row]:
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
    match = HEADING.match(" ".join(cell.split()))
    assert match is not None  # the pattern matches every line, and a cell in quotes may be several
    unit = match["square"] if match["square"] is not None else match["round"]
    return match["name"], unit.strip() if unit is not None else None


def _converted(where: str, numbers: list[float], unit: str | None, wanted: str | None) -> list[float]:
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
    return [float(convert(number)) for number in numbers]


def _list(names: list[str]) -> str:
    return ", ".join(map(repr, names[:20])) + (", ..." if len(names) > 20 else "")
