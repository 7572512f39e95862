"""LU with partial pivoting inside compiled code: own loops for small systems, LAPACK for large and banded ones.

Matrices are held **by columns**: row j of the array is column j of the matrix, so that every inner loop below runs
along contiguous memory and LAPACK gets the layout it wants. Nothing is allocated.
"""

import ctypes
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, first_item

#: Systems of more unknowns go to LAPACK, which overtakes the loops below at about this size (measured).
LARGEST_OWN = 32
#: The letter that asks LAPACK for A x = b, not Aᵀ x = b.
PLAIN = ord("N")


class Lapack(NamedTuple):
    """Addresses of two routines in this process, for compiled code to call; any tuple with these fields serves.

    They factorize and solve: dgetrf and dgetrs, or of bands dgbtrf and dgbtrs. They are data, not part of the code,
    because a compiled function that held an address could not be cached.
    """

    factor_routine: int
    solve_routine: int


def find_lapack(n: int, *, banded: bool = False) -> Lapack:
    """Addresses of the LAPACK that SciPy was linked with; zeros where a system of n unknowns needs none."""
    if n <= LARGEST_OWN:
        return Lapack(0, 0)
    kind = "gb" if banded else "ge"
    return Lapack(_address(f"d{kind}trf"), _address(f"d{kind}trs"))


def _address(name: str) -> int:
    import scipy.linalg.cython_lapack as lapack  # noqa: PLC0415  A tenth of a second that small systems need not spend.

    capsule = lapack.__pyx_capi__[name]
    api = ctypes.pythonapi
    get_name = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(("PyCapsule_GetName", api))
    get_pointer = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(("PyCapsule_GetPointer", api))
    return int(get_pointer(capsule, get_name(capsule)))


@intrinsic
def call(typing_context: Any, address: Any, pointers: Any) -> Any:
    """Call the C function at `address`, an int64, with a tuple of int64 that are its pointer arguments."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        target, arguments = values[0], cgutils.unpack_tuple(builder, values[1])
        function = ir.FunctionType(ir.VoidType(), [argument.type for argument in arguments])
        builder.call(builder.inttoptr(target, function.as_pointer()), arguments)
        return context.get_dummy_value()

    return types.void(types.int64, pointers), generate


@compiled(**LEAN)
def factorize(lapack, W, pivots):
    """Overwrite W, an (n, n) matrix by columns, with its factors; pivots (n,) int64 takes the row exchanges.

    Returns -1, or the index of the first column without a usable pivot (singular, or not finite).
    """
    n = len(W)
    if n > LARGEST_OWN:
        return _factorize_large(lapack, W, pivots)
    for k in range(n):
        pivot, row = abs(W[k, k]), k
        for i in range(k + 1, n):
            if abs(W[k, i]) > pivot:
                pivot, row = abs(W[k, i]), i
        if not 0.0 < pivot < np.inf:
            return k
        pivots[k] = row
        reciprocal = 1.0 / W[k, row]
        W[k, row] = W[k, k]
        W[k, k] = reciprocal  # the solutions multiply by it
        for i in range(k + 1, n):
            W[k, i] *= reciprocal
        for j in range(k + 1, n):
            factor = W[j, row]
            W[j, row] = W[j, k]
            W[j, k] = factor
            if factor != 0.0:  # Jacobians of mechanical systems are half zeros
                for i in range(k + 1, n):
                    W[j, i] -= factor * W[k, i]
    return -1


@compiled(**LEAN)
def solve(lapack, W, pivots, b):
    """Overwrite b (n,) with the solution of W x = b, after `factorize`."""
    n = len(W)
    if n > LARGEST_OWN:
        _solve_large(lapack, W, pivots, b)
        return
    for k in range(n):
        row = pivots[k]
        value = b[row]
        b[row] = b[k]
        b[k] = value
        for i in range(k + 1, n):
            b[i] -= value * W[k, i]
    for k in range(n - 1, -1, -1):
        value = b[k] * W[k, k]
        b[k] = value
        for i in range(k):
            b[i] -= value * W[k, i]


@compiled(**LEAN)
def _factorize_large(lapack, W, pivots):
    """LAPACK's dgetrf(m, n, a, lda, ipiv, info). Its 32-bit pivots fill half of ours; the integers lie at the end."""
    n = len(W)
    pivots[n - 1], pivots[n - 2] = n, 0
    matrix, exchanges = first_item(W), first_item(pivots)
    size, info = exchanges + 8 * (n - 1), exchanges + 8 * (n - 2)
    call(lapack.factor_routine, (size, size, matrix, size, exchanges, info))
    for k in range(n):
        if not 0.0 < abs(W[k, k]) < np.inf:
            return k
    return -1


@compiled(**LEAN)
def _solve_large(lapack, W, pivots, b):
    """LAPACK's dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)."""
    n = len(W)
    pivots[n - 1], pivots[n - 2], pivots[n - 3], pivots[n - 4] = n, 0, 1, PLAIN
    matrix, exchanges, right = first_item(W), first_item(pivots), first_item(b)
    size = exchanges + 8 * (n - 1)
    info, one, plain = size - 8, size - 16, size - 24
    call(lapack.solve_routine, (plain, size, one, matrix, size, exchanges, right, size, info))


@compiled(**LEAN)
def factorize_band(lapack, W, lower, upper, pivots):
    """As `factorize`, of a band by columns: W (n, 2 lower + upper + 1), the diagonal at W[:, lower + upper].

    LAPACK's dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info), for n > LARGEST_OWN; what stands in the first `lower` entries
    of a column does not count.
    """
    n, width = W.shape
    integers = _integers(pivots, n, width, lower, upper)
    size, below, above, length, info = integers, integers - 8, integers - 16, integers - 24, integers - 32
    matrix, exchanges = first_item(W), first_item(pivots)
    call(lapack.factor_routine, (size, size, below, above, matrix, length, exchanges, info))
    for k in range(n):
        if not 0.0 < abs(W[k, lower + upper]) < np.inf:
            return k
    return -1


@compiled(**LEAN)
def solve_band(lapack, W, lower, upper, pivots, b):
    """As `solve`, after `factorize_band`: dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)."""
    n, width = W.shape
    integers = _integers(pivots, n, width, lower, upper)
    size, below, above, length, info = integers, integers - 8, integers - 16, integers - 24, integers - 32
    one, plain = integers - 40, integers - 48
    matrix, exchanges, right = first_item(W), first_item(pivots), first_item(b)
    call(lapack.solve_routine, (plain, size, below, above, one, matrix, length, exchanges, right, size, info))


@compiled(**LEAN)
def _integers(pivots, n, width, lower, upper):
    """Write what LAPACK wants by address behind the pivots; the address of the first, the others lie before it."""
    k = n
    for value in (n, lower, upper, width, 0, 1, PLAIN):
        k -= 1
        pivots[k] = value
    return first_item(pivots) + 8 * (n - 1)
