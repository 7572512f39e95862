"""Conditions in a model: during a step each is held on its side, and the step ends where it would leave it.

What a condition compares is a series too, so where it changes its sign is a root of a polynomial.
"""

import numpy as np

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, VIEW, floats
from qddot.runner.machine.series_calls import call_series

#: An interval of this part of a step is not divided any further in the search for a change of sign.
_SHORTEST = 1.0 / 1024
#: A step that is shorter than its length by the method is none where it is this part of it.
NOTHING = 1e-14


@compiled(**VIEW)
def sides(space):
    """For each condition 1 where what it compares is below zero, (n_sides,)."""
    return floats(space.sides_at, space.n_sides)


@compiled(**LEAN)
def compared(space, i, k):
    """Coefficient k of what condition i compares, positive on the side where it is held."""
    value = floats(space.compared_at + space.side_stride * k, space.n_sides)[i]
    return -value if sides(space)[i] != 0.0 else value


@compiled(**LEAN)
def choose_sides(space):
    """Put every condition on the side where it is, or to which it goes where it is on the line."""
    for _ in range(space.n_sides + 1):  # one may stand within another
        call_series(space.series, space.memory, 3)
        for i in range(space.n_sides):
            for k in range(3):
                value = compared(space, i, k)
                if value != 0.0:
                    if value < 0.0:
                        turn(space, i)
                    break


@compiled(**LEAN)
def turn(space, i):
    """Let condition i change its side."""
    found = sides(space)
    found[i] = 1.0 - found[i]


@compiled(**LEAN)
def value_at(space, i, start, time):
    """What condition i compares at a time of the step, its first coefficient being `start`."""
    total = 0.0
    for k in range(space.highest - 1, 0, -1):
        total = time * (total + compared(space, i, k))
    return start + total


@compiled(**LEAN)
def steepest(space, i, h):
    """A bound of the slope of what condition i compares, over the step."""
    total = 0.0
    for k in range(space.highest - 1, 0, -1):
        total = total * h + k * abs(compared(space, i, k))
    return total


@compiled(**LEAN)
def leaves_at(space, i, h):
    """When condition i leaves its side in a step h: just beyond; infinite where it does not."""
    start = compared(space, i, 0)
    if start <= 0.0:  # it has just come here, to within rounding
        if compared(space, i, 1) < 0.0:
            return 0.0
        start = 0.0
    slope = steepest(space, i, h)
    if start > slope * h:
        return np.inf
    low, width = 0.0, h
    while low < h:
        high = min(low + width, h)
        if value_at(space, i, start, 0.5 * (low + high)) > 0.5 * slope * (high - low):
            low, width = high, 2.0 * width
        elif width > _SHORTEST * h:
            width *= 0.5
        elif value_at(space, i, start, high) < 0.0:
            return bisected(space, i, start, low, high)
        else:
            low = high
    return np.inf


@compiled(**LEAN)
def bisected(space, i, start, low, high):
    """Where condition i changes its sign, between times on its side and beyond; a time beyond."""
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return high
        if value_at(space, i, start, middle) < 0.0:
            high = middle
        else:
            low = middle


@compiled(**LEAN)
def first_to_leave(space, h):
    """The condition that first leaves its side in a step h, and when; -1 and h where none does."""
    found, when = -1, h
    for i in range(space.n_sides):
        time = leaves_at(space, i, when)
        if time <= when:
            found, when = i, time
    return found, when
