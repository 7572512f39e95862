"""One run at equal error: the M113 standing and driving, pendulums of two and eight links, a chain of 100 masses, and
two mechanisms held together by constraints, of which the others integrate the differentiated equations.

Every contender is prepared beforehand and timed from a given state to the end; over the M113 it restarts at the two
edges of the recoil pulse (ours finds them by itself).
"""

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

import qddot
from benchmarks import ours
from benchmarks.cases.case import Case
from benchmarks.cases.chain import shaken
from benchmarks.cases.m113 import AMPLITUDE, ride
from benchmarks.cases.mechanism import andrews, turning
from benchmarks.cases.pendulum import swings
from benchmarks.contest import Preparation, at_equal_error
from benchmarks.peers import peer
from benchmarks.timing import Table, Timing
from qddot.model import chain, four_bar, pendulum

PEERS: dict[str, Preparation] = {
    "heyoka taylor_adaptive": peer("heyoka", "one"),
    "numbalsoda dop853": peer("numbalsoda", "one"),
    "CyRK DOP853": peer("cyrk", "one", "DOP853"),
    "CyRK Vern7": peer("cyrk", "one", "Vern7"),
    "JiTCODE dop853": peer("jitcode", "one"),
    "CasADi cvodes": peer("casadi", "one"),
    "SciPy DOP853, numba right-hand side": peer("scipy", "one", "DOP853"),
    "SciPy DOP853, lambdify": peer("scipy", "lambdified", "DOP853"),
    "PyDy, Cython": peer("pydy", "one", "cython"),
    "PyDy, lambdify": peer("pydy", "one", "lambdify"),
}
#: What takes differential-algebraic equations as they are.
ALGEBRAIC: dict[str, Preparation] = {"scikit-sundae IDA": peer("sundae", "one")}
METHODS = ("exact", "taylor", "dop853", "vern7", "tsit5", "ode45")
#: Small swings of eight links keep far from chaos, which no tool can follow to nine digits.
SWING = 0.4


def groups(quick: bool) -> Iterator[Table]:
    """A table for each case; a contender that is not installed or fails is named with its reason."""
    with tempfile.TemporaryDirectory() as folder:
        for title, make, wanted in _cases(Path(folder)):
            yield Table(f"{title}, error {wanted:g}", tuple(compared(make(), wanted, 2 if quick else 15)))


def compared(case: Case, wanted: float, repeats: int) -> list[Timing]:
    """Our methods and all peers over the first run of a case."""
    tables = case.model.tables
    able = {"exact": tables.linear, "taylor": not tables.constraints}
    methods = [name for name in METHODS if able.get(name, True)]
    contenders: dict[str, Preparation] = {f"qddot {name}": partial(ours.one, method=name) for name in methods}
    peers = PEERS | ALGEBRAIC if tables.constraints else PEERS
    return at_equal_error(contenders | peers, case, wanted, repeats)


def _cases(folder: Path) -> Iterator[tuple[str, Callable[[], Case], float]]:
    m113 = qddot.load("m113")
    yield "M113 standing, one shot, 10 s", lambda: ride(m113, 0.0), 1e-6
    yield "M113 driving over a sine road, one shot, 10 s", lambda: ride(m113, AMPLITUDE), 1e-6
    two = np.array([[0.6, -0.4, 0.3, 0.5]])
    yield "Double pendulum, 10 s", lambda: swings(qddot.load("double_pendulum"), two, 10.0), 1e-9
    eight = np.concatenate([SWING * np.linspace(1.0, -0.5, 8), np.zeros(8)])[None]
    yield "Pendulum of 8 links, 10 s", lambda: swings(ours.derived(pendulum.system(8), folder), eight, 10.0), 1e-9
    yield "Andrews' mechanism, 0.03 s", lambda: andrews(partial(ours.derived, folder=folder)), 1e-6
    yield "Four-bar, 5 s", lambda: turning(four_bar.system(), qddot.load("four_bar")), 1e-6
    yield "Chain of 100 masses, 10 s", lambda: shaken(ours.derived(chain.system(100), folder), 10.0), 1e-9
