"""Contests at equal error: every tool at the loosest tolerance that gives the wanted error, then timed in turn."""

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

from benchmarks.cases.case import Case, Run
from benchmarks.timing import Timing, interleaved

#: From a case to a function that takes a relative tolerance and gives the run.
Preparation = Callable[[Case], Callable[[float], Run]]

#: Tolerances that are tried lie between these, half a decade apart.
TIGHTEST, LOOSEST, STRIDE = 1e-14, 1e-2, 10**-0.5


@dataclass(frozen=True)
class Tuned:
    """A run at the tolerance that was found, 0 where it has none, and the error of the final states there."""

    run: Run
    tolerance: float
    error: float


def at_equal_error(preparations: Mapping[str, Preparation], case: Case, wanted: float, repeats: int) -> list[Timing]:
    """All contenders for the first run of a case, the fastest first; those that fail last, with the reason."""
    return contest({name: partial(tuned, each, case, case, wanted) for name, each in preparations.items()}, repeats)


def contest(makers: Mapping[str, Callable[[], Tuned]], repeats: int) -> list[Timing]:
    """Make and time contenders: the fastest first, those that fail last, with the reason."""
    runs: dict[str, Tuned] = {}
    missing: list[Timing] = []
    for name, make in makers.items():
        start = time.perf_counter()
        try:
            runs[name] = make()
            runs[name].run()
        except Exception as problem:  # whatever a foreign tool does, the others still run
            runs.pop(name, None)
            missing.append(Timing(name, note=f"does not take part: {reason(problem)}"))
            say(f"  {name}: {missing[-1].note}")
        else:
            say(f"  {name}: error {runs[name].error:.1e}, ready in {time.perf_counter() - start:.1f} s")
    say(f"  timing {len(runs)} contenders in {repeats} turns")
    timings = interleaved({name: each.run for name, each in runs.items()}, repeats, warm=True)
    rows = [replace(each, note=_note(runs[each.name]), error=runs[each.name].error) for each in timings]
    return sorted(rows, key=lambda row: row.least) + missing


def tuned(prepare: Preparation, few: Case, whole: Case, wanted: float) -> Tuned:
    """The run of the whole case at the loosest tolerance with which the error over a few runs is as wanted.

    Raises RuntimeError where no tolerance gives it.
    """
    at = prepare(few)
    tolerance, found = wanted, _error(few, at, wanted)
    while found > wanted and tolerance > TIGHTEST:
        tolerance *= STRIDE
        found = _error(few, at, tolerance)
    if not found <= wanted:
        raise RuntimeError(f"error {found:.1e} at tolerance {tolerance:.0e}, {wanted:.0e} was wanted")
    if tolerance == wanted:
        tolerance, found = _loosened(few, at, wanted, found)
    makers = at if few is whole else prepare(whole)
    return Tuned(makers(tolerance), 0.0 if tolerance > LOOSEST else tolerance, found)


def _loosened(few: Case, at: Callable[[float], Run], wanted: float, found: float) -> tuple[float, float]:
    """Beyond the loosest tolerance where none matters, as for exact propagation."""
    tolerance = wanted
    while tolerance <= LOOSEST and (looser := _error(few, at, tolerance / STRIDE)) <= wanted:
        tolerance, found = tolerance / STRIDE, looser
    return tolerance, found


def as_given(make: Callable[[], Run], few: Case) -> Tuned:
    """A run that has no tolerance, with its error over the few runs of a case."""
    run = make()
    return Tuned(run, 0.0, few.error(run()))


def _error(case: Case, at: Callable[[float], Run], tolerance: float) -> float:
    return case.error(at(tolerance)())


def _note(found: Tuned) -> str:
    return f"tolerance {found.tolerance:.0e}" if found.tolerance else ""


def reason(problem: BaseException) -> str:
    """Kind and first line of an exception."""
    lines = str(problem).strip().splitlines()
    return f"{type(problem).__name__}: {lines[0]}" if lines else type(problem).__name__


def say(text: str) -> None:
    """A line of progress, beside the tables."""
    print(text, file=sys.stderr, flush=True)
