"""Factors of M and G for accelerations under constraints, in compiled code: M a + G' l = f with G a = gamma.

With A = M + G' alpha G and f + G' alpha gamma in place of M and f, a and the multipliers l are the same, and A is
positive definite where every motion that the constraints allow has inertia: M alone may be singular. A = L L', and
W = L^-1 G' = Q R, its columns scaled to length 1 and pivoted, so that R' R is the Schur complement G A^-1 G' and the
diagonal of R tells how far each constraint is from depending on those before it (Golub & Van Loan, Matrix Computations,
sections 5.4 and 6.2). One that depends on them says nothing of its own and is left out, so a mechanism passes through
its singular positions and may have redundant constraints. There a and G' l are unique, and multipliers of constraints
that depend on each other are not. Nothing is allocated: the caller keeps all arrays.

All is done in rows of fours, and four right sides at a time, whose loops are vectors; for few coordinates see
`constrained_pivots`.
"""

import math

import numpy as np

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.constrained_work import (
    alpha_of,
    column_row,
    fours,
    gradient_row,
    lengths_of,
    lower_row,
    order_of,
    pivot_row,
    rank_of,
    scale_row,
    set_rank,
    side_row,
    triangle_of,
)
from qddot.runner.machine.fours import FOUR, add_scaled, dot, fill, multiply, scale
from qddot.runner.machine.memory import LEAN, floats

#: The sine of its angle to those before it below which a constraint depends on them; what a state that is off the
#: constraints adds, relative to the size of the coordinates; and the greatest value that this gives.
DEPENDENT, BENT, MOST_BENT = 1e-10, 100.0, 1e-3
#: A part by which columns differ that are as long as each other.
ALIKE = 1e-6
#: A pivot of A, scaled to a diagonal of ones, below which a motion has no inertia.
MASSLESS = 1e-14


@compiled(**LEAN)
def factorize(M, G, count, residuals, q, work):
    """Factors of M and G in the workspace; False where a motion that the constraints allow has no inertia.

    count: of the constraints that are to hold, the first ones; the others only add to the inertia.
    """
    m, n = G.shape
    _weigh(M, G, work)
    if not (_equalize(n, m, work) and _eliminate(n, m, work)):
        return False
    _whiten(n, m, count, work)
    off, dependent = distance(n, m, residuals, work), DEPENDENT
    if off > 0.0:
        size = magnitude(n, m, q, work)
        dependent = min(DEPENDENT + BENT * off / size if size > 0.0 else np.inf, MOST_BENT)
    _orthogonalize(n, m, work, dependent)
    return True


@compiled(**LEAN)
def _weigh(M, G, work):
    """The upper half of A in the rows of L, and alpha: 1 over about what G M^-1 G' has on its diagonal."""
    m, n = G.shape
    alpha, inverses, length = alpha_of(work, n, m), floats(pivot_row(work, n, m), n), fours(n)
    largest = 0.0
    for i in range(n):
        largest = max(largest, M[i, i])
    for i in range(n):
        row = lower_row(work, n, m, i)
        fill(row, 0.0, length)
        A = floats(row, n)
        for k in range(i, n):
            A[k] = M[k, i]
        inverses[i] = 1.0 / (M[i, i] if M[i, i] > 0.0 else largest)
    for j in range(m):
        row, total = gradient_row(work, n, m, j), 0.0
        fill(row, 0.0, length)
        entries = floats(row, n)
        for i in range(n):
            entries[i] = G[j, i]
            if G[j, i] != 0.0:
                total += G[j, i] * G[j, i] * inverses[i]
        alpha[j] = 1.0 / total if total > 0.0 else 0.0
        for i in range(n):
            if G[j, i] != 0.0:
                _add_behind(lower_row(work, n, m, i), alpha[j] * G[j, i], row, i, length)


@compiled(**LEAN)
def _add_behind(target, factor, source, i, length):
    """Add a factor times a row to another, from the four on that holds place i."""
    first = i // FOUR
    add_scaled(target + 8 * FOUR * first, factor, source + 8 * FOUR * first, length - first)


