"""`python -m benchmarks.compare A.json B.json`: what `make bench` measured twice, row beside row."""

import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from benchmarks.report import seconds
from benchmarks.timing import Table, Timing
from qddot.words import counted

#: Ratios between this and its reciprocal are called alike.
ALIKE = 1.05
HEAD = ("| | B / A | of medians | A, least | B, least | |", "|---|---:|---:|---:|---:|---|")
EXPECTED = "expected what `make bench` writes to results/benchmarks.json"


@dataclass(frozen=True)
class Measured:
    """A file of results: the machine, the versions of the tools, why groups failed, the tables of each group."""

    machine: str
    versions: dict[str, str]
    failures: dict[str, str]
    groups: dict[str, list[Table]]


@dataclass(frozen=True)
class Pair:
    """A contender in both files; ratio: of the least of its repeats, B over A, and of their medians."""

    first: Timing
    second: Timing

    @property
    def ratios(self) -> tuple[float, float]:
        """Of the least and of the medians; NaN where it does not take part in one."""
        return self.second.least / self.first.least, self.second.median / self.first.median

    @property
    def verdict(self) -> str:
        """What both ratios say; nothing where they are alike, or disagree."""
        low, high = min(self.ratios), max(self.ratios)
        return "slower" if low > ALIKE else "faster" if high < 1.0 / ALIKE else ""


def read(path: Path) -> Measured:
    """The results in a file. Raises ValueError where it holds none."""
    try:
        found: Any = json.loads(path.read_bytes())
        return TypeAdapter(Measured).validate_python(_with_nan(found))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; {EXPECTED}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ValueError(f"{path}: {where}: {first['msg'].lower()}; {EXPECTED}") from None
    except ValueError as error:
        raise ValueError(f"{path} is no JSON ({error}); {EXPECTED}") from None


def _with_nan(value: Any) -> Any:
    """JSON has no NaN: a time that is null is one."""
    if isinstance(value, dict):
        times = {key: math.nan for key in ("least", "median") if key in value and value[key] is None}
        return {key: _with_nan(each) for key, each in value.items()} | times
    return [_with_nan(each) for each in value] if isinstance(value, list) else value


def report(first: Measured, second: Measured) -> str:
    """Both, row by row, as Markdown; at the end the rows that are not alike, and what only one of them has."""
    lines = ["# B beside A", "", f"A: {first.machine}", f"B: {second.machine}", *_versions(first, second), ""]
    differing: dict[str, list[str]] = {"slower": [], "faster": []}
    for title, pairs in _tables(first, second):
        lines += [f"### {title}", "", *HEAD]
        for name, pair in pairs.items():
            lines.append(_row(name, pair))
            if pair.verdict:
                differing[pair.verdict].append(f"{title}: {name}, {pair.ratios[0]:.3g}")
        lines.append("")
    for verdict, rows in differing.items():
        lines += [f"{counted(len(rows), 'row')} {verdict} in B by more than {ALIKE - 1:.0%}", *(f"- {r}" for r in rows)]
    return "\n".join([*lines, *_alone(first, second)]) + "\n"


def _versions(first: Measured, second: Measured) -> list[str]:
    names = [*first.versions, *(name for name in second.versions if name not in first.versions)]
    pairs = ((name, first.versions.get(name, "none"), second.versions.get(name, "none")) for name in names)
    changed = [f"{name} {a} -> {b}" for name, a, b in pairs if a != b]
    return [f"versions: {', '.join(changed)}"] if changed else []


def _rows(measured: Measured) -> dict[str, dict[str, Timing]]:
    return {
        f"{group}: {table.title}": {row.name: row for row in table.rows}
        for group, tables in measured.groups.items()
        for table in tables
    }


def _tables(first: Measured, second: Measured) -> Iterator[tuple[str, dict[str, Pair]]]:
    """The rows that both have of each table that both have."""
    others = _rows(second)
    for title, rows in _rows(first).items():
        pairs = {name: Pair(row, others[title][name]) for name, row in rows.items() if name in others.get(title, {})}
        if pairs:
            yield title, pairs


def _row(name: str, pair: Pair) -> str:
    times = [seconds(each.least) if math.isfinite(each.least) else each.note for each in (pair.first, pair.second)]
    ratios = [f"{ratio:.3g}" if math.isfinite(ratio) else "" for ratio in pair.ratios]
    return f"| {' | '.join((name, *ratios, *times, pair.verdict))} |"


def _alone(first: Measured, second: Measured) -> Iterator[str]:
    """What only one of the files has."""
    for letter, here, there in (("A", first, second), ("B", second, first)):
        others = _rows(there)
        for title, rows in _rows(here).items():
            missing = [name for name in rows if name not in others.get(title, {})]
            if missing:
                yield f"in {letter} alone: {title}" + ("" if title not in others else f": {', '.join(missing)}")
        yield from (f"failed in {letter}: {group}: {why}" for group, why in here.failures.items())


def main(arguments: list[str]) -> int:
    """Print both files beside each other; 2 where there are not two, or one holds no results."""
    if len(arguments) != 2:
        print(
            f"found {counted(len(arguments), 'file')}, expected two: make bench-compare A.json B.json", file=sys.stderr
        )
        return 2
    try:
        print(report(*(read(Path(each)) for each in arguments)), end="")
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
