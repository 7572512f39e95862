"""The compiled functions that Python calls for a single run."""

from qddot.runner.exact.balance import begin
from qddot.runner.exact.linear import linearize
from qddot.runner.exact.propagate import propagate, start


def begin_run(s, table, c, A, B, x):
    """Put the inputs, A and B for constants c, and the state x (n,) where `run_slice` finds them.

    A (n, n), B (n, channels + 1): room.
    """
    s.pieces, s.n_pieces = table.pieces.ctypes.data, len(table.pieces)
    s.first, s.last = table.first.ctypes.data, table.last.ctypes.data
    s.rate, s.offset, s.order = table.rate.ctypes.data, table.offset.ctypes.data, table.order.ctypes.data
    linearize(s, c, A, B)
    begin(s, A, B, x)
    start(s)


def run_slice(s, most):
    """Go on until the end, or until about `most` row operations are done; returns a Status."""
    return propagate(s, most)
