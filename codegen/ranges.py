"""Rows that differ only by numbers that count, as one:

    ("q_1", "axle 1"), ("q_2", "axle 2") -> ("q_{1..2}", "axle {1..2}")

`runner.ranges` reads them.
"""

import re
from collections.abc import Sequence
from typing import Any

from qddot.codegen.cells import LONGEST, Signature, runs

_NUMBER = re.compile("(0|[1-9][0-9]*)(?![0-9])")

#: A row of a table: a name, or a tuple that begins with one.
Row = Any


def kind(name: str) -> str:
    """A name without its numbers."""
    return re.sub("[0-9]+", "", name)


def numbers(name: Any) -> tuple[int, ...]:
    """The numbers in a name."""
    return tuple(map(int, re.findall("[0-9]+", str(name))))


def compressed(rows: Sequence[Row], *, turns: bool = False) -> list[Row]:
    """The rows, those that count together as one; one with braces of its own stays, as they say what a range is.

    turns: rows that take turns, m_1, k_1, m_2, k_2, ..., become a tuple of rows.
    """
    found: list[Row] = []
    at = 0
    for run in runs(_signed(rows), LONGEST if turns else 1):
        cell = rows[run.first : run.first + run.period]
        if all(any(steps[: _in_name(row)]) for row, steps in zip(cell, run.steps, strict=True)):
            found += _in_pairs(rows[at : run.first])
            ranged = [_ranged(row, steps, run.count) for row, steps in zip(cell, run.steps, strict=True)]
            found.append(tuple(ranged) if len(ranged) > 1 else ranged[0])
            at = run.behind
    return [*found, *_in_pairs(rows[at:])]


def _signed(rows: Sequence[Row]) -> list[Signature]:
    """Of each row what it is without its numbers, and these."""
    known: dict[Any, int] = {}
    found = []
    for k, row in enumerate(rows):
        parts = list(map(_parts, _texts(row)))
        own = k if any("{" in text or "}" in text for text in _texts(row)) else None
        what = (own, *(tuple(each[::2]) for each in parts), *_others(row))
        numbers = tuple(int(number) for each in parts for number in each[1::2])
        found.append(Signature(known.setdefault(what, len(known)), numbers))
    return found


def _in_name(row: Row) -> int:
    """How many numbers the name of a row has."""
    return len(_parts(_texts(row)[0])) // 2


def _in_pairs(rows: Sequence[Row]) -> list[Row]:
    """The rows, those that count together one by one as one, if there are two of them."""
    found: list[Row] = []
    at = 0
    while at < len(rows):
        length = _run(rows, at)
        steps = [b - a for a, b in zip(_numbers(rows[at]), _numbers(rows[at + 1]), strict=True)] if length > 1 else ()
        found.append(_ranged(rows[at], steps, length) if length > 1 else rows[at])
        at += length
    return found


def _numbers(row: Row) -> list[int]:
    return [int(number) for text in _texts(row) for number in _parts(text)[1::2]]


def _run(rows: Sequence[Row], at: int) -> int:
    """How many rows from this one on count together."""
    length = 1
    while at + length < len(rows) and _follows(rows[at], rows[at + 1], rows[at + length], length):
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


def _ranged(row: Row, steps: Sequence[int], length: int) -> Row:
    """A row for as many, of which each number goes so far from one to the next."""
    counted = iter(steps)
    texts = []
    for text in _texts(row):
        parts = _parts(text)
        parts[1::2] = [counting(int(part), next(counted), length) for part in parts[1::2]]
        texts.append("".join(parts))
    if isinstance(row, str):
        return texts[0]
    following = iter(texts)
    return tuple(next(following) if isinstance(item, str) else item for item in row)


def counting(first: int, step: int, count: int) -> str:
    """The text of so many numbers: {1..9}, {1..9..2}, or the first where they are all the same."""
    last = first + step * (count - 1)
    return f"{{{first}..{last}{f'..{step}' if step != 1 else ''}}}" if step else str(first)


def _texts(row: Row) -> list[str]:
    return [row] if isinstance(row, str) else [item for item in row if isinstance(item, str)]


def _others(row: Row) -> list[Any]:
    return [] if isinstance(row, str) else [item for item in row if not isinstance(item, str)]


def _parts(text: str) -> list[str]:
    """Literal text and numbers in turn, literal text first."""
    return _NUMBER.split(text)
