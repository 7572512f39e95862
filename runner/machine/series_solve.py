"""M_0 a_k = right_k: the inverse of M_0 once a series, by Gauss and Jordan; M_0 is symmetric and positive definite.

Columns of the inverse are vectors, so a solution is n multiplications that do not wait for each other; a solution by
two triangles waits 2 n times for the last one. A residual is as small as the condition of M_0 lets it be either way.
Where constraints hold, the inverse is that of M_0 with G_0 beside it, see `constrained_inverse`.
"""

from collections.abc import Sequence
from typing import Any, Protocol

from llvmlite import ir

from qddot.runner.machine.constrained_inverse import INVERSE, SIGNATURE, room_for
from qddot.runner.machine.constrained_pivots import SOUND
from qddot.runner.machine.pointers import call_named
from qddot.runner.machine.recurrences import Factor, Recurrences
from qddot.runner.machine.series_memory import Memory
from qddot.runner.machine.vector_code import INTEGER, SCALAR, VectorCode

#: Unknowns up to which all pivots are written out under constraints.
MOST_AT_ONCE = 32
#: Row i of the inverse is what the vectors of its blocks hold: [column][block].
Matrix = list[list[Any]]


class Emitter(Protocol):
    """What is asked of the emitter of a series; see `series.Emitter`."""

    code: VectorCode
    memory: Memory
    table: Recurrences
    unknowns: tuple[str, ...]

    def gather(self, names: Sequence[str | None]) -> Any:
        """The nodes' coefficients side by side."""

    def scaled(self, values: Any, factors: Sequence[Factor | None], total: Any = None) -> Any:
        """Factors times values, plus a total."""


def eliminate(emitter: Emitter) -> Matrix:
    """The inverse of M_0, from the values of order 0."""
    code, n = emitter.code, len(emitter.unknowns)
    if emitter.table.multipliers:
        return _held(emitter)
    rows = [_column(emitter, name) for name in emitter.unknowns]
    if code.width == 1:
        return _swept(emitter, [[rows[k][i] for k in range(i + 1)] for i in range(n)])
    for j in range(n):
        _pivot(emitter, rows, j)
    return rows


def _pivot(emitter: Emitter, rows: Matrix, j: int) -> None:
    """The j-th step of Gauss and Jordan's elimination."""
    code, one = emitter.code, emitter.code.splat(1.0)
    block, place = divmod(j, code.width)
    pivot = code.divide(one, _broadcast(emitter, rows[j][block], place))
    kept = [_replaced(emitter, value, one, place) if b == block else value for b, value in enumerate(rows[j])]
    rows[j] = [code.multiply(value, pivot) for value in kept]
    for i in range(len(rows)):
        if i != j:
            factor = code.builder.fneg(_broadcast(emitter, rows[i][block], place))
            rest = [
                _replaced(emitter, value, code.zero, place) if b == block else value for b, value in enumerate(rows[i])
            ]
            rows[i] = [code.multiply_add(factor, x, y) for x, y in zip(rows[j], rest, strict=True)]


def _held(emitter: Emitter) -> Matrix:
    """The same where there are constraints, of M with G beside it.

    Pivots of accelerations come first and are positive, and those of constraints negative. Where one nearly vanishes,
    of M alone or of constraints that depend on each other, `constrained_inverse` takes care.
    """
    code, unknowns = emitter.code, emitter.unknowns
    n = len(unknowns) - len(emitter.table.multipliers)
    given = [_column(emitter, name) for name in unknowns]
    if len(unknowns) > MOST_AT_ONCE:
        return _with_care(emitter, given[:n])
    rows, sound = [list(row) for row in given], ir.Constant(ir.IntType(1), 1)
    for first, last, order in ((0, n, ">"), (n, len(unknowns), "<")):
        whole = [_diagonal(emitter, rows, j) for j in range(len(unknowns))]
        for j in range(first, last):
            least = code.builder.fmul(SCALAR(SOUND), whole[j])
            better = code.builder.fcmp_ordered(order, _diagonal(emitter, rows, j), least)
            sound = code.builder.and_(sound, better)
            _pivot(emitter, rows, j)
    return code.either(sound, rows, lambda: _with_care(emitter, given[:n]))


