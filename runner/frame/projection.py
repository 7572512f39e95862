"""A state put back on the constraints of its model: by the nearest way in the metric of the mass matrix.

Positions by Newton's iteration, M dq + G' l = 0 with G dq = -f(q, t), then velocities by solution of the same,
G dv = -(G v + df/dt). A state that is near keeps its first factors: what M and G change by on the way is little. E.
Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.2; in the metric of M that is what impulses
of the constraints would do. Constraints on positions stand first.

Loops call it by its address: it is no part of them, and compiled for models with constraints alone.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from qddot.runner.abi import VECTOR_KERNEL
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.constrained_factors import distance, factorize, magnitude, solve
from qddot.runner.machine.constrained_work import compiled_work_size, work_size
from qddot.runner.machine.memory import LEAN, VIEW, address, floats, layout, matrix, record_at
from qddot.runner.machine.pointers import call_kernel, calling, pointer
from qddot.runner.matrices import scatter
from qddot.runner.problem import Held, Problem

#: What a state is kept on, in addresses and lengths. constraints: their kernel, and how many there are of them, on
#: positions the first n_positions; values, places (n_entries,): what the kernel writes, and where that stands; room:
#: for `project`; constants (n_constants,) and u (channels,): those of the run.
HELD = layout(
    "constraints n coordinates n_constraints n_positions n_entries values places room constants n_constants u channels"
)
SIGNATURE = types.void(types.int64, types.float64, types.int64)

#: Newton iterations; a distance from the constraints that is rounding, relative to the size of the coordinates.
MOST_CORRECTIONS, ROUNDING = 12, 1e-15
#: A distance, relative to the size of the coordinates, on whose way factors stay what they are, but for its square.
NEAR = 1e-6
#: An iteration that leaves more than this part of the distance has come down to rounding, or leads nowhere.
STAGNANT = 0.5


def projection_for(
    held: Held, n: int, constants: NDArray[np.float64], u: NDArray[np.float64]
) -> tuple[dict[str, int], dict[str, NDArray[Any]]]:
    """The addresses of `project` and of the record `held` that it wants, and the arrays that these lie in.

    n: of states; constants (n_constants,), u (channels,): of the run, where it changes them.
    """
    coordinates, m, pattern = held.coordinates, held.constraints, held.kernel.pattern
    arrays = {
        "values": np.zeros(pattern.entries),
        "places": pattern.places(),
        "room": np.zeros((coordinates + m) * (2 * coordinates + 3) + m + work_size(coordinates, m)),
    }
    fields = np.zeros(1, dtype=HELD)
    numbers = {
        "constraints": pointer(held.kernel.kernel, VECTOR_KERNEL, "constraints"),
        "n": n,
        "coordinates": coordinates,
        "n_constraints": m,
        "n_positions": held.positions,
        "n_entries": pattern.entries,
        "n_constants": len(constants),
        "channels": len(u),
    }
    for name, value in numbers.items():
        fields[name] = value
    for name, array in (arrays | {"constants": constants, "u": u}).items():
        fields[name] = address(array)
    addresses = {"project": pointer(_compiled(), SIGNATURE, "project"), "held": address(fields)}
    return addresses, arrays | {"held": fields}


@cache
def _compiled() -> Any:
    return compiled(SIGNATURE, _nrt=False)(project)


held_at, call_projection = record_at(HELD), calling(SIGNATURE)


def project(where, t, x):
    """Put the state at address x on the constraints of the record at an address, at t: positions, then velocities."""
    held = held_at(where)
    n, m = held.coordinates, held.n_constraints
    M, G, right, work = _masses(held, n, m), _gradients(held, n, m), _right(held, n, m), _work(held, n, m)
    residuals, q, v = _residuals(held, n, m), floats(x, n), floats(x + 8 * n, n)
    last, near = np.inf, False
    for _ in range(MOST_CORRECTIONS):
        _evaluate(held, t, x, n, m)
        if not near and not factorize(M, G, held.n_positions, residuals, q, work):
            return
        off, size = distance(n, m, residuals, work), magnitude(n, m, q, work)
        if not ROUNDING * size < off < STAGNANT * last:
            break
        _solve_for(G, work, right, residuals)
        for i in range(n):
            q[i] += right[i]
        last, near = off, off < NEAR * size
    if held.n_positions < m:
        factorize(M, G, m, residuals, q, work)
    whole = _whole(held, n, m)
    for j in range(m):
        residuals[j] = whole[n + j, n + 1]
    for _ in range(1 + near):
        _solve_for(G, work, right, residuals)
        for i in range(n):
            v[i] += right[i]
            for j in range(m):
                residuals[j] += G[j, i] * right[i]


def put_on(problem: Problem, t: NDArray[np.float64], states: NDArray[np.float64]) -> None:
    """Put states (m, n) at times t (m,) on the constraints of a problem that has some, no condition being held."""
    assert problem.held is not None
    table, n, constants = problem.inputs, states.shape[1], np.array(problem.constants)
    u = np.zeros(max(1, len(table.first)))
    found, kept_alive = projection_for(problem.held, n, constants, u)
    _project_rows(found["project"], found["held"], table, reader_for(table), t, u, address(states), n)
    del kept_alive, constants  # what the record points to


@compiled()
def _project_rows(function, held, table, reader, t, u, states, n):
    """Project the states at an address, n numbers each, at times t."""
    for i in range(len(t)):
        evaluate(table, reader, t[i], t[i], len(table.first), u)
        call_projection(function, (held, t[i], states + 8 * n * i))


@compiled(**LEAN)
def _solve_for(G, work, right, residuals):
    """The least change (n,), in right, that takes the residuals away."""
    m, n = G.shape
    for i in range(n):
        right[i] = 0.0
    for j in range(m):
        right[n + j] = -residuals[j]
    solve(n, m, work, right)


@compiled(**LEAN)
def _evaluate(held, t, x, n, m):
    """M, G and the residuals of positions."""
    whole = _whole(held, n, m)
    values = floats(held.values, held.n_entries)
    u, c = floats(held.u, held.channels), floats(held.constants, held.n_constants)
    call_kernel(held.constraints, t, floats(x, held.n), u, c, values)
    scatter(held.values, held.places, held.n_entries, held.room, (n + m) * (n + 2))
    M, G, residuals = _masses(held, n, m), _gradients(held, n, m), _residuals(held, n, m)
    for i in range(n):
        for k in range(i + 1):
            M[i, k] = whole[i, k]
    for j in range(m):
        residuals[j] = whole[n + j, n]
        for i in range(n):
            G[j, i] = whole[n + j, i]


@compiled(**VIEW)
def _whole(held, n, m):
    """What the kernel writes, (n + m, n + 2)."""
    return matrix(held.room, n + m, n + 2)


@compiled(**VIEW)
def _masses(held, n, m):
    return matrix(held.room + 8 * (n + m) * (n + 2), n, n)


@compiled(**VIEW)
def _gradients(held, n, m):
    return matrix(held.room + 8 * ((n + m) * (n + 2) + n * n), m, n)


@compiled(**VIEW)
def _right(held, n, m):
    return floats(held.room + 8 * ((n + m) * (2 * n + 2)), n + m)


@compiled(**VIEW)
def _residuals(held, n, m):
    return floats(held.room + 8 * ((n + m) * (2 * n + 3)), m)


@compiled(**VIEW)
def _work(held, n, m):
    return floats(held.room + 8 * ((n + m) * (2 * n + 3) + m), compiled_work_size(n, m))
