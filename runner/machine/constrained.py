"""What generated kernels of models with constraints call: M a + G' l = f with G a = gamma, see `constrained_factors`.

They fill the arrays of `equations`, call `accelerations`, and read what comes of them. Nothing is allocated: all arrays
stand on the stack of the kernel.
"""

import numpy as np
from numba import types

from qddot.runner.abi import MATRIX, VECTOR
from qddot.runner.machine.constrained_factors import factorize, solve, solve_four
from qddot.runner.machine.constrained_pivots import SIGNATURE, solved
from qddot.runner.machine.constrained_work import (
    blank,
    equations,
    order_of,
    outcome,
    rank_of,
    side_row,
    triangle_of,
)
from qddot.runner.machine.fours import FOUR
from qddot.runner.machine.memory import floats
from qddot.runner.machine.pointers import by_name

__all__ = ["accelerations", "blank", "derivatives", "equations", "outcome", "report", "solved"]

#: The share of a constraint that was left out in another, below which that one's multiplier is determined.
SHARED = 1e-8


@by_name(SIGNATURE)
def accelerations(M, G, right, residuals, q, work):
    """Overwrite right (n + m,), [f, gamma], with [a, l]; the factors stay in the workspace.

    Multipliers of constraints left out are 0. All are NaN where a motion that the constraints allow has no inertia.
    """
    m, n = G.shape
    if factorize(M, G, m, residuals, q, work):
        solve(n, m, work, right)
    else:
        for i in range(len(right)):
            right[i] = np.nan


@by_name(types.void(MATRIX, VECTOR, MATRIX, MATRIX, VECTOR, types.int64))
def derivatives(G, work, forces, drifts, values, start):
    """Write derivatives of accelerations (n, columns), row by row, to `values` from `start` on, after `accelerations`.

    forces (n, columns), drifts (m, columns): the derivatives of what M a + G' l and G a are, at fixed a and l.
    """
    (m, n), columns = G.shape, forces.shape[1]
    for first in range(0, columns, FOUR):
        count = min(FOUR, columns - first)
        for i in range(n + m):
            right = floats(side_row(work, n, m, i), FOUR)
            for k in range(FOUR):
                given = forces[i, first + k] if i < n and k < count else 0.0
                right[k] = drifts[i - n, first + k] if i >= n and k < count else given
        solve_four(n, m, work)
        for i in range(n):
            found = floats(side_row(work, n, m, i), FOUR)
            for k in range(count):
                values[start + i * columns + first + k] = found[k]


@by_name(types.void(MATRIX, VECTOR, VECTOR, VECTOR, VECTOR))
def report(G, right, work, multipliers, reactions):
    """After `accelerations`: multipliers (m,), NaN where undetermined, and the forces -G' l on the coordinates (n,)."""
    m, n = G.shape
    for i in range(n):
        reactions[i] = 0.0
    for j in range(m):
        multipliers[j] = right[n + j]
        for i in range(n):
            reactions[i] -= G[j, i] * right[n + j]
    R, order, rank = triangle_of(work, n, m), order_of(work, n, m), rank_of(work, n, m)
    share = floats(side_row(work, n, m, 0), m)
    for left_out in range(rank, m):
        multipliers[int(order[left_out])] = np.nan
        for k in range(rank - 1, -1, -1):
            share[k] = R[k, int(order[left_out])]
            for i in range(k + 1, rank):
                share[k] -= R[k, int(order[i])] * share[i]
            share[k] *= R[k, int(order[k])]
            if abs(share[k]) > SHARED:
                multipliers[int(order[k])] = np.nan
