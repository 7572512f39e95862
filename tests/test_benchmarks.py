"""Benchmarks say what they measure: tools agree with the reference, a missing one is named, tables hold ratios."""

import json
import math
import sys
from itertools import groupby
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

import qddot
from benchmarks import ours
from benchmarks.__main__ import run
from benchmarks.cases.case import accelerations
from benchmarks.cases.chain import by_matrix_exponential, shaken
from benchmarks.cases.m113 import drives
from benchmarks.cases.pendulum import equations_of, swings
from benchmarks.cases.reference import by_extrapolation, by_scipy
from benchmarks.contest import Tuned, at_equal_error, contest, tuned
from benchmarks.peers import peer
from benchmarks.peers.casadi import Energies
from benchmarks.report import markdown, seconds
from benchmarks.timing import Table, Timing, interleaved
from qddot.model.pendulum import system as pendulum

STARTS = np.array([[0.3, -0.2, 0.1, 0.4], [0.5, 0.1, -0.3, 0.2]])


@pytest.fixture(scope="module")
def swing():
    return swings(qddot.load("double_pendulum"), STARTS, 1.0)


@pytest.fixture(scope="module")
def shots():
    return drives(qddot.load("m113"), 2, end=1.7)


def derivative(case, run, t, x, peak):
    """What the generated kernel gives, with the inputs of a case."""
    u, dx = np.zeros(11), np.empty(len(x))
    case.inputs(t, peak, case.given[run], u)
    case.model.kernel("rhs")(t, x, u, case.constants[run], dx)
    return dx


def test_all_tools_reach_the_wanted_error_against_the_reference(swing):
    contenders = {
        "qddot": lambda case: ours.one(case, "dop853"),
        "heyoka": peer("heyoka", "one"),
        "CasADi": peer("casadi", "one"),
        "SciPy": peer("scipy", "lambdified", "DOP853"),
    }
    rows = at_equal_error(contenders, swing, 1e-7, 1)
    assert {row.name for row in rows} == set(contenders)
    assert [row.least for row in rows] == sorted(row.least for row in rows)
    for row in rows:
        assert 1e-13 < row.error <= 1e-7, row


def test_batches_restart_at_the_shots_of_their_runs(shots):
    for prepare in (lambda case: ours.many(case, "exact"), peer("heyoka", "many")):
        assert shots.error(prepare(shots)(1e-10)()) < 1e-8
    assert shots.error(shots.starts) > 0.1


@pytest.mark.parametrize("n", [1, 3, 5])
def test_equations_by_hand_are_those_of_lagrange(n):
    rng, energies = np.random.default_rng(n), Energies(pendulum(n))
    q, v = rng.uniform(-1, 1, (2, n))
    given = [0.0, *q, *v, 1.0, 1.0, 0.0, 9.81]
    expected = np.array(energies.right_hand_side()(*given)).ravel()
    M, forces = equations_of(n)(0.0, q, v, 0.0, (), math)
    case = SimpleNamespace(n=n, equations=equations_of(n))
    written_out = accelerations(case, 0.0, [*q, *v], 0.0, (), math)
    assert np.linalg.solve(M, forces) == pytest.approx(expected, rel=1e-12)
    assert written_out == pytest.approx(expected, rel=1e-12)


def test_equations_of_the_cases_are_those_of_the_generated_kernels(swing, shots):
    rng = np.random.default_rng(3)
    for case, peak in ((swing, 0.0), (shots, 9503.0), (shaken(qddot.load("chain"), 1.0), 0.0)):
        x = rng.uniform(-0.5, 0.5, 2 * case.n)
        a = accelerations(case, 0.7, x, peak, case.given[-1].tolist(), math)
        assert a == pytest.approx(derivative(case, -1, 0.7, x, peak)[case.n :], rel=1e-9)


def test_the_references_agree():
    case = shaken(qddot.load("chain"), 2.0)
    assert np.abs(by_scipy(case) - by_matrix_exponential(case)).max() < 1e-11
    assert np.abs(by_extrapolation(case) - by_matrix_exponential(case)).max() < 1e-13


