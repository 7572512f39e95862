"""Lines of symbol tables, and one that stands for many which differ by a number alone."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from qddot.codegen.cells import LEAST

_NUMBERED = re.compile(r"(.+_)(\d+)")


@dataclass(frozen=True, slots=True)
class Entry:
    """A line of a symbol table. rate: the symbol of the time derivative, where it has one that is used."""

    symbol: str
    unit: str
    meaning: str
    rate: str | None = None


@dataclass(frozen=True, slots=True)
class ParameterEntry:
    """A parameter with its default, and the value in each named set that gives another."""

    symbol: str
    unit: str
    meaning: str
    default: float
    values: Mapping[str, float]


def with_index(entry: Entry, index: str, first: int, last: int) -> Entry:
    """The line for all numbers that an index takes, from that of the first of them; q_2 as q_i-1 where that is 3."""
    found = _NUMBERED.fullmatch(entry.symbol)
    if found is None:
        return entry
    number = int(found[2])
    label = index if number == first else f"{index}{number - first:+d}"
    return Entry(
        f"{found[1]}{label}",
        entry.unit,
        f"{_numberless(entry.meaning, number, label)}, {index} = {first} to {last}",
        entry.rate and re.sub(r"\d+\Z", label, entry.rate),
    )


def ranged(entries: Sequence[Entry], index: str | None) -> tuple[Entry, ...]:
    """Lines in order, those that differ by a number that rises by one as one line."""
    if index is None:
        return tuple(entries)
    found: list[Entry] = []
    for _, group in groupby(enumerate(entries), key=lambda pair: _kind(*pair)):
        alike = [entry for _, entry in group]
        if len(alike) < LEAST:
            found += alike
        else:
            first, last = (int(each.symbol.rpartition("_")[2]) for each in (alike[0], alike[-1]))
            found.append(with_index(alike[0], index, first, last))
    return tuple(found)


def _kind(k: int, entry: Entry) -> tuple[object, ...]:
    """The same for lines behind each other of which one has the next number of the one before, and nothing else."""
    found = _NUMBERED.fullmatch(entry.symbol)
    if found is None:
        return entry.symbol, k
    number = int(found[2])
    rate = entry.rate and re.sub(r"\d+\Z", "", entry.rate)
    return found[1], number - k, entry.unit, _numberless(entry.meaning, number, "#"), rate


def _numberless(meaning: str, number: int, label: str) -> str:
    return re.sub(rf"(?<!\d){number}(?!\d)", label, meaning)
