"""A quantity that is known by points alone: `area = Table(...)`, used as `area(s)` in any expression of a model, or
`torque(omega, throttle)` of two arguments."""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from pathlib import Path
from typing import Any

from sympy import Expr, Function, Integer

from qddot.model.interpolation import DEGREES, OUTSIDE, SMOOTHNESS, Pieces, alternating, interpolated
from qddot.model.patches import Patches, patched
from qddot.model.points import read_points, wrong_grid, wrong_points

#: What the derivatives of a table of one argument are called behind its name, by order.
_ENDINGS = ("", "_slope", "_curvature", "_third_derivative")
#: What its data are called behind its name; of two arguments what the lines are between its cells, too.
DATA, LINES = "_pieces", ("_x", "_y")
#: What has behind its name that holds a piece, and what changes its sign where pieces meet.
HELD, KNOTS = "_held", "_knots"
#: Knots of tables of so many lines are located; beyond that steps cross them.
_MOST_LOCATED = 100
_OUTSIDE = {"hold": "its ends held outside", "extend": "its ends extended", "refuse": "no number outside"}


class Value(Function):
    """The value of a table, or a derivative of it; each table has classes of its own. orders: by each argument."""

    table: "Table"
    orders: tuple[int, ...]

    def fdiff(self, argindex: int = 1) -> Expr:
        """The derivative by an argument, counted from 1; zero beyond the degree of the table's polynomials."""
        higher = tuple(order + (k == argindex) for k, order in enumerate(self.orders, 1))
        return self.table.function(higher)(*self.args) if max(higher) <= self.table.pieces.degree else Integer(0)

    @property
    def smoothness(self) -> int:
        """How many of its derivatives do not jump; -1 where it jumps itself."""
        return self.table.smoothness - max(self.orders)

    @classmethod
    def at(cls, *arguments: Any) -> Any:
        """Its number at arguments of any kind that Python's signs know."""
        return cls.table.pieces.at(*arguments, *cls.orders)


def knots_of(table: str, argument: int, count: int) -> str:
    """What is called the function that changes its sign at the lines of a table's argument, counted from 0."""
    return f"{table}{KNOTS}{LINES[argument] if count > 1 else ''}"


def ending(orders: Sequence[int]) -> str:
    """What a derivative of a table, of these orders by its arguments, is called behind the table's name."""
    if len(orders) == 1:
        return _ENDINGS[orders[0]]
    return f"_by_{'x' * orders[0]}{'y' * orders[1]}" if any(orders) else ""


