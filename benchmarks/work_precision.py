"""Work-precision diagrams of all adaptive methods on standard problems, beside SciPy over the same functions."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.contest import say
from benchmarks.problems import NON_STIFF, PROBLEMS, STIFF, Problem
from benchmarks.timing import Table, Timing
from benchmarks.work_precision_report import draw, write
from benchmarks.work_precision_runs import (
    NON_STIFF_METHODS,
    NON_STIFF_PEERS,
    STIFF_METHODS,
    STIFF_PEERS,
    Point,
    points,
)

RESULTS = Path("results")
#: The non-stiff problems that are drawn and that SciPy solves too; of the others there is only the table.
DRAWN = ("DETEST B1", "DETEST C5", "DETEST D5", "DETEST E2", "Pleiades", "Arenstorf orbit")
PEERS = {*NON_STIFF_PEERS, *STIFF_PEERS}
#: The tolerance whose times are reported.
REPORTED = 1e-6


def groups(quick: bool) -> Iterator[Table]:
    """Times at rtol 1e-6 with the digits reached; writes results/work_precision*.png, .md and .json on the way.

    quick: four tolerances instead of eight, one repeat, the drawn problems only, and a shorter patience.
    """
    rtols = [10.0**-k for k in (range(4, 11, 2) if quick else range(3, 11))]
    repeats, longest = (1, 0.06) if quick else (3, 0.4)

    def run(problems: Sequence[Problem], methods: Sequence[str]) -> list[Point]:
        found = []
        for problem in problems:
            say(f"  {problem.name}: {', '.join(methods)}")
            for method in methods:
                if problem.mass_matrix is None or method not in STIFF_PEERS:  # SciPy solves none with a mass matrix.
                    found += points(problem, method, rtols, repeats, longest if method in PEERS else 2.5 * longest)
        return found

    drawn = [PROBLEMS[name] for name in DRAWN]
    loose = run(drawn if quick else NON_STIFF, NON_STIFF_METHODS) + run(drawn, NON_STIFF_PEERS)
    stiff = run(STIFF, STIFF_METHODS) + run(STIFF, STIFF_PEERS)
    draw(loose, DRAWN, "Non-stiff standard problems", RESULTS / "work_precision.png")
    draw(stiff, [problem.name for problem in STIFF], "Stiff standard problems", RESULTS / "work_precision_stiff.png")
    write(loose + stiff, RESULTS / "work_precision.md", RESULTS / "work_precision.json")
    for problem in (*drawn, *STIFF):
        if timings := _timings(loose + stiff, problem):
            yield Table(f"{problem.name}, rtol {REPORTED:g}", tuple(timings))


def _timings(found: Sequence[Point], problem: Problem) -> list[Timing]:
    return [
        Timing(each.method, each.least, each.median, f"{each.digits:.1f} digits, {each.evaluations} evaluations")
        for each in found
        if each.problem == problem.name and not each.failure and abs(each.rtol / REPORTED - 1.0) < 1e-6
    ]
