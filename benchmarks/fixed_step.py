"""What qddot's fixed steps take beside what a Python user writes by hand: lambdify and solve_ivp."""

from collections.abc import Iterator

import qddot
from benchmarks import ours
from benchmarks.cases.m113 import ride
from benchmarks.contest import Tuned, contest
from benchmarks.peers import peer
from benchmarks.timing import Table


def groups(quick: bool) -> Iterator[Table]:
    """RK4 at 1e-4 for 10 s, and SciPy's RK45 and DOP853 over a lambdified right-hand side at rtol 1e-6."""
    case = ride(qddot.load("m113"), 0.0)
    makers = {"qddot rk4, 100 000 steps of 1e-4": lambda: ours.one(case, "rk4", step=1e-4, every=100)(0.0)}
    for method in ("RK45", "DOP853"):
        prepare = peer("scipy", "lambdified", method)
        makers[f"SciPy {method} on lambdify, rtol 1e-6"] = lambda prepare=prepare: prepare(case)(1e-6)

    def measured(make: object) -> Tuned:
        run = make()  # type: ignore[operator]
        return Tuned(run, 0.0, case.error(run()))

    rows = contest({name: lambda make=make: measured(make) for name, make in makers.items()}, 1 if quick else 3)
    yield Table("M113 standing, one shot, 10 s, as one would write it", tuple(rows))
