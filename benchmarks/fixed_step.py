"""What qddot's fixed steps take beside what a Python user writes by hand: lambdify and solve_ivp."""

from collections.abc import Callable, Iterator
from functools import partial

import qddot
from benchmarks import ours
from benchmarks.cases.case import Run
from benchmarks.cases.m113 import ride
from benchmarks.contest import as_given, contest
from benchmarks.peers import peer
from benchmarks.timing import Table


def groups(quick: bool) -> Iterator[Table]:
    """RK4 at 1e-4 for 10 s, and SciPy's RK45 and DOP853 over a lambdified right-hand side at rtol 1e-6."""
    case = ride(qddot.load("m113"), 0.0)
    makers: dict[str, Callable[[], Run]] = {
        "qddot rk4, 100 000 steps of 1e-4": lambda: ours.one(case, "rk4", step=1e-4, every=100)(0.0),
        "SciPy RK45 on lambdify, rtol 1e-6": lambda: peer("scipy", "lambdified", "RK45")(case)(1e-6),
        "SciPy DOP853 on lambdify, rtol 1e-6": lambda: peer("scipy", "lambdified", "DOP853")(case)(1e-6),
    }
    rows = contest({name: partial(as_given, make, case) for name, make in makers.items()}, 1 if quick else 3)
    yield Table("M113 standing, one shot, 10 s, as one would write it", tuple(rows))
