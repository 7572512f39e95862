"""Balancing: a diagonal of powers of two that makes rows and columns of A alike.

Positions and velocities differ by the frequencies of a mechanism; balanced, the norm of A is about its largest
frequency rather than its square, which halves the squarings (Parlett, Reinsch, Numer. Math. 13 (1969) 293-304).
"""

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, LEAN, floats

#: A row and column are rescaled where this lessens the sum of their norms to less than this part.
GAIN = 0.95
#: Sweeps over all states; the usual number is 2 to 4.
MOST_SWEEPS = 30
#: A scale changes by no more than 2 to this power in one sweep.
MOST_DOUBLINGS = 60


@compiled(**LEAN)
def sums(A, i):
    """Norms of column and row i without the diagonal."""
    column, row = 0.0, 0.0
    for j in range(len(A)):
        if j != i:
            column += abs(A[j, i])
            row += abs(A[i, j])
    return column, row


@compiled(**LEAN)
def factor_for(column, row):
    """The power of two by which column / row comes nearest to 1."""
    factor = 1.0
    for _ in range(MOST_DOUBLINGS):
        if column * factor * factor >= 0.5 * row:
            break
        factor *= 2.0
    for _ in range(MOST_DOUBLINGS):
        if column * factor * factor < 2.0 * row:
            break
        factor *= 0.5
    return factor


@compiled(**LEAN)
def balance(A, B, scale):
    """Replace A by D^-1 A D and B by D^-1 B, D = diag(scale); A (n, n), B (n, m), scale (n,) starts as ones."""
    n = len(A)
    for _ in range(MOST_SWEEPS):
        changed = False
        for i in range(n):
            column, row = sums(A, i)
            if column == 0.0 or row == 0.0:
                continue
            factor = factor_for(column, row)
            if column * factor + row / factor >= GAIN * (column + row):
                continue
            changed = True
            scale[i] *= factor
            for j in range(n):
                A[i, j] /= factor
            for j in range(n):
                A[j, i] *= factor
            for j in range(B.shape[1]):
                B[i, j] /= factor
        if not changed:
            break


@compiled(**LEAN)
def put_transposed(source, base):
    """Write the transpose of a matrix (n, count) in panels."""
    n, count = source.shape
    target = floats(base, BLOCK * -(-n // BLOCK) * count)
    for i in range(n):
        for j in range(count):
            target[BLOCK * (count * (i // BLOCK) + j) + i % BLOCK] = source[i, j]


@compiled(**LEAN)
def begin(s, A, B, x):
    """Balance A and B, which are overwritten, and put them and the state x (n,) where `run_slice` finds them."""
    n, scale, state = s.n, floats(s.scale, s.n), floats(s.x, s.n)
    for i in range(n):
        scale[i] = 1.0
    balance(A, B, scale)
    put_transposed(A, s.A)
    put_transposed(B, s.B)
    for i in range(n):
        state[i] = x[i] / scale[i]
    s.nu = 0.0
    for j in range(n):
        total = 0.0
        for i in range(n):
            total += abs(A[i, j])
        s.nu = max(s.nu, total)