def _diagonal(emitter: Emitter, rows: Matrix, j: int) -> Any:
    """The j-th number of the diagonal."""
    block, place = divmod(j, emitter.code.width)
    return emitter.code.builder.extract_element(rows[j][block], ir.IntType(32)(place))


def _with_care(emitter: Emitter, columns: Matrix) -> Matrix:
    """The inverse as `constrained_inverse` finds it, in memory, from the columns of M, those of G below them."""
    code, memory, unknowns = emitter.code, emitter.memory, emitter.unknowns
    n, m, length = len(columns), len(unknowns) - len(columns), len(columns[0]) * code.width
    start = memory.take(length * (n + m) + room_for(n, m))
    for i, column in enumerate(columns):
        for block, value in enumerate(column):
            code.store(value, start + i * length + block * code.width)
    off = [emitter.table.nodes[name].arguments[1] for name in unknowns[n:]]
    for first in range(0, m, code.width):
        code.store(emitter.gather(off[first : first + code.width]), start + n * length + first)
    places = (start, memory.states, start + length * (n + m))
    where, q, work = (code.builder.ptrtoint(code.address(place), INTEGER) for place in places)
    call_named(code.builder, INVERSE, SIGNATURE, [where, INTEGER(length), INTEGER(n), INTEGER(m), q, work])
    return [[code.load(start + i * length + b * code.width) for b in range(length // code.width)] for i in range(n + m)]


def _swept(emitter: Emitter, lower: list[list[Any]]) -> Matrix:
    """The inverse, from the lower triangle, which stays one: half the work where no vector holds a column.

    J. H. Goodnight, A tutorial on the SWEEP operator, The American Statistician 33 (1979) 149-158.
    """
    code, n = emitter.code, len(lower)
    for j in range(n):
        pivot = code.divide(code.splat(1.0), lower[j][j])
        column = [lower[i][j] if i > j else lower[j][i] for i in range(n)]
        scaled = [code.multiply(value, pivot) for value in column]
        for i in range(n):
            for k in range(i + 1):
                if j in (i, k):
                    lower[i][k] = scaled[i if k == j else k]
                else:
                    lower[i][k] = code.subtract(lower[i][k], code.multiply(scaled[i], column[k]))
        lower[j][j] = code.builder.fneg(pivot)
    signed = [[code.builder.fneg(value) for value in row] for row in lower]
    return [[signed[max(i, k)][min(i, k)] for k in range(n)] for i in range(n)]


def solution(emitter: Emitter, inverse: Matrix) -> list[Any]:
    """The unknowns of an order in blocks, from the right-hand sides as they stand."""
    code, table = emitter.code, emitter.table
    rights = [table.nodes[name].arguments[0] for name in emitter.unknowns]
    starts = range(0, len(rights), code.width)
    blocks = [emitter.gather(rights[start : start + code.width]) for start in starts]
    sums: list[list[Any]] = [[None, None] for _ in blocks]
    for j, column in enumerate(inverse):
        block, place = divmod(j, code.width)
        factor = _broadcast(emitter, blocks[block], place)
        for total, value in zip(sums, column, strict=True):
            total[j % 2] = code.multiply_add(factor, value, total[j % 2])
    return [code.sum([value for value in total if value is not None]) for total in sums]


def _column(emitter: Emitter, unknown: str) -> list[Any]:
    """A column of M_0 in blocks of rows."""
    found: list[tuple[Factor, str] | None] = []
    for name in emitter.unknowns:
        entries = emitter.table.nodes[name].entries
        found.append(next(((factor, value) for other, factor, value in entries if other == unknown), None))
    blocks = []
    for start in range(0, len(found), emitter.code.width):
        part = found[start : start + emitter.code.width]
        values = emitter.gather([entry[1] if entry else None for entry in part])
        blocks.append(emitter.scaled(values, [entry[0] if entry else None for entry in part]))
    return blocks


def _broadcast(emitter: Emitter, value: Any, place: int) -> Any:
    return emitter.code.shuffle(value, value, [place] * emitter.code.width)


def _replaced(emitter: Emitter, value: Any, other: Any, place: int) -> Any:
    """A vector with one item from another."""
    width = emitter.code.width
    return emitter.code.shuffle(value, other, [width + i if i == place else i for i in range(width)])
