"""Sweeps: how many runs, in which order, within which ranges; run i alone is run i of the list."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qddot.runner.study.batch_schema import SweepTable
from qddot.runner.study.overrides import changed, parsed
from qddot.runner.study.sweep import sweep_of

NAMES = ("a", "b", "c", "d")
counts = st.lists(st.integers(1, 6), min_size=1, max_size=4)


def sweep(axes, **others):
    return sweep_of(SweepTable.model_validate({"axes": axes, **others}))


def grid(sizes):
    return [
        {"key": f"parameters.{name}", "linspace": [0.0, float(size), size]}
        for name, size in zip(NAMES, sizes, strict=False)
    ]


@given(counts)
def test_a_grid_is_the_product_of_its_axes_the_last_one_fastest(sizes):
    found = sweep(grid(sizes))
    expected = list(itertools.product(*(np.linspace(0.0, size, size) for size in sizes)))
    assert len(found) == len(expected)
    keys = [f"parameters.{name}" for name, _ in zip(NAMES, sizes, strict=False)]
    assert [found.changes(i) for i in range(len(found))] == [dict(zip(keys, row, strict=True)) for row in expected]


@given(counts, st.data())
def test_coordinates_are_what_the_runs_are_set_to(sizes, data):
    found = sweep(grid(sizes))
    run = data.draw(st.integers(0, len(found) - 1))
    coordinates = [found.coordinate(axis)[run] for axis in range(len(found.axes))]
    assert list(found.changes(run).values()) == coordinates


@given(st.integers(1, 20), st.integers(1, 5))
def test_zipped_axes_advance_together_and_multiply_with_others(size, others):
    axes = [
        {"key": "parameters.a", "range": [0, size], "zip": "one"},
        {"key": "parameters.b", "range": [0, others]},
        {"key": "parameters.c", "range": [100, 100 + size], "zip": "one"},
    ]
    found = sweep(axes)
    assert len(found) == size * others
    rows = [found.changes(i) for i in range(len(found))]
    assert all(row["parameters.c"] == row["parameters.a"] + 100 for row in rows)
    assert len({tuple(row.values()) for row in rows}) == len(found)


ways = st.sampled_from(["random", "latin_hypercube", "sobol", "halton"])
ranges = st.tuples(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6)).map(lambda pair: (pair[0], pair[0] + pair[1]))


@settings(deadline=None, max_examples=40)
@given(ways, st.integers(1, 64), ranges, st.integers(0, 2**31), st.integers(-50, 50))
def test_samples_lie_in_their_ranges_and_come_again_with_the_seed(way, samples, ends, seed, low):
    axes = [
        {"key": "parameters.a", "uniform": ends},
        {"key": "parameters.b", "loguniform": [1e-3, 1e3]},
        {"key": "parameters.c", "integers": [low, low + 7]},
    ]
    found = sweep(axes, samples=samples, sampling=way, seed=seed)
    again = sweep(axes, samples=samples, sampling=way, seed=seed)
    assert len(found) == samples
    a, b, c = (found.coordinate(i) for i in range(3))
    assert ((ends[0] <= a) & (a <= ends[1])).all()
    assert (abs(np.log10(b)) <= 3 + 1e-12).all()
    assert set(c.tolist()) <= set(range(low, low + 7))
    assert [found.changes(i) for i in range(samples)] == [again.changes(i) for i in range(samples)]


def test_another_seed_draws_other_samples():
    axes = [{"key": "parameters.a", "uniform": [0, 1]}]
    one, other = (sweep(axes, samples=8, seed=seed).coordinate(0) for seed in (1, 2))
    assert not set(one) & set(other)


def test_a_latin_hypercube_has_one_point_in_each_slice_and_random_points_have_not():
    axes = [{"key": f"parameters.{name}", "uniform": [0, 1]} for name in "ab"]
    spread = sweep(axes, samples=50, sampling="latin_hypercube", seed=3)
    for axis in range(2):
        assert sorted(np.floor(50 * spread.coordinate(axis)).astype(int)) == list(range(50))
    drawn = sweep(axes, samples=50, sampling="random", seed=3)
    assert len(set(np.floor(50 * drawn.coordinate(0)).astype(int))) < 50


def test_a_normal_axis_has_its_mean_and_deviation():
    found = sweep([{"key": "parameters.a", "normal": [5.0, 2.0]}], samples=4096, sampling="sobol").coordinate(0)
    assert found.mean() == pytest.approx(5.0, abs=0.01)
    assert found.std() == pytest.approx(2.0, rel=0.01)


def test_samples_multiply_with_a_grid():
    axes = [{"key": "parameters.a", "uniform": [0, 1]}, {"key": "parameters.b", "values": [1, 2, 3]}]
    found = sweep(axes, samples=5)
    assert len(found) == 15
    assert found.coordinate(0).reshape(5, 3)[:, 0] == pytest.approx(found.coordinate(0).reshape(5, 3)[:, 2])


def test_units_stand_in_the_settings():
    found = sweep([{"key": "road.speed", "linspace": ["10 km/h", "40 km/h", 4]}])
    assert [found.changes(i)["road.speed"] for i in range(4)] == ["10.0 km/h", "20.0 km/h", "30.0 km/h", "40.0 km/h"]
    assert found.axes[0].unit == "km/h"
    mixed = sweep([{"key": "road.speed", "values": ["36 km/h", "5 m/s"]}])
    assert mixed.coordinate(0) == pytest.approx([36.0, 18.0])
    declared = sweep([{"key": "inputs.F.times.0", "linspace": [0.5, 3.0, 2], "unit": "s"}])
    assert declared.changes(1) == {"inputs.F.times.0": "3.0 s"}


def test_offset_and_factor_map_a_value_to_its_setting():
    axis = {"key": "inputs.F.times.0", "linspace": [0.5, 3.0, 2], "unit": "s", "offset": "4000 ms", "factor": -1}
    assert [sweep([axis]).changes(i)["inputs.F.times.0"] for i in range(2)] == ["3.5 s", "1.0 s"]
    assert sweep([axis]).coordinate(0) == pytest.approx([0.5, 3.0])


def test_one_value_may_go_to_several_keys_and_anything_may_be_a_value():
    keys = ["parameters.k_6", "parameters.k_7"]
    assert sweep([{"key": keys, "values": [1.5]}]).changes(0) == dict.fromkeys(keys, 1.5)
    found = sweep([{"key": "inputs.F.times", "values": [[1.0], [1.0, 2.85]], "labels": ["one", "two"]}])
    assert found.changes(1) == {"inputs.F.times": [1.0, 2.85]}
    assert list(found.coordinate(0)) == ["one", "two"]


def test_a_hundred_thousand_runs_are_made_one_by_one():
    axes = [{"key": f"parameters.{name}", "linspace": [0, 1, 100]} for name in "ab"]
    found = sweep([*axes, {"key": "parameters.c", "range": [0, 1000]}])
    assert len(found) == 10_000_000
    assert found.changes(9_999_999) == {"parameters.a": 1.0, "parameters.b": 1.0, "parameters.c": 999}
    with pytest.raises(IndexError, match="the runs are 0 to 9999999"):
        found.changes(10_000_000)


def test_no_axes_make_one_run():
    assert len(sweep([])) == 1
    assert sweep([]).changes(0) == {}


TREE = {"model": "m", "inputs": {"F": {"times": [1.0, 2.0], "peak": 3.0}}, "integration": {"step": 0.1}}


def test_a_change_leaves_the_rest_and_the_original_alone():
    after = changed(TREE, {"inputs.F.times.1": 5.0, "parameters.m_6": "9 t"})
    assert after["inputs"] == {"F": {"times": [1.0, 5.0], "peak": 3.0}}
    assert after["parameters"] == {"m_6": "9 t"}
    assert TREE["inputs"]["F"]["times"] == [1.0, 2.0]
    assert after["integration"] is TREE["integration"]


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("inputs.G.peak", "unknown table 'G'; there are: F"),
        ("inputs.F.times.2", "inputs.F.times has 2 items, so none at place 2"),
        ("inputs.F.times.first", "inputs.F.times is a list"),
        ("inputs.F.peak.x", "inputs.F.peak is 3.0, which has no 'x' in it"),
        ("rod.speed", "unknown table 'rod'"),
    ],
)
def test_a_key_that_leads_nowhere_is_named(key, message):
    with pytest.raises(ValueError, match=message):
        changed(TREE, {key: 1.0})


def test_settings_of_the_command_line_are_toml_values_or_texts():
    found = parsed(
        ["parameters.m_6=11e3", "inputs.F.peak = 9 kN", "span=[0, 5]", 'title="a = b"', "integration.bdf=true"]
    )
    assert found == {
        "parameters.m_6": 11e3,
        "inputs.F.peak": "9 kN",
        "span": [0, 5],
        "title": "a = b",
        "integration.bdf": True,
    }
    for wrong in ("parameters.m_6", "=3", "a..b=1", " = "):
        with pytest.raises(ValueError, match="expected key=value"):
            parsed([wrong])
