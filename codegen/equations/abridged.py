"""What is too long for a document: the first rows and lines of each section, and how many are left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

#: Characters that a section keeps of a document that would be too long: some four pages of formulas.
_ROOM = 14_000
#: So many times that is what a list of equations keeps, in equal parts.
_OF_LISTS = 5


@dataclass(frozen=True)
class Row:
    """A formula: what stands left of the line where formulas are aligned, and the lines to the right of it."""

    left: str
    right: tuple[str, ...]


@dataclass(frozen=True)
class Display:
    """Formulas under each other, short ones in several columns; left_out: how many more there are."""

    columns: int
    rows: tuple[Row, ...]
    left_out: int = 0


@dataclass(frozen=True)
class Table:
    """Finished cells; meaning: the width of the meaning's column in em; left_out: how many rows more there are."""

    rows: tuple[tuple[str, ...], ...]
    meaning: float
    left_out: int = 0


def abridged(sections: Mapping[str, Any]) -> dict[str, Any]:
    """The sections of a document by name, of each table and display as much as there is room for."""
    return {name: _abridged(section, _ROOM) for name, section in sections.items()}


def _abridged(section: Any, room: int) -> Any:
    if isinstance(section, Table):
        cells = section.rows[: _fitting([sum(map(len, row)) for row in section.rows], room)]
        return replace(section, rows=cells, left_out=len(section.rows) - len(cells))
    if isinstance(section, Display):
        cut = [replace(row, right=_lines(row.right, room)) for row in section.rows]
        rows = tuple(cut[: _fitting([len(row.left) + sum(map(len, row.right)) for row in cut], room)])
        return replace(section, rows=rows, left_out=len(section.rows) - len(rows))
    if isinstance(section, list):  # of headings, each with what stands under it
        part = _OF_LISTS * room // max(1, len(section))
        short = (_lines(below, part) if isinstance(below, tuple) else _abridged(below, part) for _, below in section)
        return [(head, kept) for (head, _), kept in zip(section, short, strict=True)]
    return section


def _fitting(lengths: Sequence[int], room: int) -> int:
    """How many of these find room; one at least."""
    return max(1, sum(total <= room for total in accumulate(lengths)))


def _lines(lines: tuple[str, ...], room: int) -> tuple[str, ...]:
    """The first lines of a formula, and that it goes on."""
    kept = _fitting([len(line) for line in lines], room)
    return lines if kept >= len(lines) else (*lines[:kept], rf"\cdots \text{{({len(lines) - kept} more lines)}}")
