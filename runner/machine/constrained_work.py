"""What `constrained` works with: arrays on the stack of a generated kernel, and the parts of its workspace."""

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, VIEW, first_item, floats, matrix, uncounted


def work_size(n: int, m: int) -> int:
    """Numbers of the workspace for n coordinates and m constraints, in the order of the functions below."""
    return n * (n + m) + m * m + 3 * n + 6 * m + 1


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


@compiled(**VIEW)
def _part(work, place, length):
    return floats(first_item(work) + 8 * place, length)


@compiled(**VIEW)
def lower_of(work, n, m):
    """L (n, n), with the reciprocals of its diagonal."""
    return matrix(first_item(work), n, n)


@compiled(**VIEW)
def columns_of(work, n, m):
    """W and then Q, by columns: (m, n)."""
    return matrix(first_item(work) + 8 * n * n, m, n)


@compiled(**VIEW)
def triangle_of(work, n, m):
    """R (m, m)."""
    return matrix(first_item(work) + 8 * n * (n + m), m, m)


@compiled(**VIEW)
def scale_of(work, n, m):
    """The diagonal of D, (n,)."""
    return _part(work, n * (n + m) + m * m, n)


@compiled(**VIEW)
def vector_of(work, n, m):
    """Scratch, (n + m,)."""
    return _part(work, n * (n + m) + m * m + n, n + m)


@compiled(**VIEW)
def alpha_of(work, n, m):
    """Alpha, (m,)."""
    return _part(work, n * (n + m) + m * m + 2 * n + m, m)


@compiled(**VIEW)
def norms_of(work, n, m):
    """Lengths that the columns of W had, (m,)."""
    return _part(work, n * (n + m) + m * m + 2 * n + 2 * m, m)


@compiled(**VIEW)
def drift_of(work, n, m):
    """Scratch, (m,)."""
    return _part(work, n * (n + m) + m * m + 2 * n + 3 * m, m)


@compiled(**VIEW)
def order_of(work, n, m):
    """The constraints in the order of their pivots, (m,); those left out stand last."""
    return _part(work, n * (n + m) + m * m + 2 * n + 4 * m, m)


@compiled(**LEAN)
def rank_of(work, n, m):
    """How many constraints are independent."""
    return int(_part(work, n * (n + m) + m * m + 2 * n + 5 * m, 1)[0])


@compiled(**LEAN)
def set_rank(work, n, m, rank):
    """Keep how many constraints are independent."""
    _part(work, n * (n + m) + m * m + 2 * n + 5 * m, 1)[0] = rank


@compiled(**VIEW)
def scratch_of(work, n, m):
    """Where `derivatives` gathers a column, (n + m,)."""
    return _part(work, n * (n + m) + m * m + 2 * n + 5 * m + 1, n + m)
