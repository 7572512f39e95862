"""Factors of M and G for accelerations under constraints, in compiled code: M a + G' l = f with G a = gamma.

With A = M + G' alpha G and f + G' alpha gamma in place of M and f, a and the multipliers l are the same, and A is
positive definite where every motion that the constraints allow has inertia: M alone may be singular. A = L L', and
W = L^-1 G' = Q R, its columns scaled to length 1 and pivoted, so that R' R is the Schur complement G A^-1 G' and the
diagonal of R tells how far each constraint is from depending on those before it (Golub & Van Loan, Matrix Computations,
sections 5.4 and 6.2). One that depends on them says nothing of its own and is left out, so a mechanism passes through
its singular positions and may have redundant constraints. There a and G' l are unique, and multipliers of constraints
that depend on each other are not. Nothing is allocated: the caller keeps all arrays.
"""

import math

import numpy as np

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.constrained_work import (
    alpha_of,
    columns_of,
    drift_of,
    lower_of,
    norms_of,
    order_of,
    rank_of,
    scale_of,
    set_rank,
    triangle_of,
    vector_of,
)
from qddot.runner.machine.memory import LEAN

#: The sine of its angle to those before it below which a constraint depends on them; what a state that is off the
#: constraints adds, relative to the size of the coordinates; and the greatest value that this gives.
DEPENDENT, BENT, MOST_BENT = 1e-10, 100.0, 1e-3
#: A pivot of A, scaled to a diagonal of ones, below which a motion has no inertia.
MASSLESS = 1e-14


@compiled(**LEAN)
def factorize(M, G, count, residuals, q, work):
    """Factors of M and G in the workspace; False where a motion that the constraints allow has no inertia.

    count: of the constraints that are to hold, the first ones; the others only add to the inertia.
    """
    m, n = G.shape
    _weigh(M, G, work)
    if not _cholesky(lower_of(work, n, m), scale_of(work, n, m)):
        return False
    _whiten(G, count, work)
    off, dependent = distance(G, residuals, work), DEPENDENT
    if off > 0.0:
        size = magnitude(G, q, work)
        dependent = min(DEPENDENT + BENT * off / size if size > 0.0 else np.inf, MOST_BENT)
    _orthogonalize(n, m, work, dependent)
    return True


@compiled(**LEAN)
def _weigh(M, G, work):
    """The lower half of A, and alpha: 1 over about what G M^-1 G' has on its diagonal."""
    m, n = G.shape
    A, alpha = lower_of(work, n, m), alpha_of(work, n, m)
    largest = 0.0
    for i in range(n):
        largest = max(largest, M[i, i])
        for k in range(i + 1):
            A[i, k] = M[i, k]
    for j in range(m):
        total = 0.0
        for i in range(n):
            if G[j, i] != 0.0:
                total += G[j, i] * G[j, i] / (M[i, i] if M[i, i] > 0.0 else largest)
        alpha[j] = 1.0 / total if total > 0.0 else 0.0
        for i in range(n):
            if G[j, i] != 0.0:
                weight = alpha[j] * G[j, i]
                for k in range(i + 1):
                    A[i, k] += weight * G[j, k]


@compiled(**LEAN)
def _cholesky(A, scale):
    """Overwrite A (n, n) with L of D A D, D such that the diagonal is 1; False where a pivot vanishes."""
    n = len(scale)
    for i in range(n):
        if not 0.0 < A[i, i] < np.inf:
            return False
        scale[i] = 1.0 / math.sqrt(A[i, i])
    for i in range(n):
        for k in range(i + 1):
            entry = scale[i] * A[i, k] * scale[k]
            for s in range(k):
                entry -= A[i, s] * A[k, s]
            if k < i:
                A[i, k] = entry * A[k, k]
            elif not entry > MASSLESS:
                return False
            else:
                A[i, i] = 1.0 / math.sqrt(entry)  # the solutions multiply by it
    return True


@compiled(**LEAN)
def _whiten(G, count, work):
    """W = L^-1 D G', its columns, which are rows here, scaled to length 1; norms: what they were, 0 from `count` on."""
    m, n = G.shape
    L, W, scale, norms = lower_of(work, n, m), columns_of(work, n, m), scale_of(work, n, m), norms_of(work, n, m)
    for j in range(m):
        total = 0.0
        for i in range(n):
            value = scale[i] * G[j, i] if j < count else 0.0
            for k in range(i):
                value -= L[i, k] * W[j, k]
            W[j, i] = value * L[i, i]
            total += W[j, i] * W[j, i]
        norms[j] = math.sqrt(total)
        for i in range(n):
            W[j, i] = W[j, i] / norms[j] if norms[j] > 0.0 else 0.0


