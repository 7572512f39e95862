"""What `constrained` works with: arrays on the stack of a generated kernel, and the parts of its workspace."""

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.fours import FOUR
from qddot.runner.machine.memory import INLINE, LEAN, VIEW, first_item, floats, matrix, uncounted


def work_size(n: int, m: int) -> int:
    """Numbers of the workspace for n coordinates and m constraints, in the order of the functions below."""
    p = (n + FOUR - 1) // FOUR * FOUR
    return (n + 2 * m + 2) * p + m * m + 3 * m + 1 + FOUR * (n + 2 * m)


#: The same in compiled code.
compiled_work_size = compiled(**INLINE)(work_size)


@intrinsic(prefer_literal=True)
def equations(typing_context: Any, n: Any, m: Any) -> Any:
    """Arrays of zeros on the stack: M (n, n), G (m, n), [f, gamma] (n + m,), residuals (m,), q (n,), a workspace.

    Of M what stands on and below the diagonal counts. residuals: of constraints on positions; 0 for others.
    """
    rows, columns = n.literal_value, m.literal_value
    shapes = (rows, rows), (columns, rows), (rows + columns,), (columns,), (rows,), (work_size(rows, columns),)
    return tuple_of(shapes, n, m)


@intrinsic(prefer_literal=True)
def outcome(typing_context: Any, n: Any, m: Any) -> Any:
    """Arrays on the stack for what `report` tells: multipliers (m,), reactions (n,)."""
    return tuple_of(((m.literal_value,), (n.literal_value,)), n, m)


@intrinsic(prefer_literal=True)
def blank(typing_context: Any, rows: Any, columns: Any) -> Any:
    """A matrix of zeros on the stack."""
    shape = rows.literal_value, columns.literal_value

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _on_the_stack(context, builder, (shape,))[0]

    return _array(shape)(rows, columns), emit


def tuple_of(shapes: tuple[tuple[int, ...], ...], *arguments: Any) -> Any:
    """Type and code, as `intrinsic` wants them, of arrays of zeros on the stack."""
    kinds = types.Tuple([_array(shape) for shape in shapes])

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return context.make_tuple(builder, kinds, _on_the_stack(context, builder, shapes))

    return kinds(*arguments), emit


def _array(shape: tuple[int, ...]) -> Any:
    return types.Array(types.float64, len(shape), "C")


def _on_the_stack(context: Any, builder: Any, shapes: tuple[tuple[int, ...], ...]) -> list[Any]:
    """Arrays of these shapes in one piece of the stack, cleared where this stands."""
    word, counts = ir.IntType(64), [math.prod(shape) for shape in shapes]
    with builder.goto_entry_block():
        piece = builder.alloca(ir.DoubleType(), size=word(sum(counts)))
    cgutils.memset(builder, piece, word(8 * sum(counts)), 0)
    made, where = [], builder.ptrtoint(piece, word)
    for shape, count in zip(shapes, counts, strict=True):
        made.append(uncounted(_array(shape), context, builder, where, [word(length) for length in shape]))
        where = builder.add(where, word(8 * count))
    return made


@compiled(**LEAN)
def fours(n):
    """How many fours a row of n numbers has."""
    return (n + FOUR - 1) // FOUR


@compiled(**LEAN)
def _row(work, n, place):
    """The address of a row (n,)."""
    return first_item(work) + 8 * FOUR * fours(n) * place


@compiled(**LEAN)
def lower_row(work, n, m, k):
    """The address of column k of L (n,): of LDL' with a diagonal of ones, which is not in it; zeros above."""
    return _row(work, n, k)


@compiled(**LEAN)
def gradient_row(work, n, m, j):
    """That of row j of G (n,)."""
    return _row(work, n, n + j)


@compiled(**LEAN)
def column_row(work, n, m, j):
    """That of column j of W (n,), which becomes one of Q."""
    return _row(work, n, n + m + j)


@compiled(**LEAN)
def scale_row(work, n, m):
    """That of the diagonal of D, (n,)."""
    return _row(work, n, n + 2 * m)


@compiled(**LEAN)
def pivot_row(work, n, m):
    """That of the reciprocal square roots of the pivots of L, (n,)."""
    return _row(work, n, n + 2 * m + 1)


@compiled(**LEAN)
def _behind_rows(work, n, m):
    return _row(work, n, n + 2 * m + 2)


@compiled(**VIEW)
def triangle_of(work, n, m):
    """R (m, m), row k that of the k-th pivot, columns as the constraints stand; reciprocals where it has its pivots."""
    return matrix(_behind_rows(work, n, m), m, m)


@compiled(**VIEW)
def alpha_of(work, n, m):
    """Alpha, (m,)."""
    return floats(_behind_rows(work, n, m) + 8 * m * m, m)


@compiled(**VIEW)
def lengths_of(work, n, m):
    """One over the lengths that the columns of W had, (m,); 0 of those that are left out."""
    return floats(_behind_rows(work, n, m) + 8 * m * (m + 1), m)


@compiled(**VIEW)
def order_of(work, n, m):
    """The constraints in the order of their pivots, (m,); those left out stand last."""
    return floats(_behind_rows(work, n, m) + 8 * m * (m + 2), m)


@compiled(**VIEW)
def _rank(work, n, m):
    return floats(_behind_rows(work, n, m) + 8 * m * (m + 3), 1)


@compiled(**LEAN)
def rank_of(work, n, m):
    """How many constraints are independent."""
    return int(_rank(work, n, m)[0])


@compiled(**LEAN)
def set_rank(work, n, m, rank):
    """Keep how many constraints are independent."""
    _rank(work, n, m)[0] = rank


@compiled(**LEAN)
def side_row(work, n, m, i):
    """The address of the four right sides of row i, and behind those (n + m) of scratch for m more."""
    return _behind_rows(work, n, m) + 8 * (m * (m + 3) + 1 + FOUR * i)
