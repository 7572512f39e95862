"""Curved pulses no longer than a constant step, which one step would take for something else.

The slopes of one step see a half-sine at its ends and its middle: Euler's and Heun's method find nothing there, RK4
1.05 of its impulse. Such a pulse is gone through in several steps. Straight lines need none: every method lands on
their kinks anyway.
"""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.instants import ROUNDING
from qddot.runner.inputs.signal import AMPLITUDE, C2, C3, START, InputTable

Vector = NDArray[np.float64]

#: Steps for what is no longer than one: RK4 then finds the impulse of a half-sine to 1e-6, Heun's method to 0.4 %.
PARTS = 16


def stops_within(pieces: Vector, breakpoints: Vector, longest: float) -> Vector:
    """Arguments (m,) at which to stop between rising breakpoints (n,) up to `longest` apart with curves between."""
    gaps, short = np.diff(breakpoints), _short(breakpoints, longest)
    if not short.any():
        return np.empty(0)
    curved = (pieces[:, [C2, C3, AMPLITUDE]] != 0).any(axis=1)
    count = np.concatenate([[0], np.cumsum(curved)])
    place = np.searchsorted(pieces[:, START], breakpoints)
    short &= count[place[1:]] > count[place[:-1]]
    return np.asarray(breakpoints[:-1][short, None] + gaps[short, None] * np.arange(1, PARTS) / PARTS).ravel()


def _short(breakpoints: Vector, longest: float) -> NDArray[np.bool_]:
    """Between which breakpoints and their next ones is no more than `longest`, but for rounding."""
    return np.asarray(np.diff(breakpoints) - longest <= ROUNDING * np.abs(breakpoints[1:]))


def with_stops(table: InputTable, step: float) -> Vector:
    """The breakpoints of a table (n,), rising, and the stops within what its channels have no longer than a step."""
    if not _short(table.breakpoints, step).any():
        return table.breakpoints
    found = [table.breakpoints]
    for i in np.flatnonzero(table.rate):
        pieces, rate, offset = table.pieces[table.first[i] : table.last[i] + 1], table.rate[i], table.offset[i]
        starts = pieces[:, START]
        own = starts[np.isin((starts - offset) / rate, table.breakpoints)]
        found.append((stops_within(pieces, own, step * abs(rate)) - offset) / rate)
    return np.unique(np.concatenate(found))
