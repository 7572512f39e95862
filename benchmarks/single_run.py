"""One run at equal error: the M113 standing and driving, pendulums of two and eight links, a chain of 100 masses, and
two mechanisms held together by constraints, of which the others integrate the differentiated equations; and large
models, a pendulum of 32 links and a chain of 1000 masses.

Every contender is prepared beforehand and timed from a given state to the end; over the M113 it restarts at the two
edges of the recoil pulse (ours finds them by itself).
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping
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
#: What takes large models; the rest writes all of their equations out, in SymPy or in C, before its first run.
TAKING_LARGE = ("heyoka taylor_adaptive", "numbalsoda dop853", "CyRK DOP853", "CyRK Vern7", "CasADi cvodes")
#: What takes differential-algebraic equations as they are.
ALGEBRAIC: dict[str, Preparation] = {"scikit-sundae IDA": peer("sundae", "one")}
#: Coordinates up to which exact propagation is prepared within seconds; of 1000, each of its matrices takes a minute.
LARGEST_EXACT = 100
METHODS = ("exact", "taylor", "dop853", "vern7", "tsit5", "ode45")
#: Small swings of many links keep far from chaos, which no tool can follow to nine digits.
SWING = 0.4
#: A case's title, what makes it, and the error that is wanted.
Titled = tuple[str, Callable[[], Case], float]


def groups(quick: bool) -> Iterator[Table]:
    """A table for each case; a contender that is not installed or fails is named with its reason."""
    with tempfile.TemporaryDirectory() as folder:
        few = {name: PEERS[name] for name in TAKING_LARGE}
        for cases, peers in ((_cases(Path(folder)), PEERS), (_large_cases(Path(folder)), few)):
            for title, make, wanted in cases:
                rows = compared(make(), wanted, 2 if quick else 15, peers)
                yield Table(f"{title}, error {wanted:g}", tuple(rows))


def compared(case: Case, wanted: float, repeats: int, others: Mapping[str, Preparation] = PEERS) -> list[Timing]:
    """Our methods and the others over the first run of a case."""
    tables = case.model.tables
    exact = tables.linear and case.n <= LARGEST_EXACT
    methods = [name for name in METHODS if exact or name != "exact"]
    contenders: dict[str, Preparation] = {f"qddot {name}": partial(ours.one, method=name) for name in methods}
    peers = {**others, **(ALGEBRAIC if tables.constraints else {})}
    return at_equal_error(contenders | peers, case, wanted, repeats)


def _cases(folder: Path) -> Iterator[Titled]:
    m113 = qddot.load("m113")
    yield "M113 standing, one shot, 10 s", lambda: ride(m113, 0.0), 1e-6
    yield "M113 driving over a sine road, one shot, 10 s", lambda: ride(m113, AMPLITUDE), 1e-6
    two = np.array([[0.6, -0.4, 0.3, 0.5]])
    yield "Double pendulum, 10 s", lambda: swings(qddot.load("double_pendulum"), two, 10.0), 1e-9
    yield "Pendulum of 8 links, 10 s", lambda: _swinging(8, folder), 1e-9
    yield "Andrews' mechanism, 0.03 s", lambda: andrews(partial(ours.derived, folder=folder)), 1e-6
    yield "Four-bar, 5 s", lambda: turning(four_bar.system(), qddot.load("four_bar")), 1e-6
    yield "Chain of 100 masses, 10 s", lambda: shaken(ours.derived(chain.system(100), folder), 10.0), 1e-9


def _large_cases(folder: Path) -> Iterator[Titled]:
    yield "Pendulum of 32 links, 10 s", lambda: _swinging(32, folder), 1e-6
    yield "Chain of 1000 masses, 10 s", lambda: shaken(ours.derived(chain.system(1000), folder), 10.0), 1e-6


def _swinging(links: int, folder: Path) -> Case:
    start = np.concatenate([SWING * np.linspace(1.0, -0.5, links), np.zeros(links)])[None]
    return swings(ours.derived(pendulum.system(links), folder), start, 10.0)
