"""Which tables' pieces lanes find by computing: even ones, and those of which a guide of even buckets tells enough."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.piece import AMPLITUDE, C1, C3, START
from qddot.runner.inputs.signal import jumps
from qddot.runner.lanes.tables import EVEN, GUIDED, PIECE

Pieces = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Pieces from which on it is worth computing which one holds, and how far their lengths may differ by rounding.
FEW, SAME = 16, 1e-13
#: Buckets of a guide for each piece at most, and the pieces that may begin within one.
MOST_BUCKETS, MOST_HOPS = 4, 3
#: A bucket is taken to begin this part of it earlier than it does, because rounding may put a time into the wrong one.
EARLIER = 1e-9
_NO_GUIDE = np.zeros(0, dtype=np.int64)


def is_even(pieces: Pieces) -> bool:
    """Whether all pieces but the first and last are of one length, without sines, and the first is constant."""
    lengths = np.diff(pieces[1:, START])
    return _suits(pieces) and bool(np.ptp(lengths) <= SAME * lengths.mean() * len(lengths))


def _suits(pieces: Pieces) -> bool:
    """Whether pieces may be found by their arguments. Not where a value jumps: rounding would choose its side."""
    many = len(pieces) >= FEW + 2 and not pieces[:, AMPLITUDE].any() and not pieces[0, C1 : C3 + 1].any()
    return many and not jumps(pieces).size


def guide_for(pieces: Pieces) -> Integers:
    """The piece at which each bucket begins, one before and one behind the table included; empty where none is good."""
    if not _suits(pieces):
        return _NO_GUIDE
    starts, buckets = pieces[1:, START], len(pieces) - 2
    for _ in range(MOST_BUCKETS.bit_length()):
        width = (starts[-1] - starts[0]) / buckets
        edges = starts[0] + (np.arange(1, buckets + 1) - EARLIER) * width
        guide = np.concatenate([[0, 1], np.searchsorted(starts, edges[:-1], side="right"), [len(pieces) - 1]])
        if hops_of(guide) <= MOST_HOPS:
            return guide.astype(np.int64)
        buckets *= 2
    return _NO_GUIDE


def hops_of(guide: Integers) -> int:
    """Comparisons needed after a look at the guide."""
    return int(np.diff(guide).max(initial=0)) if len(guide) else 0


def ways(table: Integers, pieces: list[Pieces], first: Integers) -> tuple[Integers, dict[str, Any]]:
    """How each channel finds its pieces (channels,), and the guides of all tables one behind the other.

    table (runs, channels): which of the piece arrays a run reads; first (tables,): where that begins among all pieces.
    buckets, guide_first (tables,): how many buckets the guide of a table has, and where in `guide` it begins.
    """
    even = np.array([is_even(each) for each in pieces], dtype=bool)
    way = np.where(even[table].all(axis=0), EVEN, 0)
    asked = np.unique(table[:, way != EVEN])
    guides = [guide_for(each) if k in asked else _NO_GUIDE for k, each in enumerate(pieces)]
    lengths = np.array([len(each) for each in guides], dtype=np.int64)
    way = np.where((way != EVEN) & (lengths[table] > 0).all(axis=0), GUIDED, way)
    return way.astype(np.int64), {
        "guide": PIECE * np.concatenate([*(each + begin for each, begin in zip(guides, first, strict=True)), [0]]),
        "guide_first": np.cumsum(lengths) - lengths,
        "buckets": np.maximum(lengths - 2, 0),
        "hops": max(map(hops_of, guides), default=0),
    }
