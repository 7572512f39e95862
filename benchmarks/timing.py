"""Interleaved repeats and their statistics."""

import json
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median


@dataclass(frozen=True)
class Timing:
    """Seconds of one contender: least and median of its repeats; note says what else there is to know."""

    name: str
    least: float
    median: float
    note: str = ""


def interleaved(contenders: Mapping[str, Callable[[], object]], repeats: int) -> list[Timing]:
    """Time callables in turn, A B C A B C ..., after one turn that does not count."""
    seconds: dict[str, list[float]] = {name: [] for name in contenders}
    for turn in range(repeats + 1):
        for name, run in contenders.items():
            start = time.perf_counter()
            run()
            if turn:
                seconds[name].append(time.perf_counter() - start)
    return [Timing(name, min(each), median(each)) for name, each in seconds.items()]


def machine() -> str:
    """The processor and the number of cores, as the system names them."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        model = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
        cores = sum(line.startswith("processor") for line in lines)
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
    return f"{model}, {cores} cores, Python {platform.python_version()}"


def report(title: str, timings: Sequence[Timing]) -> str:
    """A Markdown table, ratios to the first row first."""
    base = timings[0].least
    lines = [f"### {title}", "", "| | ratio | least | median | |", "|---|---|---|---|---|"]
    for each in timings:
        numbers = (f"{each.least / base:.3g}", _seconds(each.least), _seconds(each.median))
        lines.append(f"| {each.name} | {' | '.join(numbers)} | {each.note} |")
    return "\n".join(lines) + "\n"


def write_json(path: Path, groups: Mapping[str, Sequence[Timing]]) -> None:
    """All timings and the machine, for other programs."""
    content = {"machine": machine(), "groups": {name: [asdict(each) for each in rows] for name, rows in groups.items()}}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=1), "utf-8")


def _seconds(value: float) -> str:
    for factor, unit in ((1, "s"), (1e3, "ms"), (1e6, "µs")):
        if value * factor >= 1:
            return f"{value * factor:.3g} {unit}"
    return f"{value * 1e9:.3g} ns"
