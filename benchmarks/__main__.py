"""`python -m benchmarks [--quick] [GROUP ...]`: tables on the terminal, JSON beside them."""

import sys
from pathlib import Path

from benchmarks import batch, c_loop, derivation, driving, latency, single_run, work_precision
from benchmarks.timing import machine, report, write_json

GROUPS = {
    "latency": latency,
    "derivation": derivation,
    "single_run": single_run,
    "c_loop": c_loop,
    "driving": driving,
    "batch": batch,
    "work_precision": work_precision,
}


def main(arguments: list[str]) -> None:
    """Run the groups named, or all."""
    quick = "--quick" in arguments
    names = [name for name in arguments if not name.startswith("-")] or list(GROUPS)
    for name in names:
        if name not in GROUPS:
            raise SystemExit(f"no group {name!r}; there are {', '.join(GROUPS)}")
    print(f"{machine()}\n")
    found = {}
    for name in names:
        for title, timings in GROUPS[name].groups(quick).items():
            print(report(title, timings), flush=True)
            found[title] = timings
    write_json(Path("results/benchmarks.json"), found)
    print("wrote results/benchmarks.json")


if __name__ == "__main__":
    main(sys.argv[1:])
