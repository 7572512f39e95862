"""Thousands of runs: M113 over a sine road and over a table, one shot each, and pendulums; beside other tools.

Every run of the M113 has a speed, a shot time and a hull mass of its own, every pendulum a start of its own. Times are
those of one run: the whole call divided by the number of runs, set-up and results included, on two threads.
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import qddot
import qddot.model.pendulum
from benchmarks import ours
from benchmarks.cases.case import Case, Run
from benchmarks.cases.m113 import AMPLITUDE, WAVELENGTH, batch_keywords, drives
from benchmarks.cases.pendulum import swings
from benchmarks.contest import Preparation, as_given, contest, tuned
from benchmarks.operations import of_rk4_step
from benchmarks.peers import THREADS, peer
from benchmarks.timing import Table, Timing, dgemm_peak

STEP = 1e-4
#: Runs over which errors are measured.
CHECKED = 16
#: Runs that suffice for the time of one where a tool takes long; it gains nothing from more.
ENOUGH = 1000
METHODS = ("taylor", "dop853", "vern7", "tsit5")
PEERS: dict[str, Preparation] = {
    "heyoka batch": peer("heyoka", "many"),
    "numbalsoda dop853 under prange": peer("numbalsoda", "many"),
    "diffrax Dopri8, vmap": peer("diffrax", "many"),
}
SLOW = ("numbalsoda dop853 under prange", "diffrax Dopri8, vmap")


def groups(quick: bool) -> Iterator[Table]:
    """All batches; a contender that is not installed or fails is named with its reason."""
    runs, repeats = (512, 2) if quick else (10_000, 5)
    whole = drives(qddot.load("m113"), runs)
    yield Table("M113, batch by RK4 at a step of 1e-4, 2 s", tuple(_rk4(whole, 64 if quick else 400)), "run")
    title = f"M113, {runs} runs at error 1e-8, 2 s"
    yield Table(title, tuple(_compared(_over_roads(whole) | PEERS, whole, 1e-8, repeats)), "run")
    rng = np.random.default_rng(4)
    two = swings(qddot.load("double_pendulum"), rng.uniform(-0.7, 0.7, (runs, 4)), 10.0)
    title = f"{runs} double pendulums at error 1e-9, 10 s"
    yield Table(title, tuple(_compared(_in_lanes() | PEERS, two, 1e-9, repeats)), "run")
    with tempfile.TemporaryDirectory() as folder:
        starts = rng.uniform(-0.2, 0.2, (max(128, runs // 10), 16))
        eight = swings(ours.derived(qddot.model.pendulum.system(8), Path(folder)), starts, 10.0)
        title = f"{eight.runs} pendulums of 8 links at error 1e-9, 10 s"
        yield Table(title, tuple(_compared(_in_lanes() | PEERS, eight, 1e-9, repeats)), "run")


def _in_lanes() -> dict[str, Preparation]:
    return {f"qddot {name}": partial(ours.many, method=name) for name in METHODS}


def _over_roads(whole: Case) -> dict[str, Preparation]:
    """Ours over the sine road and the same road as a table."""
    x = np.linspace(-10, 40, 10_000)
    table = qddot.signal.table(x, AMPLITUDE * np.sin(2 * np.pi / WAVELENGTH * x), kind="cubic")

    def with_table(case: Case) -> dict[str, Any]:
        return batch_keywords(case, table)

    return _in_lanes() | {
        "qddot exact": partial(ours.many, method="exact"),
        "qddot dop853, road of 10 000 points": partial(ours.many, method="dop853", keywords=with_table),
    }


def _compared(preparations: Mapping[str, Preparation], case: Case, wanted: float, repeats: int) -> list[Timing]:
    few, enough = case.first(CHECKED), case.first(ENOUGH)
    cases = {name: enough if name in SLOW else case for name in preparations}
    makers = {name: partial(tuned, each, few, cases[name], wanted) for name, each in preparations.items()}
    rows = _per_run(contest(makers, repeats), {name: each.runs for name, each in cases.items()})
    return [
        replace(row, note=f"{row.note}, {ENOUGH} runs") if row.name in SLOW and case.runs > ENOUGH else row
        for row in rows
    ]


def _rk4(whole: Case, count: int) -> list[Timing]:
    """RK4 with equal steps: the same arithmetic, so the share of dgemm's peak is told of all."""
    few = whole.first(count)
    makers: dict[str, Callable[[], Run]] = {
        "qddot rk4 in lanes": lambda: ours.many(whole, "rk4", step=STEP)(0.0),
        "qddot scalar kernel under prange": lambda: ours.scalar_rk4(few, STEP),
        "diffrax RK4, vmap": lambda: peer("diffrax", "rk4", STEP)(few),
    }
    counts = dict.fromkeys(makers, count) | {"qddot rk4 in lanes": whole.runs}
    checked = whole.first(CHECKED)
    rows = contest({name: partial(as_given, make, checked) for name, make in makers.items()}, 2)
    peak, steps = dgemm_peak(THREADS), whole.end / STEP
    work = of_rk4_step("m113") * steps
    rows = [
        replace(row, note=_note(row, counts[row.name], steps, work), share=work / row.least / peak)
        if np.isfinite(row.least)
        else row
        for row in _per_run(rows, counts)
    ]
    return [*rows, Timing(f"dgemm of NumPy on {THREADS} threads", note=f"{peak / 1e9:.3g} Gflop/s", share=1.0)]


def _note(row: Timing, runs: int, steps: float, work: float) -> str:
    return f"{runs} runs, {row.least / steps * 1e9:.1f} ns a step, {work / row.least / 1e9:.3g} Gflop/s"


def _per_run(rows: list[Timing], counts: Mapping[str, int]) -> list[Timing]:
    rows = [replace(t, least=t.least / counts[t.name], median=t.median / counts[t.name]) for t in rows]
    return sorted(rows, key=lambda row: (np.isnan(row.least), row.least))