@compiled(**LEAN)
def _equalize(n, m, work):
    """D A D in place of A, D such that the diagonal is 1; False where that is not possible."""
    scales, length = scale_row(work, n, m), fours(n)
    fill(scales, 0.0, length)
    D = floats(scales, n)
    for i in range(n):
        entry = floats(lower_row(work, n, m, i), n)[i]
        if not 0.0 < entry < np.inf:
            return False
        D[i] = 1.0 / math.sqrt(entry)
    for i in range(n):
        row = lower_row(work, n, m, i)
        multiply(row, scales, length)
        scale(row, D[i], length)
    return True


@compiled(**LEAN)
def _eliminate(n, m, work):
    """Columns of L in place of the rows of D A D, and the pivots; False where one vanishes."""
    pivots, length = floats(pivot_row(work, n, m), n), fours(n)
    fill(pivot_row(work, n, m), 0.0, length)
    for k in range(n):
        row = lower_row(work, n, m, k)
        A = floats(row, n)
        pivot = A[k]
        if not pivot > MASSLESS:
            return False
        inverse = 1.0 / pivot
        for i in range(k + 1, n):
            _add_behind(lower_row(work, n, m, i), -inverse * A[i], row, i, length)
        scale(row, inverse, length)
        for i in range(k + 1):
            A[i] = 0.0
        pivots[k] = math.sqrt(inverse)
    return True


@compiled(**LEAN)
def _whiten(n, m, count, work):
    """W = L^-1 D G', its columns scaled to length 1; lengths: one over what they were, 0 from `count` on."""
    scales, pivots, length = scale_row(work, n, m), pivot_row(work, n, m), fours(n)
    lengths = lengths_of(work, n, m)
    for j in range(m):
        column = column_row(work, n, m, j)
        fill(column, 0.0, length)
        lengths[j] = 0.0
        if j >= count:
            continue
        add_scaled(column, 1.0, gradient_row(work, n, m, j), length)
        multiply(column, scales, length)
        W = floats(column, n)
        for k in range(n - 1):
            _add_behind(column, -W[k], lower_row(work, n, m, k), k, length)
        multiply(column, pivots, length)
        size = math.sqrt(dot(column, column, length))
        lengths[j] = 1.0 / size if size > 0.0 else 0.0
        scale(column, lengths[j], length)


@compiled(**LEAN)
def distance(n, m, residuals, work):
    """About how far a state is from the constraints, in the metric of A, after `factorize`."""
    lengths, total = lengths_of(work, n, m), 0.0
    for j in range(m):
        total += (residuals[j] * lengths[j]) ** 2
    return math.sqrt(total)


@compiled(**LEAN)
def magnitude(n, m, q, work):
    """The size of the coordinates in the metric of A, |L' D^-1 q|, after `factorize`."""
    D, pivots, total = floats(scale_row(work, n, m), n), floats(pivot_row(work, n, m), n), 0.0
    for k in range(n):
        L, part = floats(lower_row(work, n, m, k), n), q[k] / D[k]
        for i in range(k + 1, n):
            part += L[i] * q[i] / D[i]
        total += (part / pivots[k]) ** 2
    return math.sqrt(total)


@compiled(**LEAN)
def _orthogonalize(n, m, work, dependent):
    """W = Q R by Gram and Schmidt, each column once more against those before it; Q in place of W, largest first."""
    R, order, length, rank = triangle_of(work, n, m), order_of(work, n, m), fours(n), 0
    for j in range(m):
        order[j] = j
    while rank < m:
        place = _largest(n, m, work, rank)
        order[rank], order[place] = order[place], order[rank]
        p = int(order[rank])
        column = column_row(work, n, m, p)
        _part_again(n, m, work, rank, column, p)
        size = math.sqrt(dot(column, column, length))
        if not size > dependent:
            break
        R[rank, p] = 1.0 / size
        scale(column, R[rank, p], length)
        for k in range(rank + 1, m):
            j = int(order[k])
            other = column_row(work, n, m, j)
            R[rank, j] = dot(column, other, length)
            add_scaled(other, -R[rank, j], column, length)
        rank += 1
    set_rank(work, n, m, rank)


@compiled(**LEAN)
def _largest(n, m, work, rank):
    """Where, from `rank` on, the constraint stands whose column is the longest.

    Of those that are alike, as the two of a pin between parallel bars, it is the one whose gradient is the largest.
    """
    order, lengths, length = order_of(work, n, m), lengths_of(work, n, m), fours(n)
    place, largest = rank, -1.0
    for k in range(rank, m):
        column = column_row(work, n, m, int(order[k]))
        size = dot(column, column, length)
        steeper = lengths[int(order[k])] < lengths[int(order[place])]
        if size > largest * (1.0 + ALIKE) or (size > largest * (1.0 - ALIKE) and steeper):
            largest, place = size, k
    return place


