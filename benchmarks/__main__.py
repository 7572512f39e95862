"""`python -m benchmarks [--quick] [GROUP ...]`: tables on the terminal; tables, JSON and figures in results/."""

import argparse
import signal
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

from benchmarks import batch, c_loop, derivation, fixed_step, latency, single_run, size, work_precision
from benchmarks.contest import reason, say
from benchmarks.figures import draw_all
from benchmarks.report import markdown, write
from benchmarks.timing import Table, machine

GROUPS: Mapping[str, ModuleType] = {
    "latency": latency,
    "derivation": derivation,
    "size": size,
    "fixed_step": fixed_step,
    "c_loop": c_loop,
    "single_run": single_run,
    "batch": batch,
    "work_precision": work_precision,
}
RESULTS = Path("results")


def main(arguments: list[str]) -> int:
    """Run the groups named, or all; 1 where a group failed. What was measured is written after each group."""
    parser = argparse.ArgumentParser(prog="benchmarks", description=__doc__, allow_abbrev=False)
    parser.add_argument("--quick", action="store_true", help="fewer runs, of smaller models")
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=f"of {', '.join(GROUPS)}; all where none is named")
    given = parser.parse_args(arguments)
    for name in given.groups:
        if name not in GROUPS:
            parser.error(f"no group {name!r}; there are {', '.join(GROUPS)}")
    print(f"{machine()}\n", flush=True)
    return run({name: GROUPS[name] for name in given.groups or GROUPS}, given.quick, RESULTS)


def run(groups: Mapping[str, ModuleType], quick: bool, folder: Path) -> int:
    """Print each table as it comes; a group that fails is named and the next one goes on."""
    found: dict[str, list[Table]] = {}
    failures: dict[str, str] = {}
    for place, (name, group) in enumerate(groups.items(), 1):
        say(f"group {place} of {len(groups)}: {name}")
        found[name] = []
        try:
            for table in group.groups(quick):
                found[name].append(table)
                print(markdown(table), flush=True)
        except Exception as problem:  # the tables of the other groups are worth having
            failures[name] = reason(problem)
            traceback.print_exc()
        paths = write(found, failures, folder)
    for path in (*paths, *draw_all([table for tables in found.values() for table in tables], folder)):
        print(f"wrote {path}")
    for name, why in failures.items():
        print(f"group {name} failed: {why}")
    return 1 if failures else 0


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # who read the tables has gone, as `head` does: end without a word
    sys.exit(main(sys.argv[1:]))
