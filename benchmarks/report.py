"""Tables of timings as Markdown, ratios first, and as JSON."""

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks.timing import Table, Timing, machine
from qddot.runner.files import written_aside

#: What is measured here, by the names under which they are installed.
TOOLS = (
    "qddot",
    "heyoka",
    "numbalsoda",
    "CyRK",
    "jitcode",
    "casadi",
    "diffrax",
    "scikit-sundae",
    "pydy",
    "scipy",
    "numba",
    "numpy",
    "sympy",
)


def markdown(table: Table) -> str:
    """A Markdown table, ratios to the first row first; those that do not take part come last, with the reason."""
    first = next((row.least for row in table.rows if math.isfinite(row.least)), math.nan)
    extra = {
        "error": any(row.error is not None for row in table.rows),
        "share of dgemm's peak": any(row.share is not None for row in table.rows),
    }
    per = f", a {table.per}" if table.per != "call" else ""
    head = ["", "ratio", f"least{per}", f"median{per}", *(name for name, shown in extra.items() if shown), ""]
    lines = [f"### {table.title}", "", f"| {' | '.join(head)} |", f"|---{(len(head) - 2) * '|---:'}|---|"]
    lines += [f"| {' | '.join(_cells(row, first, extra))} |" for row in table.rows]
    return "\n".join(lines) + "\n"


def _cells(row: Timing, first: float, extra: Mapping[str, bool]) -> list[str]:
    taking_part = math.isfinite(row.least)
    cells = [row.name, f"{row.least / first:.3g}" if taking_part else ""]
    cells += [seconds(row.least), seconds(row.median)] if taking_part else ["", ""]
    if extra["error"]:
        cells.append("" if row.error is None else f"{row.error:.1e}")
    if extra["share of dgemm's peak"]:
        cells.append("" if row.share is None else f"{row.share:.1%}")
    return [*cells, row.note]


def seconds(value: float) -> str:
    """A time to three digits in s, ms, µs or ns."""
    for factor, unit in ((1, "s"), (1e3, "ms"), (1e6, "µs")):
        if value * factor >= 0.9995:
            return f"{value * factor:.3g} {unit}" if value * factor < 999.5 else f"{value * factor:.0f} {unit}"
    return f"{value * 1e9:.3g} ns"


def write(found: Mapping[str, Sequence[Table]], failures: Mapping[str, str], folder: Path) -> tuple[Path, Path]:
    """benchmarks.json and benchmarks.md with the tables of each group and why groups failed; gives their paths."""
    content = {
        "machine": machine(),
        "versions": versions(),
        "failures": dict(failures),
        "groups": {group: [_finite(asdict(table)) for table in tables] for group, tables in found.items()},
    }
    tools = ", ".join(f"{name} {number}" for name, number in versions().items())
    parts = ["# Benchmarks\n", f"{machine()}; {tools}. Least and median of interleaved repeats.\n"]
    parts += [f"{group} failed: {reason}\n" for group, reason in failures.items()]
    parts += [f"## {group}\n\n" + "\n".join(map(markdown, tables)) for group, tables in found.items()]
    data, text = folder / "benchmarks.json", folder / "benchmarks.md"
    for path, written in ((data, json.dumps(content, indent=1)), (text, "\n".join(parts))):
        with written_aside(path) as aside:
            aside.write_text(written, "utf-8")
    return data, text


def versions() -> dict[str, str]:
    """Versions of the tools, "not installed" for those that are missing; ours may run from its folder."""
    found = {}
    for tool in TOOLS:
        try:
            found[tool] = version(tool)
        except PackageNotFoundError:
            found[tool] = "not installed" if tool != "qddot" else _declared()
    return found


def _declared() -> str:
    project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text("utf-8"))["project"]
    return str(project["version"])


def _finite(value: Any) -> Any:
    """JSON has no NaN: null instead."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
