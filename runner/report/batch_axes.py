"""What a batch is looked at over: the axes of its sweep that a person would choose, and whether they are a grid."""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.batch.results import Results

Vector = NDArray[np.float64]


def longest(results: Results) -> list[str]:
    """The axes to draw over where nobody said: the longest one or two; of sampled ones those that are no mere numbers
    of something, such as seeds of random roads.
    """
    found: list[tuple[int, str]] = []
    for names, size in zip(results.data.attrs["groups"], results.data.attrs["shape"], strict=True):
        drawn = [name for name in names if name in results.data.attrs["sampled"]]
        smooth = [name for name in drawn if np.issubdtype(results.column(name).dtype, np.floating)]
        found += [(size, name) for name in (smooth or names[:1]) if size > 1]
    most = [name for _, name in sorted(found, key=lambda each: -each[0])[:2]]
    chosen = [axis for axis in results.axes if axis in most]
    return chosen if all(numeric(results, name) for name in chosen) else chosen[:1]


def numeric(results: Results, name: str) -> bool:
    """Whether a column holds numbers; others hold words."""
    return np.issubdtype(results.column(name).dtype, np.number)


def gridded(x: Vector, y: Vector) -> bool:
    """Whether runs at these places fill a grid: as many of them as it has nodes, or more."""
    return len(np.unique(x)) * len(np.unique(y)) <= len(x)


def grid(x: Vector, y: Vector, z: Vector) -> tuple[Vector, Vector, Vector]:
    """Columns (n,), rows (m,) and the mean (m, n) of z over the runs at each node, NaN where none has a value."""
    columns, rows = np.unique(x), np.unique(y)
    place = np.searchsorted(rows, y) * len(columns) + np.searchsorted(columns, x)
    known = np.isfinite(z)
    total = np.bincount(place[known], z[known], minlength=len(columns) * len(rows))
    count = np.bincount(place[known], minlength=len(columns) * len(rows))
    with np.errstate(invalid="ignore"):
        return columns, rows, (total / count).reshape(len(rows), len(columns))