@compiled(**LEAN)
def distance(G, residuals, work):
    """About how far a state is from the constraints, in the metric of A, after `factorize`."""
    m, n = G.shape
    norms, total = norms_of(work, n, m), 0.0
    for j in range(m):
        if norms[j] > 0.0:
            total += (residuals[j] / norms[j]) ** 2
    return math.sqrt(total)


@compiled(**LEAN)
def magnitude(G, q, work):
    """The size of the coordinates in the metric of A, |L' D^-1 q|, after `factorize`."""
    m, n = G.shape
    L, scale, total = lower_of(work, n, m), scale_of(work, n, m), 0.0
    for k in range(n):
        part = q[k] / scale[k] / L[k, k]
        for i in range(k + 1, n):
            part += L[i, k] * q[i] / scale[i]
        total += part * part
    return math.sqrt(total)


@compiled(**LEAN)
def _orthogonalize(n, m, work, dependent):
    """W = Q R by Gram and Schmidt, each column once more against those before it; Q in place of W, largest first."""
    W, R, order = columns_of(work, n, m), triangle_of(work, n, m), order_of(work, n, m)
    for j in range(m):
        order[j] = j
    rank = 0
    while rank < m:
        largest, place = -1.0, rank
        for j in range(rank, m):
            size = _dot(W, j, j, n)
            if size > largest:
                largest, place = size, j
        _exchange(W, R, order, n, rank, place)
        for k in range(rank):
            share = _dot(W, k, rank, n)
            R[k, rank] += share
            _subtract(W, rank, k, share, n)
        length = math.sqrt(_dot(W, rank, rank, n))
        if not length > dependent:
            break
        R[rank, rank] = length
        for i in range(n):
            W[rank, i] /= length
        for j in range(rank + 1, m):
            R[rank, j] = _dot(W, rank, j, n)
            _subtract(W, j, rank, R[rank, j], n)
        rank += 1
    set_rank(work, n, m, rank)


@compiled(**LEAN)
def _dot(W, one, other, n):
    total = 0.0
    for i in range(n):
        total += W[one, i] * W[other, i]
    return total


@compiled(**LEAN)
def _subtract(W, row, other, share, n):
    for i in range(n):
        W[row, i] -= share * W[other, i]


@compiled(**LEAN)
def _exchange(W, R, order, n, one, other):
    """Exchange two columns, with what R has of them."""
    if one == other:
        return
    order[one], order[other] = order[other], order[one]
    for i in range(n):
        W[one, i], W[other, i] = W[other, i], W[one, i]
    for k in range(one):
        R[k, one], R[k, other] = R[k, other], R[k, one]


@compiled(**LEAN)
def solve(G, work, right):
    """Overwrite right (n + m,), [f, gamma], with [a, l], after `factorize`."""
    m, n = G.shape
    L, scale, z = lower_of(work, n, m), scale_of(work, n, m), vector_of(work, n, m)
    gamma, alpha = drift_of(work, n, m), alpha_of(work, n, m)
    for j in range(m):
        gamma[j], right[n + j] = right[n + j], 0.0
        for i in range(n):
            right[i] += G[j, i] * alpha[j] * gamma[j]
    for i in range(n):  # L z = D f
        z[i] = scale[i] * right[i]
        for k in range(i):
            z[i] -= L[i, k] * z[k]
        z[i] *= L[i, i]
    _hold(work, right, n, m)
    for i in range(n - 1, -1, -1):  # L' D^-1 a = z
        for k in range(i + 1, n):
            z[i] -= L[k, i] * z[k]
        z[i] *= L[i, i]
        right[i] = scale[i] * z[i]


@compiled(**LEAN)
def _hold(work, right, n, m):
    """Change z so that W' z = gamma, and write the multipliers: R' y = gamma, z + Q (y - Q' z), R l = Q' z - y."""
    W, R, z = columns_of(work, n, m), triangle_of(work, n, m), vector_of(work, n, m)
    order, norms, gamma, rank = order_of(work, n, m), norms_of(work, n, m), drift_of(work, n, m), rank_of(work, n, m)
    for k in range(rank):
        j = int(order[k])
        y = gamma[j] / norms[j]
        for s in range(k):
            y -= R[s, k] * gamma[int(order[s])]
        y /= R[k, k]
        excess = -y
        for i in range(n):
            excess += W[k, i] * z[i]
        for i in range(n):
            z[i] -= excess * W[k, i]
        gamma[j], right[n + j] = y, excess
    for k in range(rank - 1, -1, -1):
        j = int(order[k])
        for s in range(k + 1, rank):
            right[n + j] -= R[k, s] * right[n + int(order[s])]
        right[n + j] /= R[k, k]
    for k in range(rank):
        right[n + int(order[k])] /= norms[int(order[k])]
