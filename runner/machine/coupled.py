"""Accelerations of many coupled coordinates in compiled code: M a = f by M = U' D^-1 U, the diagonal of U being D.

It is LDL' row by row (Golub & Van Loan, Matrix Computations, section 4.1); M is positive definite for physics, so there
is no pivoting.

Generated kernels of many coordinates fill the arrays of `coupled`, call `decoupled`, and read what comes of them. The
rows of all stand in the order of elimination, and a table of the model tells what each of them changes: a band, or an
arrow from its shafts to its tip, costs what its entries cost. Where a row changes all behind it, columns are taken side
by side, so that they become vectors. Nothing is allocated: all arrays stand on the stack.
"""

from collections.abc import Iterator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from qddot.runner.abi import MATRIX, VECTOR
from qddot.runner.machine.constrained_work import blank, tuple_of
from qddot.runner.machine.memory import uncounted
from qddot.runner.machine.pointers import by_name

__all__ = ["blank", "coupled", "decoupled", "slopes"]

#: A table of integers in compiled code.
TABLE = types.Array(types.int64, 1, "C")


def table_of(factors: str) -> list[int]:
    """A module's FACTORS as compiled code reads it: n + 1 places in it, each where the columns of a row begin, and the
    first behind those of the last; the columns; of each row the coordinate whose it is."""
    coordinates: list[int] = []
    columns: list[int] = []
    begins = [0]
    for row in factors.split():
        coordinate, later = row.split(":")
        coordinates.append(int(coordinate))
        columns += _numbers(later)
        begins.append(len(columns))
    return [*(len(begins) + begin for begin in begins), *columns, *coordinates]


def _numbers(ranges: str) -> Iterator[int]:
    for each in filter(None, ranges.split(",")):
        first, _, last = each.partition("-")
        yield from range(int(first), int(last or first) + 1)


@intrinsic(prefer_literal=True)
def coupled(typing_context: Any, n: Any, factors: Any) -> Any:
    """Arrays of zeros on the stack, M (n, n), of which what stands on and above the diagonal counts, and f (n,); and
    FACTORS as a table."""
    rows = n.literal_value
    arrays, zeros = tuple_of(((rows, rows), (rows,)), n, factors)
    table = table_of(factors.literal_value)
    kinds = types.Tuple([*arrays.return_type, TABLE])

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        made = zeros(context, builder, signature, values)
        content = ir.Constant(ir.ArrayType(ir.IntType(64), len(table)), table)
        constant = cgutils.global_constant(builder, "factors", content)
        where = builder.ptrtoint(constant, ir.IntType(64))
        found = uncounted(TABLE, context, builder, where, [ir.IntType(64)(len(table))])
        return context.make_tuple(builder, kinds, [*cgutils.unpack_tuple(builder, made), found])

    return kinds(n, factors), emit


@by_name(types.void(MATRIX, TABLE, VECTOR))
def decoupled(M, factors, right):
    """Overwrite f (n,) with a; the factors take the place of M, reciprocals of D that of its diagonal."""
    n = len(right)
    for s in range(n):
        M[s, s] = 1.0 / M[s, s]
        begin, end = factors[s], factors[s + 1]
        if end - begin == n - 1 - s:
            for i in range(s + 1, n):
                share = M[s, i] * M[s, s]
                right[i] -= share * right[s]
                for k in range(i, n):
                    M[i, k] -= share * M[s, k]
        else:
            for a in range(begin, end):
                i = factors[a]
                share = M[s, i] * M[s, s]
                right[i] -= share * right[s]
                for b in range(a, end):
                    M[i, factors[b]] -= share * M[s, factors[b]]
    for s in range(n - 1, -1, -1):
        value = right[s]
        begin, end = factors[s], factors[s + 1]
        if end - begin == n - 1 - s:
            for k in range(s + 1, n):
                value -= M[s, k] * right[k]
        else:
            for a in range(begin, end):
                value -= M[s, factors[a]] * right[factors[a]]
        right[s] = value * M[s, s]


@by_name(types.void(MATRIX, TABLE, MATRIX, VECTOR, types.int64))
def slopes(M, factors, forces, values, start):
    """Write derivatives of accelerations (n, columns), row by row, to `values` from `start` on, after `decoupled`.

    forces (n, columns): the derivatives of what M a is, at fixed a; overwritten. The rows in `values` are in the order
    of the coordinates.
    """
    n, columns = forces.shape
    for s in range(n):
        for a in range(factors[s], factors[s + 1]):
            i = factors[a]
            share = M[s, i] * M[s, s]
            for column in range(columns):
                forces[i, column] -= share * forces[s, column]
    for s in range(n - 1, -1, -1):
        for a in range(factors[s], factors[s + 1]):
            k = factors[a]
            for column in range(columns):
                forces[s, column] -= M[s, k] * forces[k, column]
        place = start + factors[factors[n] + s] * columns
        for column in range(columns):
            forces[s, column] *= M[s, s]
            values[place + column] = forces[s, column]
