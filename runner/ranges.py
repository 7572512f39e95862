"""Rows of a generated module's tables that count: ("k_{6..10}", 65e3, "N/m", "stiffness, axle {1..5}") is five.

A range may say how far it counts at once: {1..9..2} is 1, 3, 5, 7, 9.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

_RANGE = re.compile(r"\{([0-9]+)\.\.([0-9]+)(?:\.\.(-?[1-9][0-9]*))?\}")
_PLACES = re.compile(rf"{_RANGE.pattern}:(?: (?:[0-9]+|{_RANGE.pattern}))*")
#: Rows that one may stand for.
MOST = 1_000_000


def expanded(rows: Iterable[Any]) -> list[Any]:
    """All rows, names or tuples that begin with one; a row with a range {first..last} in its name gives as many.

    A tuple of rows are rows that take turns: (("m_{1..2}", ...), ("k_{1..2}", ...)) is m_1, k_1, m_2, k_2.
    All ranges of a row count together; braces in the texts of a row without a range in its name mean nothing. Raises
    ValueError for a range that does not rise or for ranges of different lengths.
    """
    return [each for row in rows for each in (_in_turns(row) if take_turns(row) else _expanded(row))]


def take_turns(row: Any) -> bool:
    """Whether a row of a table is a tuple of rows."""
    return isinstance(row, tuple) and bool(row) and isinstance(row[0], tuple)


def _in_turns(rows: tuple[Any, ...]) -> Iterator[Any]:
    found = [list(_expanded(row)) for row in rows]
    if len({len(each) for each in found}) > 1:
        raise ValueError(f"{rows!r}: expected ranges of one length in rows that take turns")
    for each in zip(*found, strict=True):
        yield from each


def _expanded(row: Any) -> Iterator[Any]:
    name = row[0] if isinstance(row, tuple | list) and row else row
    if not isinstance(name, str) or not _RANGE.search(name):
        yield row
        return
    texts = [item for item in ([row] if isinstance(row, str) else row) if isinstance(item, str)]
    for step in range(_length(row, texts)):
        if isinstance(row, str):
            yield _at(row, step)
        else:
            yield tuple(_at(item, step) if isinstance(item, str) else item for item in row)


def placed(rows: Sequence[Any]) -> tuple[Any, ...]:
    """The columns of each row of a matrix: a text of ranges, "{0..9}: {0..9} {1..10}", gives those of as many rows.

    It says which rows these are; a tuple is the row behind all those before it. Raises ValueError for a text that is
    nothing of this kind, for rows that stand twice, and where one is missing between them.
    """
    found: dict[int, Any] = {}
    behind = 0
    for each in rows:
        for row, columns in _placed(each) if isinstance(each, str) else ((behind, each),):
            if row in found:
                raise ValueError(f"{each!r} gives row {row}, which is there already")
            found[row] = columns
            behind = max(behind, row + 1)
    if missing := set(range(behind)) - found.keys():
        raise ValueError(f"has no row {min(missing)}")
    return tuple(found[row] for row in range(behind))


def _placed(text: str) -> Iterator[tuple[int, tuple[int, ...]]]:
    if not _PLACES.fullmatch(text):
        raise ValueError(f"{text!r}: expected the ranges of rows and columns, such as '{{0..9}}: {{0..9}} {{1..10}}'")
    for step in range(_length(text, [text])):
        row, columns = _at(text, step).split(":")
        yield int(row), tuple(map(int, columns.split()))


def _length(row: Any, texts: Sequence[str]) -> int:
    """How many rows one stands for."""
    lengths = {_count(*found) for text in texts for found in _RANGE.findall(text)}
    if len(lengths) > 1 or not 0 < min(lengths) <= MOST:
        raise ValueError(f"{row!r}: expected ranges of one length that rise")
    return lengths.pop()


def _count(first: str, last: str, step: str) -> int:
    return (int(last) - int(first)) // int(step or 1) + 1


def _at(text: str, step: int) -> str:
    return _RANGE.sub(lambda found: str(int(found[1]) + step * int(found[3] or 1)), text)
