"""A state put back on the constraints of its model: by the nearest way in the metric of the mass matrix.

Positions by Newton's iteration, M dq + G' l = 0 with G dq = -f(q, t), then velocities by solution of the same,
G dv = -(G v + df/dt). E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.2; in the metric
of M that is what impulses of the constraints would do. Constraints on positions stand first.

Loops call it by its address: it is no part of them, and compiled for models with constraints alone.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from qddot.runner.abi import VECTOR_KERNEL
from qddot.runner.frame.held import (
    HELD,
    evaluate_constraints,
    gradients_of,
    held_at,
    masses_of,
    residuals_of,
    right_of,
    whole_of,
    work_of,
)
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.constrained_factors import distance, factorize, magnitude, solve
from qddot.runner.machine.constrained_pivots import MOST_WRITTEN_OUT, call_solver, solver
from qddot.runner.machine.constrained_work import work_size
from qddot.runner.machine.memory import LEAN, address, floats
from qddot.runner.machine.pointers import calling, pointer
from qddot.runner.problem import Held, Problem

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
        "solver": solver(coordinates, m) if m == held.positions and coordinates + m <= MOST_WRITTEN_OUT else 0,
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


call_projection = calling(SIGNATURE)


def project(where, t, x):
    """Put the state at address x on the constraints of the record at an address, at t: positions, then velocities."""
    held = held_at(where)
    if held.solver != 0:
        project_few(held, t, x)
    else:
        project_many(held, t, x)


@compiled(**LEAN)
def project_few(held, t, x):
    """Where M and G are eliminated in no time: by solutions alone, each with those of the state as it is."""
    n, m = held.coordinates, held.n_constraints
    M, right = masses_of(held, n, m), right_of(held, n, m)
    q, v = floats(x, n), floats(x + 8 * n, n)
    last = np.inf
    for _ in range(MOST_CORRECTIONS):
        evaluate_constraints(held, t, x, n, m)
        _correct(held, q)
        off = _norm(M, right)
        if not off < np.inf:
            return
        if not ROUNDING * _norm(M, q) < off < STAGNANT * last:
            break
        for i in range(n):
            q[i] += right[i]
        last = off
    _turn_to_velocities(held)
    _correct(held, q)
    for i in range(n):
        v[i] += right[i]


@compiled(**LEAN)
def _correct(held, q):
    """The least change (n,), in `right_of`, that takes residuals away."""
    n, m = held.coordinates, held.n_constraints
    _ask(held)
    M, G, right = masses_of(held, n, m), gradients_of(held, n, m), right_of(held, n, m)
    call_solver(held.solver, (M, G, right, residuals_of(held, n, m), q, work_of(held, n, m)))


@compiled(**LEAN)
def _correct_by_factors(held):
    """The same by the factors in the workspace."""
    n, m = held.coordinates, held.n_constraints
    _ask(held)
    solve(n, m, work_of(held, n, m), right_of(held, n, m))


@compiled(**LEAN)
def _ask(held):
    """The right side for a change that takes the residuals away, and costs least."""
    n, m = held.coordinates, held.n_constraints
    right, residuals = right_of(held, n, m), residuals_of(held, n, m)
    for i in range(n):
        right[i] = 0.0
    for j in range(m):
        right[n + j] = -residuals[j]


@compiled(**LEAN)
def _turn_to_velocities(held):
    """Put the residuals of velocities in the place of those of positions."""
    n, m = held.coordinates, held.n_constraints
    whole, residuals = whole_of(held, n, m), residuals_of(held, n, m)
    for j in range(m):
        residuals[j] = whole[n + j, n + 1]


@compiled(**LEAN)
def _norm(M, q):
    """The size of a change of coordinates, or of these, in the metric of their masses; what has none counts most."""
    n, largest, total = M.shape[0], 0.0, 0.0
    for i in range(n):
        largest = max(largest, M[i, i])
    for i in range(n):
        total += (M[i, i] if M[i, i] > 0.0 else largest) * q[i] * q[i]
    return np.sqrt(total)


@compiled(**LEAN)
def project_many(held, t, x):
    """Where factors are dear: a state that is near keeps its first ones, as M and G change little on the way."""
    n, m = held.coordinates, held.n_constraints
    M, G, right, work = masses_of(held, n, m), gradients_of(held, n, m), right_of(held, n, m), work_of(held, n, m)
    residuals, q, v = residuals_of(held, n, m), floats(x, n), floats(x + 8 * n, n)
    last, near = np.inf, False
    for _ in range(MOST_CORRECTIONS):
        evaluate_constraints(held, t, x, n, m)
        if not near and not factorize(M, G, held.n_positions, residuals, q, work):
            return
        off, size = distance(n, m, residuals, work), magnitude(n, m, q, work)
        if not ROUNDING * size < off < STAGNANT * last:
            break
        _correct_by_factors(held)
        for i in range(n):
            q[i] += right[i]
        last, near = off, off < NEAR * size
    if held.n_positions < m:
        factorize(M, G, m, residuals, q, work)
    _turn_to_velocities(held)
    for _ in range(1 + near):
        _correct_by_factors(held)
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
