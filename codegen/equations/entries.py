"""Lines of symbol tables, and one that stands for many which differ by a number alone."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from qddot.codegen.cells import LEAST

_DIGITS = re.compile(r"(\d+)")
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


def numbered(name: str) -> tuple[str, int] | None:
    """A name that ends in _ and a number, as what is one of many does, without it, and the number."""
    found = _NUMBERED.fullmatch(name)
    return (found[1], int(found[2])) if found else None


def label(index: str, ahead: int) -> str:
    """What stands for a number that is so much more than the index: i, i-1."""
    return f"{index}{ahead:+d}" if ahead else index


def with_index(entries: Sequence[Entry], index: str, first: int, last: int) -> Entry:
    """One line for all numbers that an index takes, from the lines of each; q_2 as q_i-1 where the first is 3.

    Where meanings differ by more than their numbers, it has the first and the last.
    """
    entry, (stem, number) = entries[0], _split(entries[0])
    shown = label(index, number - first)
    alike = len({_numberless(each.meaning, _split(each)[1], "#") for each in entries}) == 1
    meaning = _numberless(entry.meaning, number, shown) if alike else f"{entry.meaning} to {entries[-1].meaning}"
    rate = entry.rate and re.sub(r"\d+\Z", shown, entry.rate)
    return Entry(f"{stem}{shown}", entry.unit, f"{meaning}, {index} = {first} to {last}", rate)


def _split(entry: Entry) -> tuple[str, int]:
    return numbered(entry.symbol) or (entry.symbol, 0)


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
            (_, first), (_, last) = _split(alike[0]), _split(alike[-1])
            found.append(with_index(alike, index, first, last))
    return tuple(found)


def _kind(k: int, entry: Entry) -> tuple[object, ...]:
    """The same for lines behind each other of which one has the next number of the one before, and nothing else."""
    found = numbered(entry.symbol)
    if found is None:
        return entry.symbol, k
    stem, number = found
    rate = entry.rate and re.sub(r"\d+\Z", "", entry.rate)
    return stem, number - k, entry.unit, _numberless(entry.meaning, number, "#"), rate


def _numberless(meaning: str, number: int, label: str) -> str:
    parts = _DIGITS.split(meaning)
    return "".join(label if part == str(number) else part for part in parts)
