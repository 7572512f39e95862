"""Accelerations of many coupled coordinates in compiled code: M a = f by M = U' D^-1 U, the diagonal of U being D.

It is LDL' row by row (Golub & Van Loan, Matrix Computations, section 4.1); M is positive definite for physics, so there
is no pivoting.

Generated kernels of many coordinates fill the arrays of `coupled`, call `decoupled`, and read what comes of them.
Nothing is allocated: all arrays stand on the stack. Rows are taken from others side by side, so that they become
vectors, and what is zero in a row costs no more than to see it: a band, or an arrow from its tip to its shafts, stays
what it is.
"""

from typing import Any

from numba import types
from numba.extending import intrinsic

from qddot.runner.abi import MATRIX, VECTOR
from qddot.runner.machine.constrained_work import blank, tuple_of
from qddot.runner.machine.pointers import by_name

__all__ = ["blank", "coupled", "decoupled", "slopes"]


@intrinsic(prefer_literal=True)
def coupled(typing_context: Any, n: Any) -> Any:
    """Arrays of zeros on the stack: M (n, n), of which what stands on and above the diagonal counts, and f (n,)."""
    rows = n.literal_value
    return tuple_of(((rows, rows), (rows,)), n)


@by_name(types.void(MATRIX, VECTOR))
def decoupled(M, right):
    """Overwrite f (n,) with a; the factors take the place of M, reciprocals of D that of its diagonal."""
    n = len(right)
    for s in range(n):
        M[s, s] = 1.0 / M[s, s]
        for i in range(s + 1, n):
            if M[s, i] != 0.0:
                share = M[s, i] * M[s, s]
                right[i] -= share * right[s]
                for k in range(i, n):
                    M[i, k] -= share * M[s, k]
    for s in range(n - 1, -1, -1):
        value = right[s]
        for k in range(s + 1, n):
            value -= M[s, k] * right[k]
        right[s] = value * M[s, s]


@by_name(types.void(MATRIX, MATRIX, VECTOR, types.int64))
def slopes(M, forces, values, start):
    """Write derivatives of accelerations (n, columns), row by row, to `values` from `start` on, after `decoupled`.

    forces (n, columns): the derivatives of what M a is, at fixed a; overwritten.
    """
    n, columns = forces.shape
    for s in range(n):
        for i in range(s + 1, n):
            if M[s, i] != 0.0:
                share = M[s, i] * M[s, s]
                for column in range(columns):
                    forces[i, column] -= share * forces[s, column]
    for s in range(n - 1, -1, -1):
        for k in range(s + 1, n):
            if M[s, k] != 0.0:
                for column in range(columns):
                    forces[s, column] -= M[s, k] * forces[k, column]
        for column in range(columns):
            forces[s, column] *= M[s, s]
            values[start + s * columns + column] = forces[s, column]
