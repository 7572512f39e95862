"""Tables as the functions of a generated module: an array of pieces, and value and derivatives found in it.

A piece is found by halving, without a branch, so that lanes of runs can look up side by side.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from qddot.codegen.lower import Program
from qddot.model.table import DATA, ORDERS, Table

_MEANINGS = ("Value at x", "First derivative at x", "Second derivative at x", "Third derivative at x")


@dataclass(frozen=True)
class LookupFunction:
    """A function of x; value: the polynomial in d, the distance from its piece's origin."""

    name: str
    docstring: str
    value: str


@dataclass(frozen=True)
class Lookup:
    """A table as a module has it.

    row: what the module says of it. rows: of the array `data`, a power of two of them: origin and coefficients of a
    piece. search: the lines that find the piece of x and the distance from its origin.
    """

    row: tuple[str, str, str, float, float, str, str]
    data: str
    comment: str
    rows: tuple[tuple[str, ...], ...]
    search: tuple[str, ...]
    functions: tuple[LookupFunction, ...]


def lookups(program: Program) -> list[Lookup]:
    """The tables of a program, each with the functions that its kernels call."""
    called = {name for kernel in program.kernels.values() for name in kernel.calls}
    return [_lookup(table, called) for table in program.equations.system.tables]


def _lookup(table: Table, called: Iterable[str]) -> Lookup:
    words = table.name, table.unit, table.meaning
    pieces, degree = table.pieces.pieces, table.pieces.degree
    halvings = math.ceil(math.log2(len(pieces)))
    nowhere = (math.inf, *4 * (math.nan,))
    rows = (*pieces, *(2**halvings - len(pieces)) * (nowhere,))
    names = {f"{table.name}{ending}": order for order, ending in enumerate(ORDERS[: degree + 1])}
    functions = (
        LookupFunction(name, f"{_MEANINGS[order]} of the table {table.name}.", _polynomial(table, order))
        for name, order in names.items()
        if name in called
    )
    return Lookup(
        row=(*words, float(table.x[0]), float(table.x[-1]), table.argument or "", table.outside),
        data=f"{table.name}{DATA}",
        comment=f"{table.name} in {table.unit}: {table.description}",
        rows=tuple(tuple(map(_number, row[: degree + 2])) for row in rows),
        search=tuple(_search(f"{table.name}{DATA}", halvings)),
        functions=tuple(functions),
    )


def _search(data: str, halvings: int) -> Iterator[str]:
    """The piece i_1 that x is in, by halves; the last row whose origin is not beyond x."""
    last = ""
    for k in reversed(range(halvings)):
        name, step = f"i_{2**k}", f"{last} + {2**k}" if last else f"{2**k}"
        yield f"{name} = {step} if x >= {data}[{step}, 0] else {last or 0}"
        last = name
    yield f"d = x - {data}[{last}, 0]"


def _polynomial(table: Table, order: int) -> str:
    """Horner's form of the derivative of this order: a[i, 1] + d * (a[i, 2] + d * a[i, 3])."""
    text = ""
    for power in range(table.pieces.degree, order - 1, -1):
        factor = math.perm(power, order)
        coefficient = f"{f'{factor}.0 * ' if factor > 1 else ''}{table.name}{DATA}[i_1, {power + 1}]"
        text = f"{coefficient} + d * ({text})" if text else coefficient
    return text if table.pieces.degree > order else f"{text} + 0.0 * d"


def _number(value: float) -> str:
    return f"np.{value}" if not math.isfinite(value) else repr(value)
