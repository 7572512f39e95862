"""The pieces of a run: of each step its states at Chebyshev's points, as many as give the step's polynomial.

A run that is told to writes down these instead of points (see `log`) and hands them over as it goes: however long it
is, it needs no more room than one of its slices.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN

Numbers = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Recorder:
    """Where a run hands its pieces to: take(t, x), t (k, degree + 1) in s, x (k, degree + 1, n_states), its to keep.

    steps, until: the run ends after so many steps, or once it has passed this time, s; by either.
    """

    take: Callable[[Numbers, Numbers], Any]
    steps: int
    until: float


@compiled(**LEAN)
def state_within(piece, points, theta, state):
    """Write the state (n,) at part theta of a piece (degree + 1, n), its points as in `turns`.

    By the barycentric formula of these points (J.-P. Berrut, L. N. Trefethen, SIAM Review 46 (2004) 501-517).
    """
    last = len(points) - 1
    for i in range(len(state)):
        state[i] = 0.0
    total = 0.0
    for k in range(last + 1):
        if theta == points[k]:
            for i in range(len(state)):
                state[i] = piece[k, i]
            return
        weight = (1.0 - 2.0 * (k % 2)) * (0.5 if k in (0, last) else 1.0) / (theta - points[k])
        total += weight
        for i in range(len(state)):
            state[i] += weight * piece[k, i]
    for i in range(len(state)):
        state[i] /= total


@compiled(**LEAN)
def piece_of(t, time):
    """Which of the pieces t (k, degree + 1) a time lies in: the later one where two meet, else the nearest."""
    low, high = 0, len(t)
    while high - low > 1:
        middle = (low + high) // 2
        if t[middle, 0] <= time:
            low = middle
        else:
            high = middle
    return low


@compiled(**LEAN)
def part_of(t, p, time):
    """Which part of piece p, 0 to 1, a time is."""
    length = t[p, -1] - t[p, 0]
    return min(1.0, max(0.0, (time - t[p, 0]) / length)) if length > 0.0 else 0.0
