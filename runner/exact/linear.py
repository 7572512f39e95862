"""A and B of x' = A x + B [u, 1], from the kernels that every model has."""

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, first_item, floats
from qddot.runner.machine.pointers import call_kernel
from qddot.runner.matrices import scatter


@compiled(**LEAN)
def linearize(s, c, A, B):
    """Write A (n, n) and B (n, channels + 1) for constants c; at rest without inputs, as they are the same anywhere."""
    n, columns = s.n, s.channels + 1
    x, u, values = floats(s.zeros, n), floats(s.zeros, s.channels), floats(s.entries, s.entry_room)
    call_kernel(s.jacobian, 0.0, x, u, c, values)
    scatter(s.entries, s.A_places, s.A_entries, first_item(A), n * n)
    call_kernel(s.input_jacobian, 0.0, x, u, c, values)
    scatter(s.entries, s.B_places, s.B_entries, first_item(B), n * columns)
    offset = floats(s.y, n)
    call_kernel(s.rhs, 0.0, x, u, c, offset)
    for i in range(n):
        B[i, columns - 1] = offset[i]
