"""The order in which a symmetric matrix is eliminated, and which entries its factors have then.

A row that is eliminated couples all rows behind it that it holds: a hull before its wheels couples each of these with
each other, behind them none. An order of minimum degree takes the row that holds fewest, again and again (A. George,
J. W. H. Liu, SIAM Review 31 (1989) 1-19); the author's stays where that saves nothing.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from heapq import heapify, heappop, heappush
from itertools import groupby

#: Places of entries beside the diagonal, each on either side of it.
Pairs = Iterable[tuple[int, int]]


@dataclass(frozen=True)
class Ordering:
    """An order of elimination; rows: of each step the later ones whose rows it changes, rising."""

    order: tuple[int, ...]
    rows: tuple[tuple[int, ...], ...]

    @cached_property
    def steps(self) -> int:
        """How many entries the factors have beside the diagonal, and products of two of a row are taken for them."""
        return sum(len(row) * (len(row) + 3) // 2 for row in self.rows)

    @cached_property
    def places(self) -> tuple[int, ...]:
        """Of each row of the matrix the step that eliminates it."""
        found = [0] * len(self.order)
        for place, row in enumerate(self.order):
            found[row] = place
        return tuple(found)

    @property
    def texts(self) -> list[str]:
        """A text for each step, `6:7,32-37`: the row of the matrix, and the later steps; `coupled` reads them."""
        return [f"{first}:{','.join(_ranges(row))}" for first, row in zip(self.order, self.rows, strict=True)]


def ordering(pairs: Pairs, n: int) -> Ordering:
    """Of the author's order and one of minimum degree the one of fewer steps; the author's where both take as many."""
    pairs = {(k, j) for k, j in pairs if k != j}
    given = in_order(pairs, range(n))
    if all(len(row) <= 1 for row in given.rows):
        return given
    return min(given, in_order(pairs, _minimum_degree(pairs, n)), key=lambda each: each.steps)


def in_order(pairs: Pairs, order: Sequence[int]) -> Ordering:
    """What an elimination in this order couples."""
    places = {row: place for place, row in enumerate(order)}
    behind: list[set[int]] = [set() for _ in order]
    for pair in pairs:
        first, last = sorted(places[row] for row in pair)
        if first != last:
            behind[first].add(last)
    for row in behind:
        if row:
            behind[min(row)] |= row - {min(row)}
    return Ordering(tuple(order), tuple(tuple(sorted(row)) for row in behind))


def _minimum_degree(pairs: Pairs, n: int) -> list[int]:
    """Of rows that hold as many, those first that held fewest to begin with, as the last wheel does before the hull."""
    beside: dict[int, set[int]] = {row: set() for row in range(n)}
    for k, j in pairs:
        beside[k].add(j)
        beside[j].add(k)
    held = {row: len(others) for row, others in beside.items()}
    heap = [(count, count, row) for row, count in held.items()]
    heapify(heap)
    order: list[int] = []
    while beside:
        count, _, row = heappop(heap)
        if row not in beside or count != len(beside[row]):
            continue  # it was taken, or holds more or fewer by now, and stands there once more
        if count == len(beside) - 1:
            return [*order, *sorted(beside, key=lambda left: (held[left], left))]  # all that are left hold each other
        others = beside.pop(row)
        order.append(row)
        for other in others:
            beside[other] |= others
            beside[other] -= {row, other}
            heappush(heap, (len(beside[other]), held[other], other))
    return order


def _ranges(numbers: Sequence[int]) -> list[str]:
    """Rising numbers, those that follow each other as a range."""
    together = groupby(enumerate(numbers), lambda pair: pair[1] - pair[0])
    runs = ([number for _, number in run] for _, run in together)
    return [str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs]
