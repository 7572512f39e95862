"""Tables as the functions of a generated module: an array of pieces, and value and derivatives found in it.

A piece is found by halving, without a branch, so that lanes of runs can look up side by side; of two arguments one in
each of them.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from qddot.codegen.lower import Program
from qddot.model.interpolation import Pieces
from qddot.model.patches import Patches
from qddot.model.table import DATA, LINES, Table, ending

_MEANINGS = ("Value at x", "First derivative at x", "Second derivative at x", "Third derivative at x")
#: Of each argument: its name, that of the distance from the origin of its piece, and of the number of that.
_ARGUMENTS = (("x", "d", "i"), ("y", "e", "j"))

Row = tuple[str, str, str, float, float, str, str]


@dataclass(frozen=True)
class Array:
    """Numbers of a module; rows: the text of each. `comment` is what the module says of them."""

    name: str
    comment: str
    rows: tuple[str, ...]


@dataclass(frozen=True)
class LookupFunction:
    """A function of x, or of x and y; value: the polynomial in the distances from its piece's origin."""

    name: str
    arguments: str
    docstring: str
    value: str


@dataclass(frozen=True)
class Lookup:
    """A table as a module has it.

    rows: what the module says of it, one for each argument. arrays: the pieces; of one argument a power of two of them,
    origin and coefficients. search: the lines that find the piece and the distance from its origin.
    """

    rows: tuple[Row, ...]
    comment: str
    arrays: tuple[Array, ...]
    search: tuple[str, ...]
    functions: tuple[LookupFunction, ...]


def lookups(program: Program) -> list[Lookup]:
    """The tables of a program, each with the functions that its kernels call."""
    called = {name for kernel in program.kernels.values() for name in kernel.calls}
    return [_lookup(table, called) for table in program.equations.system.tables]


def _lookup(table: Table, called: Iterable[str]) -> Lookup:
    words = table.name, table.unit, table.meaning
    found = table.pieces
    arrays, search = _of_two(table.name, found) if isinstance(found, Patches) else _of_one(table.name, found)
    names = {f"{table.name}{ending(orders)}": orders for orders in table.all_orders}
    functions = (
        LookupFunction(
            name=name,
            arguments=", ".join(argument for argument, _, _ in _ARGUMENTS[: table.count]),
            docstring=f"{_meaning(orders)} of the table {table.name}.",
            value=_value(table, orders),
        )
        for name, orders in names.items()
        if name in called
    )
    return Lookup(
        rows=tuple((*words, *argument, table.outside) for argument in table.arguments),
        comment=f"{table.name} in {table.unit}: {table.description}",
        arrays=arrays,
        search=search,
        functions=tuple(functions),
    )


def _meaning(orders: Sequence[int]) -> str:
    if len(orders) == 1:
        return _MEANINGS[orders[0]]
    by = ", ".join(name for (name, _, _), order in zip(_ARGUMENTS, orders, strict=True) for _ in range(order))
    return f"Derivative by {by}" if by else "Value at x and y"


def _of_one(table: str, pieces: Pieces) -> tuple[tuple[Array, ...], tuple[str, ...]]:
    name, halvings = f"{table}{DATA}", _halvings(pieces.pieces)
    nowhere = (math.inf, *4 * (math.nan,))
    rows = (*pieces.pieces, *(2**halvings - len(pieces.pieces)) * (nowhere,))
    told = "of each piece the origin, and the coefficients of the powers of the distance from it"
    array = Array(name, told, tuple(_row(row[: pieces.degree + 2]) for row in rows))
    return (array,), tuple(_search(0, halvings, name, ", 0"))


def _of_two(table: str, pieces: Patches) -> tuple[tuple[Array, ...], tuple[str, ...]]:
    """Origins behind all pieces are no numbers: nothing is beyond them, and no row of the pieces is read there."""
    name, arrays, search = f"{table}{DATA}", list[Array](), list[str]()
    for k, origins in enumerate((pieces.x, pieces.y)):
        line, halvings = f"{name}{LINES[k]}", _halvings(origins)
        padded = (*origins, *(2**halvings - len(origins)) * (math.nan,))
        arrays.append(Array(line, f"the origins in {_ARGUMENTS[k][0]}", tuple(map(_number, padded))))
        search += _search(k, halvings, line, "")
    search.append(f"row = i_1 * {len(pieces.y)} + j_1")
    told = "of each piece the coefficients of the powers of the distances from them, those in y running faster"
    rows = tuple(_row(patch) for column in pieces.patches for patch in column)
    return (*arrays, Array(name, told, rows)), tuple(search)


def _halvings(pieces: Sequence[Any]) -> int:
    return math.ceil(math.log2(len(pieces)))


def _search(which: int, halvings: int, origins: str, column: str) -> Iterator[str]:
    """The piece i_1 that x is in, or j_1 of y, by halves: the last one whose origin is not beyond it."""
    (argument, distance, number), last = _ARGUMENTS[which], ""
    for k in reversed(range(halvings)):
        name, step = f"{number}_{2**k}", f"{last} + {2**k}" if last else f"{2**k}"
        yield f"{name} = {step} if {argument} >= {origins}[{step}{column}] else {last or 0}"
        last = name
    yield f"{distance} = {argument} - {origins}[{last}{column}]"


def _value(table: Table, orders: Sequence[int]) -> str:
    """Horner's form of the derivative of these orders: a[i, 1] + d * (a[i, 2] + d * a[i, 3])."""
    name, width = f"{table.name}{DATA}", table.pieces.degree + 1
    if table.count == 1:
        return _polynomial("d", orders[0], [f"{name}[i_1, {power + 1}]" for power in range(width)])
    by_x, by_y = orders
    rows = ([f"{name}[row, {power * width + k}]" for k in range(width)] for power in range(width))
    parts = (_polynomial("e", by_y, row) for row in rows)
    return _polynomial("d", by_x, [f"({part})" if "+" in part else part for part in parts])


def _polynomial(distance: str, order: int, coefficients: Sequence[str]) -> str:
    """That of these coefficients, differentiated; what is left alone stays tied to the distance: NaN where that is."""
    text = ""
    for power in range(len(coefficients) - 1, order - 1, -1):
        factor = math.perm(power, order)
        coefficient = f"{f'{factor}.0 * ' if factor > 1 else ''}{coefficients[power]}"
        text = f"{coefficient} + {distance} * ({text})" if text else coefficient
    return text if len(coefficients) - 1 > order else f"{text} + 0.0 * {distance}"


def _row(values: Sequence[float]) -> str:
    return f"({', '.join(map(_number, values))})"


def _number(value: float) -> str:
    return f"np.{value}" if not math.isfinite(value) else repr(value)