@dataclass(frozen=True)
class Table:
    """A function through points; call it with an expression, or with two.

    x, y: the points of one argument, x rising. Of two arguments with z: the lines of a grid, both rising, and the
    values, z[i][k] at x[i] and y[k].
    file: a CSV file in their place, beside the file of the program that makes the table: its first two columns are x
    and y. Its headings may name units (`stroke [mm]`), from which values become `unit` and arguments become `argument`
    (units of the SI where it is not given). Where `argument` is a pair, of the units of x and y, the first three
    columns are x, y and z, a row for each crossing of the grid, in any order.
    interpolation: "linear", "cubic" (a spline, not-a-knot) or, of one argument, "monotone" (no extremes but those of
    the points). Of two arguments it is that in each of them, the other being fixed.
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
    argument: str | Sequence[str] | None = None
    meaning: str = ""
    z: Sequence[Sequence[float]] | None = None

    def __post_init__(self) -> None:
        if self.argument is not None and not isinstance(self.argument, str):
            object.__setattr__(self, "argument", tuple(self.argument))
        if self.file is not None:
            object.__setattr__(self, "file", _beside(Path(self.file), sys._getframe(2).f_globals.get("__file__")))
            self._read(Path(self.file))
        for name, known in (("interpolation", tuple(DEGREES)), ("outside", OUTSIDE)):
            if getattr(self, name) not in known:
                raise self._error(f"{name} is {getattr(self, name)!r}, expected {', '.join(known)}")
        for name in ("x", "y"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if self.z is not None:
            rows = (tuple(row) if isinstance(row, Iterable) else row for row in self.z)
            object.__setattr__(self, "z", tuple(rows))
        wrong = wrong_points(self.x, self.y, self.units) if self.z is None else wrong_grid(self)
        if wrong is not None:
            raise self._error(wrong)

    def __call__(self, *arguments: Expr | float) -> Expr:
        """The value of the table at an expression, or at one for x and one for y."""
        value: Expr = self.function((0,) * self.count)(*arguments)
        return value

    @property
    def count(self) -> int:
        """How many arguments it has."""
        return 1 if self.z is None else 2

    @property
    def arguments(self) -> tuple[tuple[float, float, str], ...]:
        """Of each argument its first and last point, and its unit."""
        units = tuple(unit or "" for unit in self.units) * self.count
        lines = (self.x, self.y)[: self.count]
        return tuple((float(line[0]), float(line[-1]), unit) for line, unit in zip(lines, units, strict=False))

    @property
    def units(self) -> tuple[str | None, ...]:
        """The units that were given for arguments: one, or a pair."""
        return (self.argument,) if isinstance(self.argument, str | None) else tuple(self.argument)

    @property
    def description(self) -> str:
        """What it is, in words."""
        ends = " and ".join(f"{first!r} to {last!r}{f' {unit}' * bool(unit)}" for first, last, unit in self.arguments)
        count = f"{len(self.x)}" if self.z is None else f"{len(self.x)} x {len(self.y)}"
        points = f"{count} points from {ends}, {self.interpolation}, {_OUTSIDE[self.outside]}"
        return f"{self.meaning}, {points}" if self.meaning else points

    @property
    def smoothness(self) -> int:
        """How many of its derivatives do not jump, at its points and at its ends."""
        within, beyond = SMOOTHNESS[self.interpolation], {"hold": 0, "extend": 1}
        return min(within, beyond.get(self.outside, within))

    @property
    def names(self) -> tuple[str, ...]:
        """All names that it has in a generated module: of its values, its derivatives and its data."""
        data = (DATA, *(f"{DATA}{line}" for line in LINES if self.z is not None))
        values = tuple(map(ending, self.all_orders))
        knots = [knots_of("", k, self.count) for k, located in enumerate(self.located) if located]
        held = [f"{each}{HELD}" for each in values if knots]
        found = (*_ENDINGS, DATA)
        return tuple(f"{self.name}{each}" for each in (*values, *data, *held, *(k + e for k in knots for e in found)))

    @property
    def located(self) -> tuple[bool, ...]:
        """Of each argument, whether methods that locate switches end their steps where pieces meet."""
        lines = (self.x, self.y)[: self.count]
        inner = 2 if self.outside == "refuse" else 0
        return tuple(inner < len(line) <= _MOST_LOCATED for line in lines)

    @cached_property
    def knots(self) -> tuple[Pieces, ...]:
        """Of each argument what changes its sign where pieces meet."""
        lines = (self.x, self.y)[: self.count]
        return tuple(alternating(tuple(map(float, line)), refused=self.outside == "refuse") for line in lines)

    @property
    def all_orders(self) -> tuple[tuple[int, ...], ...]:
        """The orders, by each argument, of itself and of all its derivatives that do not vanish."""
        return tuple(product(range(DEGREES[self.interpolation] + 1), repeat=self.count))

    def function(self, orders: tuple[int, ...]) -> Any:
        """The SymPy function that stands for the derivative of these orders by its arguments."""
        return _function(self, orders)

    @cached_property
    def pieces(self) -> Pieces | Patches:
        """The polynomials between the points, and those outside."""
        x, y = tuple(map(float, self.x)), tuple(map(float, self.y))
        if self.z is None:
            return interpolated(x, y, self.interpolation, self.outside)
        return patched(x, y, [tuple(map(float, row)) for row in self.z], self.interpolation, self.outside)

    def _read(self, path: Path) -> None:
        if len(self.x) or len(self.y) or self.z is not None:
            raise self._error("has points and a file; give one of them")
        try:
            points = read_points(path, self.units, self.unit)
        except OSError as error:
            raise self._error(f"{path}: {error.strerror or error}") from None
        except ValueError as error:
            raise self._error(str(error)) from None
        for name, value in zip("xyz", points, strict=False):
            object.__setattr__(self, name, value)

    def _error(self, what: str) -> ValueError:
        return ValueError(f"table {self.name}: {what}")


_CLASS: Any = type(Value)


@cache
def _function(table: Table, orders: tuple[int, ...]) -> Any:
    contents = {"table": table, "orders": orders, "nargs": table.count, "__module__": __name__}
    return _CLASS(f"{table.name}{ending(orders)}", (Value,), contents)


def _beside(path: Path, program: str | None) -> Path:
    return path if path.is_absolute() or program is None else (Path(program).parent / path).resolve()
