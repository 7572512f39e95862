"""What a state is kept on: the record of a model's constraints, and the parts of the room that it points to."""

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.constrained_work import compiled_work_size
from qddot.runner.machine.memory import LEAN, VIEW, floats, layout, matrix, record_at
from qddot.runner.machine.pointers import call_kernel
from qddot.runner.matrices import scatter

#: What a state is kept on, in addresses and lengths. constraints: their kernel, and how many there are of them, on
#: positions the first n_positions; values, places (n_entries,): what the kernel writes, and where that stands; room:
#: for `project`; constants (n_constants,) and u (channels,): those of the run; solver: of few unknowns, 0 of more.
HELD = layout(
    "constraints n coordinates n_constraints n_positions n_entries values places room constants n_constants u channels "
    "solver"
)
held_at = record_at(HELD)


@compiled(**LEAN)
def evaluate_constraints(held, t, x, n, m):
    """M, G and the residuals of positions."""
    whole = whole_of(held, n, m)
    values = floats(held.values, held.n_entries)
    u, c = floats(held.u, held.channels), floats(held.constants, held.n_constants)
    call_kernel(held.constraints, t, floats(x, held.n), u, c, values)
    scatter(held.values, held.places, held.n_entries, held.room, (n + m) * (n + 2))
    M, G, residuals = masses_of(held, n, m), gradients_of(held, n, m), residuals_of(held, n, m)
    for i in range(n):
        for k in range(i + 1):
            M[i, k] = whole[i, k]
    for j in range(m):
        residuals[j] = whole[n + j, n]
        for i in range(n):
            G[j, i] = whole[n + j, i]


@compiled(**VIEW)
def whole_of(held, n, m):
    """What the kernel writes, (n + m, n + 2)."""
    return matrix(held.room, n + m, n + 2)


@compiled(**VIEW)
def masses_of(held, n, m):
    """The lower half of M, (n, n)."""
    return matrix(held.room + 8 * (n + m) * (n + 2), n, n)


@compiled(**VIEW)
def gradients_of(held, n, m):
    """G, (m, n)."""
    return matrix(held.room + 8 * ((n + m) * (n + 2) + n * n), m, n)


@compiled(**VIEW)
def right_of(held, n, m):
    """Right side and solution, (n + m,)."""
    return floats(held.room + 8 * ((n + m) * (2 * n + 2)), n + m)


@compiled(**VIEW)
def residuals_of(held, n, m):
    """Residuals, (m,)."""
    return floats(held.room + 8 * ((n + m) * (2 * n + 3)), m)


@compiled(**VIEW)
def work_of(held, n, m):
    """The workspace of the solution."""
    return floats(held.room + 8 * ((n + m) * (2 * n + 3) + m), compiled_work_size(n, m))