@compiled(**LEAN)
def _part_again(n, m, work, rank, column, p):
    """Take what rounding left of the first `rank` columns of Q out of column p, all shares at once."""
    R, order, length = triangle_of(work, n, m), order_of(work, n, m), fours(n)
    shares = floats(side_row(work, n, m, 0), m)
    for k in range(rank):
        shares[k] = dot(column_row(work, n, m, int(order[k])), column, length)
    for k in range(rank):
        R[k, p] += shares[k]
        add_scaled(column, -shares[k], column_row(work, n, m, int(order[k])), length)


@compiled(**LEAN)
def solve(n, m, work, right):
    """Overwrite right (n + m,), [f, gamma], with [a, l], after `factorize`."""
    for i in range(n + m):
        fill(side_row(work, n, m, i), right[i], 1)
    solve_four(n, m, work)
    for i in range(n + m):
        right[i] = floats(side_row(work, n, m, i), 1)[0]


@compiled(**LEAN)
def solve_four(n, m, work):
    """The same for four right sides at once, which stand in the workspace, see `side_row`."""
    alpha, D, pivots = alpha_of(work, n, m), floats(scale_row(work, n, m), n), floats(pivot_row(work, n, m), n)
    for j in range(m):
        G, gamma = floats(gradient_row(work, n, m, j), n), side_row(work, n, m, n + j)
        for i in range(n):
            if G[i] != 0.0:
                add_scaled(side_row(work, n, m, i), alpha[j] * G[i], gamma, 1)
    for i in range(n):
        scale(side_row(work, n, m, i), D[i], 1)
    for k in range(n):  # L z = D f
        L, z = floats(lower_row(work, n, m, k), n), side_row(work, n, m, k)
        for i in range(k + 1, n):
            add_scaled(side_row(work, n, m, i), -L[i], z, 1)
        scale(z, pivots[k], 1)
    _hold(n, m, work)
    for i in range(n):
        scale(side_row(work, n, m, i), pivots[i], 1)
    for k in range(n - 1, -1, -1):  # L' D^-1 a = z
        L, z = floats(lower_row(work, n, m, k), n), side_row(work, n, m, k)
        for i in range(k + 1, n):
            add_scaled(z, -L[i], side_row(work, n, m, i), 1)
    for i in range(n):
        scale(side_row(work, n, m, i), D[i], 1)


@compiled(**LEAN)
def _hold(n, m, work):
    """Change z so that W' z = gamma, and write the multipliers: R' y = gamma, z + Q (y - Q' z), R l = Q' z - y."""
    R, order, lengths, rank = triangle_of(work, n, m), order_of(work, n, m), lengths_of(work, n, m), rank_of(work, n, m)
    for k in range(rank):
        p = int(order[k])
        y, excess = side_row(work, n, m, n + p), side_row(work, n, m, n + m + k)
        Q = floats(column_row(work, n, m, p), n)
        scale(y, lengths[p], 1)
        for s in range(k):
            add_scaled(y, -R[s, p], side_row(work, n, m, n + int(order[s])), 1)
        scale(y, R[k, p], 1)
        fill(excess, 0.0, 1)
        add_scaled(excess, -1.0, y, 1)
        for i in range(n):
            add_scaled(excess, Q[i], side_row(work, n, m, i), 1)
    for k in range(rank):
        Q, excess = floats(column_row(work, n, m, int(order[k])), n), side_row(work, n, m, n + m + k)
        for i in range(n):
            add_scaled(side_row(work, n, m, i), -Q[i], excess, 1)
    for k in range(m - 1, -1, -1):
        p = int(order[k])
        target, excess = side_row(work, n, m, n + p), side_row(work, n, m, n + m + k)
        fill(target, 0.0, 1)
        if k < rank:
            for s in range(k + 1, rank):
                add_scaled(excess, -R[k, int(order[s])], side_row(work, n, m, n + m + s), 1)
            scale(excess, R[k, p], 1)
            add_scaled(target, lengths[p], excess, 1)
