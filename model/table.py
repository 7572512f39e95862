"""A quantity that is known by points alone: `area = Table(...)`, used as `area(s)` in any expression of a model."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from numbers import Real
from pathlib import Path
from typing import Any

from sympy import Expr, Function, Integer

from qddot.model.interpolation import DEGREES, OUTSIDE, Pieces, interpolated
from qddot.units.columns import read_columns

#: What the derivatives of a table are called behind its name, by order.
ORDERS = ("", "_slope", "_curvature", "_third_derivative")
#: What its data are called behind its name.
DATA = "_pieces"
_OUTSIDE = {"hold": "its ends held outside", "extend": "its ends extended", "refuse": "no number outside"}
#: The most points: all of them stand in the generated module.
MOST_POINTS = 4000


class Value(Function):
    """The value of a table, or a derivative of it, at an argument; each table has classes of its own."""

    table: "Table"
    order: int

    def fdiff(self, argindex: int = 1) -> Expr:
        """The derivative by the argument; zero beyond the degree of the table's polynomials."""
        if self.order == self.table.pieces.degree:
            return Integer(0)
        return self.table.function(self.order + 1)(self.args[0])


@dataclass(frozen=True)
class Table:
    """A function of one argument through points that rise in x; call it with an expression.

    x, y: the points; or file, a CSV file whose first two columns they are, beside the file of the program that makes
    the table. Its headings may name units (`stroke [mm]`), from which values become `unit` and arguments become
    `argument` (units of the SI where it is not given).
    interpolation: "linear", "cubic" (a spline, not-a-knot) or "monotone" (no extremes but those of the points).
    outside: "hold" the end values, "extend" with the end slopes, or "refuse", so that a run ends there.

    Raises ValueError naming the table and what is wrong with it.
    """

    name: str
    unit: str
    x: Sequence[float] = ()
    y: Sequence[float] = ()
    interpolation: str = "linear"
    outside: str = "hold"
    file: str | Path | None = None
    argument: str | None = None
    meaning: str = ""

    def __post_init__(self) -> None:
        if self.file is not None:
            object.__setattr__(self, "file", _beside(Path(self.file), sys._getframe(2).f_globals.get("__file__")))
            self._read(Path(self.file))
        for name, known in (("interpolation", tuple(DEGREES)), ("outside", OUTSIDE)):
            if getattr(self, name) not in known:
                raise self._error(f"{name} is {getattr(self, name)!r}, expected {', '.join(known)}")
        for name in ("x", "y"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if len(self.x) != len(self.y) or not 2 <= len(self.x) <= MOST_POINTS:
            raise self._error(f"has {len(self.x)} x and {len(self.y)} y, expected as many of both, 2 to {MOST_POINTS}")
        for name, values in (("x", self.x), ("y", self.y)):
            for i, value in enumerate(values):
                if not isinstance(value, Real) or isinstance(value, bool) or not math.isfinite(value):
                    raise self._error(f"{name}[{i}] is {value!r}, expected a finite number")
        for i in range(1, len(self.x)):
            if self.x[i] <= self.x[i - 1]:
                raise self._error(f"x[{i}] = {self.x[i]!r} is not greater than x[{i - 1}] = {self.x[i - 1]!r}")

    def __call__(self, argument: Expr | float) -> Expr:
        """The value of the table at an expression."""
        return self.function(0)(argument)

    @property
    def description(self) -> str:
        """What it is, in words."""
        ends = f"{float(self.x[0])!r} to {float(self.x[-1])!r}{f' {self.argument}' if self.argument else ''}"
        points = f"{len(self.x)} points from {ends}, {self.interpolation}, {_OUTSIDE[self.outside]}"
        return f"{self.meaning}, {points}" if self.meaning else points

    @property
    def names(self) -> tuple[str, ...]:
        """All names that it has in a generated module: of its values, its derivatives and its data."""
        return tuple(f"{self.name}{ending}" for ending in (*ORDERS[: DEGREES[self.interpolation] + 1], DATA))

    def function(self, order: int) -> Any:
        """The SymPy function that stands for the derivative of this order."""
        return _function(self, order)

    @cached_property
    def pieces(self) -> Pieces:
        """The polynomials between the points, and those outside."""
        x, y = tuple(map(float, self.x)), tuple(map(float, self.y))
        return interpolated(x, y, self.interpolation, self.outside)

    def _read(self, path: Path) -> None:
        if self.x or self.y:
            raise self._error("has points and a file; give one of them")
        try:
            columns = read_columns(path)
            object.__setattr__(self, "x", columns.numbers(0, None, self.argument))
            object.__setattr__(self, "y", columns.numbers(1, None, self.unit))
        except OSError as error:
            raise self._error(f"{path}: {error.strerror or error}") from None
        except ValueError as error:
            raise self._error(str(error)) from None

    def _error(self, what: str) -> ValueError:
        return ValueError(f"table {self.name}: {what}")


_CLASS: Any = type(Value)


@cache
def _function(table: Table, order: int) -> Any:
    contents = {"table": table, "order": order, "nargs": 1, "__module__": __name__}
    return _CLASS(f"{table.name}{ORDERS[order]}", (Value,), contents)


def _beside(path: Path, program: str | None) -> Path:
    return path if path.is_absolute() or program is None else (Path(program).parent / path).resolve()
