"""The compiled functions that Python calls for a single run."""

from qddot.runner.exact.balance import begin
from qddot.runner.exact.linear import linearize
from qddot.runner.exact.propagate import propagate, start


def begin_run(s, c, A, B, x):
    """Put A and B for constants c, and the state x (n,) where `run_slice` finds them.

    A (n, n), B (n, channels + 1): room.
    """
    linearize(s, c, A, B)
    begin(s, A, B, x)
    start(s)


def run_slice(s, most):
    """Go on until the end, or until about `most` row operations are done; returns a Status."""
    return propagate(s, most)