def test_the_reference_of_a_pendulum_is_that_of_thirty_digits():
    case = swings(qddot.load("double_pendulum"), STARTS[:1], 0.2)
    with mpmath.workdps(30):

        def derivative(t, x):
            return [*x[2:], *accelerations(case, t, x, 0.0, (), mpmath)]

        expected = mpmath.odefun(derivative, 0, [mpmath.mpf(each) for each in STARTS[0]], tol=mpmath.mpf(10) ** -20)(
            0.2
        )
    assert case.solution(case)[0] == pytest.approx(np.array(expected, dtype=float), rel=1e-15, abs=1e-15)


def test_a_tool_that_is_missing_or_fails_is_named_with_its_reason(swing, monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    monkeypatch.delitem(sys.modules, "benchmarks.peers.heyoka", raising=False)
    contenders = {
        "heyoka": peer("heyoka", "one"),
        "wrong": lambda case: lambda tolerance: lambda: case.starts,
        "qddot": lambda case: ours.one(case, "dop853"),
    }
    rows = {row.name: row for row in at_equal_error(contenders, swing, 1e-7, 1)}
    assert math.isfinite(rows["qddot"].least)
    assert "does not take part: ModuleNotFoundError" in rows["heyoka"].note
    assert rows["heyoka"].note.endswith(": pip install heyoka")
    assert "does not take part: RuntimeError: error 1" in rows["wrong"].note


def test_the_loosest_tolerance_that_gives_the_error_is_found(swing):
    tried = []

    def prepare(case):
        def at(tolerance):
            tried.append(tolerance)
            return lambda: case.exact + 30 * tolerance

        return at

    few = swing.first(1)
    found = tuned(prepare, few, few, 1e-6)
    assert found.error <= 1e-6 < few.error(few.exact + 30 * found.tolerance * 10**0.5)
    assert min(tried) == pytest.approx(found.tolerance)


def test_contenders_take_turns_after_one_that_does_not_count():
    calls = []
    rows = interleaved({name: lambda name=name: calls.append(name) for name in "ab"}, 3)
    assert [name for name, _ in groupby(calls)] == list("abababab")
    assert len(calls) > 8  # who is quick runs more than once in a turn
    assert [row.name for row in rows] == ["a", "b"]
    assert all(0 < row.least <= row.median for row in rows)


def test_contests_run_each_contender_once_before_they_are_timed():
    calls = []
    contest({name: lambda name=name: Tuned(lambda: calls.append(name), 0.0, 0.0) for name in "ab"}, 2)
    assert [name for name, _ in groupby(calls)] == list("ababab")
    assert calls[:2] == ["a", "b"]  # once each, then the turns


def test_tables_hold_ratios_to_the_first_row():
    table = Table("T", (Timing("a", 2e-3, 3e-3, error=1e-9), Timing("b", 5e-3, 6e-3), Timing("c", note="gone")), "run")
    lines = markdown(table).splitlines()
    assert lines[2] == "|  | ratio | least, a run | median, a run | error |  |"
    assert lines[4:] == [
        "| a | 1 | 2 ms | 3 ms | 1.0e-09 |  |",
        "| b | 2.5 | 5 ms | 6 ms |  |  |",
        "| c |  |  |  |  | gone |",
    ]
    assert [seconds(x) for x in (2.0, 0.99999, 1.5e-4, 3e-8)] == ["2 s", "1 s", "150 µs", "30 ns"]


def test_a_group_that_fails_is_named_and_costs_no_other_its_tables(tmp_path, capsys):
    def broken(quick):
        yield Table("before", (Timing("a", 1.0, 1.0),))
        raise ValueError("out of order")

    def batch(quick):
        rows = (Timing("qddot", 1e-3, 1e-3, share=0.3), Timing("another", 2e-3, 2e-3), Timing("c", note="gone"))
        yield Table("after", rows, "run")

    groups = {"first": SimpleNamespace(groups=broken), "second": SimpleNamespace(groups=batch)}
    assert run(groups, True, tmp_path) == 1
    assert "group first failed: ValueError: out of order" in capsys.readouterr().out
    content = json.loads((tmp_path / "benchmarks.json").read_text())
    assert content["failures"] == {"first": "ValueError: out of order"}
    assert [table["title"] for tables in content["groups"].values() for table in tables] == ["before", "after"]
    assert "### after" in (tmp_path / "benchmarks.md").read_text()
    assert (tmp_path / "throughput.png").stat().st_size > 5000
    assert (tmp_path / "share_of_peak.png").stat().st_size > 5000
