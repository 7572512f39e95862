"""Tables as the functions of a generated module: an array of pieces, and value and derivatives found in it.

A piece is found by halving, without a branch, so that lanes of runs can look up side by side; of two arguments one in
each of them.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from qddot.codegen.program import Program
from qddot.model.interpolation import Pieces
from qddot.model.patches import Patches
from qddot.model.table import DATA, HELD, LINES, Table, ending, knots_of

_MEANINGS = ("Value at x", "First derivative at x", "Second derivative at x", "Third derivative at x")
_HELD = HELD.removeprefix("_")
_FORMS, _HOLDING = ("", HELD), ", in a piece of the sign that is held"
#: What functions call the arrays that they read, each bound once: to numba every mention of a global is one more copy.
_PIECES, _ORIGINS, _KNOTS = "pieces", "origins_", "knots_"
#: Columns of the arrays of knots: the sign of a piece, and where the next one is nearer than the one before.
_SIGN, _MIDDLE = 5, 6


class Argument(NamedTuple):
    """What functions call an argument, the distance from the origin of its piece, the number of that, and its mode."""

    name: str
    distance: str
    number: str
    mode: str


_ARGUMENTS = (Argument("x", "d", "i", "p"), Argument("y", "e", "j", "r"))

Row = tuple[str, str, str, float, float, str, str]


@dataclass(frozen=True)
class Array:
    """Numbers of a module; rows: the text of each. `comment` is what the module says of them."""

    name: str
    comment: str
    rows: tuple[str, ...]


@dataclass(frozen=True)
class LookupFunction:
    """A function of x, or of x and y, held in its pieces by p, or by p and r.

    search: the lines that find the piece and the distance from its origin. value: the polynomial in that distance.
    """

    name: str
    arguments: str
    docstring: str
    search: tuple[str, ...]
    value: str


@dataclass(frozen=True)
class Lookup:
    """A table as a module has it.

    rows: what the module says of it, one for each argument. arrays: the pieces; of one argument a power of two of them,
    origin and coefficients.
    """

    rows: tuple[Row, ...]
    comment: str
    arrays: tuple[Array, ...]
    functions: tuple[LookupFunction, ...]


def lookups(program: Program) -> list[Lookup]:
    """The tables of a program with the functions that its kernels call, before each what holds it in its pieces."""
    called = {name for kernel in program.kernels.values() for name in kernel.calls}
    found: list[Lookup] = []
    for table in program.equations.system.tables:
        own = _lookup(table, called)
        holds = any(each.name.endswith(HELD) for each in own.functions)
        found += [_knots(table, k, called) for k, located in enumerate(table.located) if located and holds]
        found.append(own)
    return found


def _lookup(table: Table, called: Iterable[str]) -> Lookup:
    words = table.name, table.unit, table.meaning
    arrays = (
        _of_two(table.name, table.pieces) if isinstance(table.pieces, Patches) else (_of_one(table.name, table.pieces),)
    )
    names = [
        (f"{table.name}{ending(orders)}{held}", orders, held) for orders in table.all_orders for held in ("", HELD)
    ]
    arguments = _ARGUMENTS[: table.count]
    functions = (
        LookupFunction(
            name=name,
            arguments=", ".join([a.name for a in arguments] + [a.mode for a in arguments] * bool(held)),
            docstring=f"{_meaning(orders)} of the table {table.name}{_HOLDING * bool(held)}.",
            search=tuple(_searches(table, held=bool(held))),
            value=_value(table, orders, _piece(table, 0, held=bool(held))),
        )
        for name, orders, held in names
        if name in called
    )
    return Lookup(
        rows=tuple((*words, *argument, table.outside) for argument in table.arguments),
        comment=f"{table.name} in {table.unit}: {table.description}",
        arrays=arrays,
        functions=tuple(functions),
    )


def _knots(table: Table, which: int, called: Iterable[str]) -> Lookup:
    """What changes its sign where the pieces of an argument meet, with the sign and the middle of each piece."""
    name, pieces, argument = knots_of(table.name, which, table.count), table.knots[which], _ARGUMENTS[which]
    refused = table.outside == "refuse"
    array = _of_one(name, pieces, [_held_by(pieces, i, refused=refused) for i in range(len(pieces.pieces))])
    functions = (
        LookupFunction(
            name=f"{name}{ending((order,))}",
            arguments=argument.name,
            docstring=f"{_meaning((order,))} of what changes its sign where pieces of the table {table.name} meet.",
            search=(f"{_PIECES} = {name}{DATA}", *_search(argument, _halvings(pieces.pieces), _PIECES, ", 0")),
            value=_polynomial(argument.distance, order, [f"{_PIECES}[{argument.number}_1, {k + 1}]" for k in range(4)]),
        )
        for order in range(pieces.degree + 1)
        if f"{name}{ending((order,))}" in called
    )
    comment = f"{name}: positive in every second piece of {table.name}, negative between"
    return Lookup(rows=(), comment=comment, arrays=(array,), functions=tuple(functions))


def _held_by(pieces: Pieces, i: int, *, refused: bool) -> tuple[float, float]:
    """Of a piece its sign, 0 where it is never left for another one, and where the one after it is nearer."""
    last = len(pieces.pieces) - 1
    if i in (0, last):
        return (0.0 if refused else 1.0 if i % 2 == 0 else -1.0), (-math.inf if i == 0 else math.inf)
    middle = 0.5 * (pieces.pieces[i][0] + pieces.pieces[i + 1][0])
    if refused and i in (1, last - 1):
        middle = -math.inf if i == 1 else math.inf
    return (1.0 if i % 2 == 0 else -1.0), middle


def _meaning(orders: Sequence[int]) -> str:
    if len(orders) == 1:
        return _MEANINGS[orders[0]]
    by = ", ".join(argument.name for argument, order in zip(_ARGUMENTS, orders, strict=True) for _ in range(order))
    return f"Derivative by {by}" if by else "Value at x and y"


def _of_one(name: str, pieces: Pieces, others: Sequence[Sequence[float]] = ()) -> Array:
    """Pieces of one argument, each with what else is to be known of it."""
    rows = [piece[: pieces.degree + 2] for piece in pieces.pieces]
    rows = [(*row, *other) for row, other in zip(rows, others, strict=True)] if others else rows
    nowhere = (math.inf, *(len(rows[0]) - 1) * (math.nan,))
    told = "of each piece the origin, and the coefficients of the powers of the distance from it"
    behind = ",\n# its sign, and where the next one is nearer than the one before" if others else ""
    padded = (*rows, *(2 ** _halvings(rows) - len(rows)) * (nowhere,))
    return Array(f"{name}{DATA}", f"{told}{behind}", tuple(map(_row, padded)))


def _of_two(table: str, pieces: Patches) -> tuple[Array, ...]:
    """Origins behind all pieces are no numbers: nothing is beyond them, and no row of the pieces is read there."""
    arrays = list[Array]()
    for argument, line, origins in zip(_ARGUMENTS, LINES, (pieces.x, pieces.y), strict=True):
        padded = (*origins, *(2 ** _halvings(origins) - len(origins)) * (math.nan,))
        arrays.append(Array(f"{table}{DATA}{line}", f"the origins in {argument.name}", tuple(map(_number, padded))))
    told = "of each piece the coefficients of the powers of the distances from them, those in y running faster"
    rows = tuple(_row(patch) for column in pieces.patches for patch in column)
    return (*arrays, Array(f"{table}{DATA}", told, rows))


def _halvings(pieces: Sequence[Any]) -> int:
    return math.ceil(math.log2(len(pieces)))


def _searches(table: Table, *, held: bool) -> Iterator[str]:
    """The lines that find a piece; held: in each argument that of the sign that its mode wants, or the nearest one."""
    pieces, name = table.pieces, f"{table.name}{DATA}"
    of_two = isinstance(pieces, Patches)
    lines = (pieces.x, pieces.y) if isinstance(pieces, Patches) else (pieces.pieces,)
    yield f"{_PIECES} = {name}"
    for k, line in enumerate(lines):
        origins, column, knots = _PIECES, ", 0", None
        if of_two:
            origins, column = f"{_ORIGINS}{_ARGUMENTS[k].name}", ""
            yield f"{origins} = {name}{LINES[k]}"
        if held and table.located[k]:
            knots = f"{_KNOTS}{_ARGUMENTS[k].name}"
            yield f"{knots} = {knots_of(table.name, k, table.count)}{DATA}"
        yield from _search(_ARGUMENTS[k], _halvings(line), origins, column, knots)
    if isinstance(pieces, Patches):
        i, j = (_piece(table, k, held=held) for k in (0, 1))
        yield f"row = {i} * {len(pieces.y)} + {j}"


def _piece(table: Table, which: int, *, held: bool) -> str:
    """What the number of the piece of an argument is called, once it is found."""
    return f"{_ARGUMENTS[which].number}_{_HELD if held and table.located[which] else 1}"


def _search(argument: Argument, halvings: int, origins: str, column: str, knots: str | None = None) -> Iterator[str]:
    """The piece i_1 that x is in, or j_1 of y, by halves: the last one whose origin is not beyond it."""
    x, number, last = argument.name, argument.number, ""
    for k in reversed(range(halvings)):
        name, step = f"{number}_{2**k}", f"{last} + {2**k}" if last else f"{2**k}"
        yield f"{name} = {step} if {x} >= {origins}[{step}{column}] else {last or 0}"
        last = name
    if knots is not None:
        other = f"{last} + 1 if {x} > {knots}[{last}, {_MIDDLE}] else {last} - 1"
        yield f"{number}_{_HELD} = ({other}) if {argument.mode} * {knots}[{last}, {_SIGN}] < 0.0 else {last}"
        last = f"{number}_{_HELD}"
    yield f"{argument.distance} = {x} - {origins}[{last}{column}]"


def _value(table: Table, orders: Sequence[int], piece: str) -> str:
    """Horner's form of the derivative of these orders: pieces[i, 1] + d * (pieces[i, 2] + d * pieces[i, 3])."""
    width = table.pieces.degree + 1
    if table.count == 1:
        return _polynomial("d", orders[0], [f"{_PIECES}[{piece}, {power + 1}]" for power in range(width)])
    by_x, by_y = orders
    rows = ([f"{_PIECES}[row, {power * width + k}]" for k in range(width)] for power in range(width))
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
    return f"{'-' * (value < 0)}np.{abs(value)}" if not math.isfinite(value) else repr(value)
