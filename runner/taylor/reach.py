"""The end of a step: under constraints one that lies too far beside them is none, and the step becomes shorter.

A series under constraints that nearly depend on each other there, as of a mechanism in line, loses its digits from
order to order, and its last terms do not tell. The distance of its end from the constraints does, for nothing.
"""

from qddot.runner.frame.space import project_at_end, row_address, states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.taylor.space import ATOL, NEW, RTOL, WITHIN, coefficient, sum_series

#: Tolerances by which constraints may move the end of a step, which its error is about one of.
MOST_MOVED = 100.0


@compiled(**LEAN)
def reach(space, t, h, least):
    """Write the end of a step h from t to row NEW; returns its length, 0 where it would come down to `least`."""
    sum_series(space, h, NEW)
    if space.project == 0:
        return h
    while not stays(space, t, h):
        h *= 0.5
        if h <= least:
            return 0.0
        sum_series(space, h, NEW)
    return h


@compiled(**LEAN)
def stays(space, t, h):
    """Put the state in row NEW on the constraints; whether that moves it by no more than its error."""
    new, before = states(space, NEW), states(space, WITHIN)
    for i in range(space.n):
        before[i] = new[i]
    project_at_end(space, t, h, row_address(space, NEW))
    start, slope = coefficient(space, 0), coefficient(space, 1)
    relative, absolute = states(space, RTOL), states(space, ATOL)
    for i in range(space.n):
        size = abs(start[i]) + abs(h * slope[i])
        if not abs(new[i] - before[i]) <= MOST_MOVED * max(relative[i] * size, absolute[i]):
            return False
    return True
