"""A state put back on the constraints of its model: by the nearest way in the metric of the mass matrix.

Positions by Newton's iteration, M dq + G' l = 0 with G dq = -f(q, t), then velocities by one solution of the same,
G dv = -(G v + df/dt). E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.2; in the metric of
M that is what impulses of the constraints would do. Constraints on positions stand first.
"""

import numpy as np

from qddot.runner.frame.space import constants, input_values, look_up
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.constrained import compiled_work_size, distance, factorize, magnitude, solve
from qddot.runner.machine.memory import LEAN, VIEW, floats, matrix
from qddot.runner.machine.pointers import call_kernel
from qddot.runner.matrices import scatter

#: Newton iterations; a distance from the constraints that is rounding, relative to the size of the coordinates.
MOST_CORRECTIONS, ROUNDING = 12, 1e-15
#: An iteration that leaves more than this part of the distance has come down to rounding, or leads nowhere.
STAGNANT = 0.5


@compiled(**LEAN)
def project_at_end(space, t, h, x):
    """Put the state at an address on the constraints at the end of the step from t to t + h."""
    if space.n_inputs > 0:
        look_up(space, t, h, 1.0)
    project(space, t + h, x)


@compiled(**LEAN)
def project(space, t, x):
    """Put the state at an address on the constraints at t, the inputs being set: positions, then velocities."""
    n, m = space.coordinates, space.n_constraints
    M, G, right, work = _masses(space, n, m), _gradients(space, n, m), _right(space, n, m), _work(space, n, m)
    residuals, q, v = _residuals(space, n, m), floats(x, n), floats(x + 8 * n, n)
    last = np.inf
    for _ in range(MOST_CORRECTIONS):
        _evaluate(space, t, x, n, m)
        if not factorize(M, G, space.n_positions, residuals, q, work):
            return
        off = distance(G, residuals, work)
        if not ROUNDING * magnitude(G, q, work) < off < STAGNANT * last:
            break
        _solve_for(G, work, right, residuals)
        for i in range(n):
            q[i] += right[i]
        last = off
    if space.n_positions < m:
        factorize(M, G, m, residuals, q, work)
    whole = _whole(space, n, m)
    for j in range(m):
        residuals[j] = whole[n + j, n + 1]
    _solve_for(G, work, right, residuals)
    for i in range(n):
        v[i] += right[i]


@compiled(**LEAN)
def _solve_for(G, work, right, residuals):
    """The least change (n,), in right, that takes the residuals away."""
    m, n = G.shape
    for i in range(n):
        right[i] = 0.0
    for j in range(m):
        right[n + j] = -residuals[j]
    solve(G, work, right)


@compiled(**LEAN)
def _evaluate(space, t, x, n, m):
    """M, G and the residuals of positions."""
    whole = _whole(space, n, m)
    values = floats(space.constraint_values, space.n_entries)
    call_kernel(space.constraints, t, floats(x, space.n), input_values(space), constants(space), values)
    scatter(space.constraint_values, space.constraint_places, space.n_entries, space.projection, (n + m) * (n + 2))
    M, G, residuals = _masses(space, n, m), _gradients(space, n, m), _residuals(space, n, m)
    for i in range(n):
        for k in range(i + 1):
            M[i, k] = whole[i, k]
    for j in range(m):
        residuals[j] = whole[n + j, n]
        for i in range(n):
            G[j, i] = whole[n + j, i]


@compiled(**VIEW)
def _whole(space, n, m):
    """What the kernel writes, (n + m, n + 2)."""
    return matrix(space.projection, n + m, n + 2)


@compiled(**VIEW)
def _masses(space, n, m):
    return matrix(space.projection + 8 * (n + m) * (n + 2), n, n)


@compiled(**VIEW)
def _gradients(space, n, m):
    return matrix(space.projection + 8 * ((n + m) * (n + 2) + n * n), m, n)


@compiled(**VIEW)
def _right(space, n, m):
    return floats(space.projection + 8 * ((n + m) * (2 * n + 2)), n + m)


@compiled(**VIEW)
def _residuals(space, n, m):
    return floats(space.projection + 8 * ((n + m) * (2 * n + 3)), m)


@compiled(**VIEW)
def _work(space, n, m):
    return floats(space.projection + 8 * ((n + m) * (2 * n + 3) + m), compiled_work_size(n, m))
