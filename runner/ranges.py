"""Rows of a generated module's tables that count: ("k_{6..10}", 65e3, "N/m", "stiffness, axle {1..5}") is five."""

import re
from collections.abc import Iterable, Iterator
from typing import Any

_RANGE = re.compile(r"\{([0-9]+)\.\.([0-9]+)\}")
#: Rows that one may stand for.
MOST = 1_000_000


def expanded(rows: Iterable[Any]) -> list[Any]:
    """All rows, names or tuples that begin with one; a row with a range {first..last} in its name gives as many.

    All ranges of a row count together; braces in the texts of a row without a range in its name mean nothing. Raises
    ValueError for a range that does not rise or for ranges of different lengths.
    """
    return [each for row in rows for each in _expanded(row)]


def _expanded(row: Any) -> Iterator[Any]:
    name = row[0] if isinstance(row, tuple | list) and row else row
    if not isinstance(name, str) or not _RANGE.search(name):
        yield row
        return
    texts = [item for item in ([row] if isinstance(row, str) else row) if isinstance(item, str)]
    lengths = {int(last) - int(first) + 1 for text in texts for first, last in _RANGE.findall(text)}
    if len(lengths) > 1 or not 0 < min(lengths) <= MOST:
        raise ValueError(f"{row!r}: expected ranges of one length that rise")
    for step in range(lengths.pop()):
        if isinstance(row, str):
            yield _at(row, step)
        else:
            yield tuple(_at(item, step) if isinstance(item, str) else item for item in row)


def _at(text: str, step: int) -> str:
    return _RANGE.sub(lambda found: str(int(found[1]) + step), text)
