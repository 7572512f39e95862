"""Long tables in lanes: every lane finds its piece by computing, and each run is what it is alone."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lane_assembly import FEATURES, SCALAR, fresh, needs_avx

import qddot
from qddot.runner.lanes.guides import guide_for, hops_of, is_even
from qddot.runner.lanes.samples import interpolate, weigh
from qddot.runner.lanes.signals import stack_runs
from qddot.runner.lanes.tables import EVEN, GUIDED, find_even, find_guided, go_on, measure, read_pieces


@pytest.fixture(scope="module")
def m113():
    return qddot.load("m113")


#: At rest, rounding would decide how long the first step is.
START = np.linspace(-0.02, 0.02, 14)
METHODS = {"rk4": {"step": 2e-4}, "dop853": {"rtol": 1e-6, "atol": 1e-9}}
#: Distances of the points of a road.
LENGTHS = {
    "even": np.full(3000, 0.01),
    "uneven": np.random.default_rng(3).uniform(0.004, 0.016, 3000),
    "bunched": np.resize([0.1, *[1e-4] * 9], 3000),
}


@pytest.mark.parametrize(
    ("kind", "lengths", "way", "method"),
    [
        ("linear", "even", EVEN, "rk4"),
        ("cubic", "even", EVEN, "dop853"),
        ("linear", "uneven", GUIDED, "rk4"),
        ("cubic", "uneven", GUIDED, "dop853"),
        ("linear", "bunched", 0, "rk4"),
    ],
)
def test_runs_share_the_points_of_a_road(m113, kind, lengths, way, method):
    places = -5 + np.cumsum(LENGTHS[lengths])
    road = qddot.signal.table(places, 0.02 * np.sin(2 * places) + 0.01 * np.cos(5 * places), kind=kind)
    speeds, names = np.linspace(3, 8, 10) * np.resize([1, -1], 10), [f"z_{i}" for i in range(1, 6)]
    inputs = {name: qddot.per_run(road, rate=speeds, offset=0.66 * i) for i, name in enumerate(names)}
    table = stack_runs(m113.tables, inputs, 10)
    assert len(table.pieces) < 3010
    assert (table.way[:5] == way).all()
    settings = {"parameters": "as_run_unloaded", "method": method, "initial": START} | METHODS[method]
    columns = ["q_1", *(output.name for output in m113.tables.outputs)]
    batch = qddot.simulate_batch(m113, (0, 0.2), inputs=inputs, output_times=21, names=columns, **settings)
    for run in (0, 1, 8, 9):
        signals = {name: road.shifted(speeds[run], 0.66 * i) for i, name in enumerate(names)}
        solution = qddot.simulate(m113, (0, 0.2), inputs=signals, output_times=batch.output_times[run], **settings)
        np.testing.assert_allclose(batch.final[run], solution.states[-1], rtol=0, atol=1e-11)
        expected = np.array([solution[each] for each in columns]).T
        np.testing.assert_allclose(batch.samples[run], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
        assert batch.steps[run] == solution.statistics.steps


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.2, 1.0), min_size=17, max_size=60), st.floats(0.0, 1.0))
def test_a_guide_and_its_hops_find_the_piece(lengths, part):
    starts = np.cumsum(lengths)
    pieces = qddot.signal.table(starts, np.sin(starts)).pieces
    guide = guide_for(pieces)
    assert len(guide) > 0
    tau = starts[0] - 0.5 + part * (starts[-1] - starts[0] + 1.0)
    bucket = int(np.clip((tau - starts[0]) * (len(guide) - 2) / (starts[-1] - starts[0]) + 1, 0, len(guide) - 1))
    expected = int(np.searchsorted(pieces[1:, 0], tau, side="right"))
    assert guide[bucket] <= expected <= guide[bucket] + hops_of(guide)


def test_only_tables_without_sines_are_found_by_computing():
    wave = qddot.signal.pulse_train(times=np.arange(40.0), duration=0.5, impulse=1.0)
    assert not is_even(wave.pieces)
    assert len(guide_for(wave.pieces)) == 0
    assert is_even(qddot.signal.table(np.arange(40.0), np.arange(40.0) ** 2).pieces)
    assert not is_even(qddot.signal.table(np.arange(10.0), np.arange(10.0) ** 2).pieces)


#: A look at the guide is a gather and little else: without AVX-512 the compiler rightly finds eight loads cheaper.
GATHERS = pytest.param(find_guided, marks=pytest.mark.skipif(not FEATURES.get("avx512f"), reason="no AVX-512"))


@needs_avx
@pytest.mark.parametrize("loop", [find_even, GATHERS, go_on, measure, weigh, interpolate])
def test_loops_over_tables_and_samples_are_vectors(loop):
    assembly = fresh(loop.py_func, loop.nopython_signatures[0])
    assert re.search(r"v(mul|fn?m\w*|sub)pd\s.*%[yz]mm", assembly)
    assert not re.search(r"v(mul|div|fn?m\w*)sd", assembly)


@needs_avx
def test_pieces_are_read_as_vectors_and_transposed():
    assembly = fresh(read_pieces.py_func, read_pieces.nopython_signatures[0])
    assert len(re.findall(r"v(fn?m\w*|mul)pd\s.*%[yz]mm", assembly)) >= 6
    assert not re.search(SCALAR, assembly)
    assert "gather" not in assembly
