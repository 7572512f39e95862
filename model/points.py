"""The points of tables: what must be true of them, and how a file holds them."""

import math
from collections.abc import Sequence
from itertools import product
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qddot.model.patches import KINDS
from qddot.units.columns import Columns, read_columns

if TYPE_CHECKING:
    from qddot.model.table import Table

#: The most points: all of them stand in the generated module.
MOST_POINTS = 4000


def wrong_points(x: Sequence[Any], y: Sequence[Any], units: Sequence[str | None]) -> str | None:
    """What is wrong with the points of a table of one argument; None where nothing is."""
    if len(units) > 1:
        return f"has the units {', '.join(map(str, units))} of arguments, and no z: give one unit, or z"
    if len(x) != len(y) or not 2 <= len(x) <= MOST_POINTS:
        return f"has {len(x)} x and {len(y)} y, expected as many of both, 2 to {MOST_POINTS}"
    return _no_number("x", x) or _no_number("y", y) or _not_rising("x", x)


def wrong_grid(table: "Table") -> str | None:
    """What is wrong with the grid of a table of two arguments; None where nothing is."""
    x, y, z = table.x, table.y, table.z or ()
    if table.interpolation not in KINDS:
        return f"interpolation is {table.interpolation!r}, expected {' or '.join(KINDS)} of two arguments"
    if table.argument is not None and len(table.units) != 2:
        return f"has the argument {table.argument!r} and z: give two units, of x and of y"
    if min(len(x), len(y)) < 2 or len(x) * len(y) > MOST_POINTS:
        return f"has {len(x)} x and {len(y)} y, expected two or more of each, and {MOST_POINTS} points at most"
    if len(z) != len(x):
        return f"has {len(x)} x and {len(z)} rows of z, expected one for each x"
    for i, row in enumerate(z):
        if not isinstance(row, tuple) or len(row) != len(y):
            found = f"{len(row)} numbers" if isinstance(row, tuple) else repr(row)
            return f"has {len(y)} y, and z[{i}] is {found}, expected a number for each y"
    wrong = (_no_number(f"z[{i}]", row) for i, row in enumerate(z))
    lines = (_no_number(name, line) or _not_rising(name, line) for name, line in (("x", x), ("y", y)))
    return next((each for each in (*lines, *wrong) if each), None)


def _no_number(name: str, values: Sequence[Any]) -> str | None:
    for i, value in enumerate(values):
        if not isinstance(value, Real) or isinstance(value, bool) or not math.isfinite(value):
            return f"{name}[{i}] is {value!r}, expected a finite number"
    return None


def _not_rising(name: str, values: Sequence[Any]) -> str | None:
    for i in range(1, len(values)):
        if values[i] <= values[i - 1]:
            return f"{name}[{i}] = {values[i]!r} is not greater than {name}[{i - 1}] = {values[i - 1]!r}"
    return None


def read_points(path: Path, units: Sequence[str | None], unit: str) -> tuple[Any, ...]:
    """The points of a CSV file: x and y, or, where arguments have two units, the lines of a grid and its values.

    unit: of the values. Raises OSError, or ValueError naming file, line and column.
    """
    if len(units) > 2:
        raise ValueError(f"has {len(units)} units of arguments, expected one, or two for x and y")
    columns = read_columns(path)
    found = [columns.numbers(k, None, each) for k, each in enumerate((*units, unit))]
    return tuple(found) if len(found) == 2 else _grid(columns, *found)


def _grid(columns: Columns, x: Sequence[float], y: Sequence[float], z: Sequence[float]) -> tuple[Any, ...]:
    """The lines of a grid and its values from its points; ValueError where one is missing or there twice."""
    found: dict[tuple[float, float], float] = {}
    for row, point in enumerate(zip(x, y, strict=True)):
        if point in found:
            raise ValueError(f"{columns.line(row)}: the point x = {point[0]!r}, y = {point[1]!r} is there already")
        found[point] = z[row]
    lines = sorted(set(x)), sorted(set(y))
    for a, b in product(*lines):
        if (a, b) not in found:
            lacking = f"no row for x = {a!r}, y = {b!r}"
            raise ValueError(f"{columns.path}: {lacking}; a table of two arguments has one for each x with each y")
    return (*lines, [[found[a, b] for b in lines[1]] for a in lines[0]])
