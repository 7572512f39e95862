"""The cubic through states and slopes at both ends of a step: dense output of methods that have none of their own."""

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN

#: Its degree, and how fast its error falls with the length of the step.
DEGREE, ORDER = 3, 4


@compiled(**LEAN)
def cubic(theta, h, x, slope, x_end, slope_end, within):
    """Write the states at part theta of a step of length h; all others (n,)."""
    rest = 1.0 - theta
    lead, pull, pull_end = theta * theta * (1.0 + 2.0 * rest), h * theta * rest * rest, -h * theta * theta * rest
    for i in range(len(within)):
        within[i] = x[i] + lead * (x_end[i] - x[i]) + (pull * slope[i] + pull_end * slope_end[i])
