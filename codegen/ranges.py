"""Rows that differ only by numbers that count, as one:

    ("q_1", "axle 1"), ("q_2", "axle 2") -> ("q_{1..2}", "axle {1..2}")

`runner.ranges` reads them.
"""

import re
from collections.abc import Sequence
from typing import Any

_NUMBER = re.compile("(0|[1-9][0-9]*)(?![0-9])")

#: A row of a table: a name, or a tuple that begins with one.
Row = Any


def kind(name: str) -> str:
    """A name without its numbers."""
    return re.sub("[0-9]+", "", name)


def compressed(rows: Sequence[Row]) -> list[Row]:
    """The rows, those that count together as one; one with braces of its own stays, as they say what a range is."""
    found: list[Row] = []
    at = 0
    while at < len(rows):
        length = _run(rows[at:])
        found.append(_ranged(rows[at], rows[at + 1], length) if length > 1 else rows[at])
        at += length
    return found


def _run(rows: Sequence[Row]) -> int:
    """How many rows from the first on count together."""
    length = 1
    while length < len(rows) and _follows(rows[0], rows[1], rows[length], length):
        length += 1
    return length


def _follows(first: Row, second: Row, row: Row, steps: int) -> bool:
    """Whether a row is the first with the numbers that rise to the second risen by `steps`, its name's among them."""
    parts, following, last = (list(map(_parts, _texts(each))) for each in (first, second, row))
    if _others(first) != _others(row) or any("{" in text or "}" in text for text in _texts(first)):
        return False
    counted = [_counted(*each, steps) for each in zip(parts, following, last, strict=True)]
    return None not in counted and bool(counted[0])


def _counted(first: list[str], second: list[str], last: list[str], steps: int) -> list[int] | None:
    """Which parts of a text count up; None where the last is no such text."""
    if not len(first) == len(second) == len(last):
        return None
    rising = [k for k in range(1, len(first), 2) if second[k] == str(int(first[k]) + 1)]
    expected = [str(int(part) + steps) if k in rising else part for k, part in enumerate(first)]
    return rising if last == expected else None


def _ranged(first: Row, second: Row, length: int) -> Row:
    texts = []
    for one, other in zip(map(_parts, _texts(first)), map(_parts, _texts(second)), strict=True):
        ranged = [a if a == b else f"{{{a}..{int(a) + length - 1}}}" for a, b in zip(one, other, strict=True)]
        texts.append("".join(ranged))
    if isinstance(first, str):
        return texts[0]
    following = iter(texts)
    return tuple(next(following) if isinstance(item, str) else item for item in first)


def _texts(row: Row) -> list[str]:
    return [row] if isinstance(row, str) else [item for item in row if isinstance(item, str)]


def _others(row: Row) -> list[Any]:
    return [] if isinstance(row, str) else [item for item in row if not isinstance(item, str)]


def _parts(text: str) -> list[str]:
    """Literal text and numbers in turn, literal text first."""
    return _NUMBER.split(text)
