"""Signals made smoother: the mean of a signal over a window that slides along it."""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import finite, shown
from qddot.runner.inputs.piece import AMPLITUDE, C0, C1, C2, C3, COLUMNS, START
from qddot.runner.inputs.signal import Signal

Floats = NDArray[np.float64]


def smoothed(signal: Signal, width: float) -> Signal:
    """The mean of a signal over a window of this width around each instant, exactly.

    A jump becomes a ramp, a kink a parabola: each call makes one more derivative continuous, so that what jumps has a
    second rate after two, and what is read as straight lines after one. width: in the signal's argument, s for a course
    over time; smooth a signal before it is shifted.
    Raises ValueError where a piece is a sine, or of third degree, which would be of fourth then.
    """
    if not isinstance(signal, Signal):
        raise ValueError(f"signal is {shown(signal)}, expected a signal, such as qddot.signal.table gives")
    width = finite("width", width)
    if not width > 0.0:
        raise ValueError(f"width is {width!r}, expected a positive number")
    pieces = signal.pieces
    for column, what in ((AMPLITUDE, "holds a sine"), (C3, "is of third degree")):
        if (found := np.flatnonzero(pieces[:, column])).size:
            raise ValueError(
                f"the piece of the signal at {pieces[found[0], START]:.9g} {what}: its mean is no piece of a signal; "
                'smooth a table of kind "linear", or sample the course that is wanted, qddot.signal.sampled'
            )
    half = 0.5 * width
    starts = pieces[1:, START]
    knots = np.union1d(starts - half, starts + half)
    knots = np.concatenate([[knots[0] - width if len(knots) else pieces[0, START]], knots])
    # both ends of the window lie within one piece each from a knot to the next
    inside = knots + 0.5 * np.append(np.diff(knots), width)
    ahead, behind = (np.searchsorted(starts, inside + side, side="right") for side in (half, -half))
    rows = np.zeros((len(knots), COLUMNS))
    rows[:, START] = knots
    for row, knot, a, b in zip(rows, knots, ahead, behind, strict=True):
        row[C0 : C3 + 1] = _mean(pieces, knot, half, int(a), int(b))
    edges = np.union1d(signal.breakpoints - half, signal.breakpoints + half)
    return Signal(rows, edges, signal.rate, signal.offset)


def _mean(pieces: Floats, at: float, half: float, a: int, b: int) -> Floats:
    """The mean from at - half, in piece b, to at + half, in piece a, in powers of what is added to `at`."""
    if a == b:
        value, slope, bend = _powers(pieces[a], at)
        return np.array([value + bend * half * half / 3.0, slope, bend, 0.0])
    ends = [at - half, *pieces[b + 1 : a + 1, START], at + half]
    spans = zip(range(b, a + 1), ends[:-1], ends[1:], strict=True)
    total = sum(_integral(pieces[k], start, end) for k, start, end in spans)
    change = np.array(_powers(pieces[a], at + half)) - np.array(_powers(pieces[b], at - half))
    return np.array([total, *(change / (1.0, 2.0, 3.0))]) / (2.0 * half)


def _powers(piece: Floats, at: float) -> tuple[float, float, float]:
    """A piece in powers of what is added to `at`."""
    s = at - piece[START]
    return piece[C0] + s * (piece[C1] + s * piece[C2]), piece[C1] + 2.0 * s * piece[C2], piece[C2]


def _integral(piece: Floats, start: float, end: float) -> float:
    value, _, bend = _powers(piece, 0.5 * (start + end))
    span = end - start
    return float(span * (value + bend * span * span / 12.0))
