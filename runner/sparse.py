"""Linear algebra of large models by their sparse Jacobians: where a system is regular, and its slowest modes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.matrices import PlacedKernel

Vector = NDArray[np.float64]

#: States from which on matrices are kept sparse where they may be.
LARGE = 400
#: Where eigenvalues are sought instead of at zero, in the square root of the matrix's norm: a frequency is one.
BESIDE = 1e-6
#: How near to an eigenvalue inverse iteration works, relative to it or to this part of that root, and how often.
NEAR, LEAST, INVERSE_ITERATIONS = 1e-6, 1e-3, 3
#: Eigenvalues at the rim that are asked for, and how closely: with so large a subspace a few iterations find them.
OUTERMOST, COARSE = 6, {"tol": 0.01, "ncv": 60, "maxiter": 100}


def sparse_matrix(matrix: PlacedKernel, t: float, x: Vector, u: Vector, c: Vector) -> Any:
    """The matrix that a kernel writes, as SciPy's `csc_array`."""
    from scipy.sparse import csc_array  # noqa: PLC0415 - of large models alone

    values, pattern = np.empty(matrix.pattern.entries), matrix.pattern
    matrix.kernel(t, x, u, c, values)
    return csc_array((values, (pattern.rows, pattern.columns)), shape=pattern.shape)


class Factors:
    """Sparse LU of a square matrix (n, n), its rows scaled by their largest entries.

    condition: an estimate of that of the scaled matrix in the 1-norm, infinite where it is singular or not finite
    (N. J. Higham, F. Tisseur, SIAM J. Matrix Anal. Appl. 21 (2000) 1185-1201).
    """

    def __init__(self, J: Any) -> None:
        from scipy.sparse import diags_array  # noqa: PLC0415 - of large models alone
        from scipy.sparse.linalg import LinearOperator, onenormest, splu  # noqa: PLC0415

        self.condition = np.inf
        largest = abs(J).max(axis=1).toarray().ravel()
        if not (np.isfinite(J.data).all() and largest.all()):
            return
        self._scale, scaled = largest, (diags_array(1.0 / largest) @ J).tocsc()
        try:
            self._factors = splu(scaled)
        except RuntimeError:  # exactly singular
            return
        solve = self._factors.solve
        inverse = LinearOperator(J.shape, matvec=solve, rmatvec=lambda b: solve(b, "T"), dtype=np.float64)
        self.condition = float(abs(scaled).sum(axis=0).max() * onenormest(inverse))

    def solve(self, b: Vector) -> Vector:
        """The solution (n,) for a right-hand side (n,)."""
        found: Vector = self._factors.solve(b / self._scale)
        return found


def fastest(J: Any) -> NDArray[np.complex128]:
    """Eigenvalues of a sparse matrix (n, n): those of largest magnitude and those that swing fastest, to a hundredth.

    By ARPACK; those that did not converge are not among them.
    """
    from scipy.sparse.linalg import ArpackNoConvergence, eigs  # noqa: PLC0415 - of large models alone

    found = []
    for which in ("LM", "LI"):
        try:
            found.append(eigs(J, OUTERMOST, which=which, v0=np.ones(J.shape[0]), return_eigenvectors=False, **COARSE))
        except ArpackNoConvergence as error:
            found.append(error.eigenvalues)
    return np.concatenate(found)


def slowest(J: Any, most: int) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.float64]]:
    """The eigenvalues of least magnitude (k,) of a sparse matrix (n, n), their vectors (n, k), and |right * left|.

    Of conjugates the one that swings forward; k is `most` at most. By ARPACK, about zero, or beside it where the matrix
    is singular, and by inverse iteration. Raises ArithmeticError where they do not converge.
    """
    from scipy.sparse.linalg import ArpackError, eigs  # noqa: PLC0415 - of large models alone

    n, size = J.shape[0], float(abs(J).sum(axis=1).max())
    count = min(2 * most + 2, n - 2)
    for beside in (0.0, BESIDE):
        try:
            values, right = eigs(J, count, sigma=beside * np.sqrt(size), v0=np.ones(n))
            forward = [k for k in np.argsort(abs(values)) if values[k].imag >= 0][:most]
            left = [_left(J, complex(values[k]), right[:, k], np.sqrt(size)) for k in forward]
        except ArpackError as error:
            raise ArithmeticError(str(error)) from error
        except RuntimeError:  # a singular matrix
            continue
        return values[forward], right[:, forward], np.abs(right[:, forward] * np.array(left).T)
    raise ArithmeticError("the matrix is singular beside zero, too")


def _left(J: Any, value: complex, right: NDArray[np.complex128], size: float) -> NDArray[np.complex128]:
    """The left eigenvector (n,) of an eigenvalue: by inverse iteration, from its right one."""
    from scipy.sparse import eye_array  # noqa: PLC0415 - of large models alone
    from scipy.sparse.linalg import splu  # noqa: PLC0415

    shift = value + NEAR * max(abs(value), LEAST * size)
    factors, found = splu((J.T - shift * eye_array(len(right))).tocsc()), right.conj()
    for _ in range(INVERSE_ITERATIONS):
        found = factors.solve(found)
        found /= np.linalg.norm(found)
    return found
