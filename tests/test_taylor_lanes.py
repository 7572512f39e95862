"""Taylor's method in lanes: each run is what it is alone, whatever its neighbours do, and fails alone."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import qddot
from qddot.runner.inputs.signal import Signal
from qddot.runner.lanes import way
from qddot.runner.lanes.way import way_of
from qddot.runner.load import available
from qddot.runner.machine import series_code
from qddot.runner.methods import METHODS
from qddot.runner.options import Options
from qddot.runner.problem import Status

TOLERANCES = {"rtol": 1e-9, "atol": 1e-11}
load = cache(qddot.load)
TAYLOR = METHODS["taylor"]
IN_LANES = [name for name in available() if not way_of(load(name), TAYLOR, Options())[1]]


def signals(runs, rng):
    """Signals of all kinds, each of them another one in every run."""
    table = qddot.signal.table(np.linspace(-1.0, 3.0, 9), rng.uniform(-0.05, 0.05, 9), kind="cubic")
    lines = qddot.signal.table([-1.0, 0.1, 0.4, 3.0], [0.0, 0.02, -0.01, 0.03])
    pulse = qddot.signal.pulse_train(times=[0.0, 0.3], peak=1.0, duration=0.05)
    shapes = [qddot.signal.sine(0.02, 1.5, 0.3), pulse, table, lines, qddot.signal.sine(0.01, 4.0)]
    return lambda i: qddot.per_run(shapes[i % 5], rate=rng.uniform(0.5, 1.5, runs), offset=-rng.uniform(0, 0.2, runs))


def batch_of(model, runs, seed=0):
    """Parameters, starts and inputs of as many runs, all different."""
    rng = np.random.default_rng(seed)
    values = model.parameter_values() * rng.uniform(0.8, 1.2, (runs, len(model.tables.parameters)))
    of_channel = signals(runs, rng)
    inputs = {name: of_channel(i) for i, name in enumerate(model.tables.free_inputs)}
    return {
        "parameters": values,
        "initial": rng.uniform(-0.5, 0.5, (runs, len(model.state_names))),
        "inputs": inputs,
    }


def alone(model, span, batch, run, times, **options):
    """A run of a batch by itself."""
    names = [parameter.name for parameter in model.tables.parameters]
    values = batch["parameters"][run]
    own = {name: each.signal.shifted(each.rate[run], each.offset[run]) for name, each in batch["inputs"].items()}
    return qddot.simulate(
        model, span, method="taylor", parameters=dict(zip(names, map(float, values), strict=True)), inputs=own,
        initial=batch["initial"][run], output_times=times, on_failure="return", **(TOLERANCES | options),
    )  # fmt: skip


def assert_alike(model, found, batch, spans, chosen, allowed=1e-11, **options):
    """Samples, final states, counts and ends of these runs are those of the same runs alone."""
    for run in chosen:
        inside = found.output_times[run] <= spans[1][run]
        one = alone(model, (spans[0][run], spans[1][run]), batch, run, found.output_times[run][inside], **options)
        wanted = np.isin(one.t, found.output_times[run])  # a run alone has its start and its end besides
        expected = np.array([one[name][wanted] for name in found.names]).T
        scale = 1.0 + np.abs(expected).max(axis=0)
        assert np.abs((found.samples[run][inside] - expected) / scale).max() < allowed, run
        assert np.isnan(found.samples[run][~inside]).all()
        size = 1.0 + np.abs(one.states[-1]).max()
        assert np.abs(found.final[run] - one.states[-1]).max() < allowed * size, run
        assert found.steps[run] == one.statistics.steps
        assert found.evaluations[run] == one.statistics.evaluations
        assert Status(found.status[run]) is one.status
    assert (found.failed_attempts == 0).all()


@pytest.mark.parametrize("name", IN_LANES)
def test_a_run_in_lanes_is_what_it_is_alone(name):
    """Other parameters, starts, inputs and spans in each run, more runs than lanes, no multiple of them."""
    model, runs = load(name), 13
    batch, rng = batch_of(model, runs), np.random.default_rng(1)
    spans = rng.uniform(-0.1, 0.1, runs), rng.uniform(0.2, 0.9, runs)
    names = [*model.state_names, *(output.name for output in model.tables.outputs)]
    times = [0.12, 0.2, 0.5, 0.7]
    found = qddot.simulate_batch(
        model, spans, method="taylor", output_times=times, names=names, **batch, **TOLERANCES
    )  # fmt: skip
    assert found.in_lanes
    assert found.success.all()
    assert_alike(model, found, batch, spans, (0, 5, 7, 8, 12))


def test_most_shipped_models_go_in_lanes_and_the_others_say_why_not():
    assert set(IN_LANES) >= {"m113", "half_car", "cart_pole", "double_pendulum", "pendulum", "chain"}
    assert "has conditions" in way_of(load("recoil_damper"), TAYLOR, Options())[1]
    assert "has constraints" in way_of(load("four_bar"), TAYLOR, Options())[1]


def test_conditions_turn_for_each_run_alone_with_the_same_results():
    model = load("recoil_damper")
    x = np.zeros((3, len(model.state_names)))
    x[:, 0] = [0.01, 0.02, 0.03]
    found = qddot.simulate_batch(model, (0.0, 0.01), method="taylor", initial=x, **TOLERANCES)
    one = qddot.simulate(model, (0.0, 0.01), method="taylor", initial=x[1], **TOLERANCES)
    assert not found.in_lanes
    np.testing.assert_array_equal(found.final[1], one.states[-1])


@pytest.mark.parametrize(("name", "limit"), [("chain", "MOST_NODES"), ("pendulum", "MOST_UNKNOWNS")])
def test_a_model_that_is_too_large_for_lanes_goes_alone_with_the_same_results(name, limit, monkeypatch):
    model = load(name)
    batch = batch_of(model, 2)
    expected = qddot.simulate_batch(model, (0.0, 0.3), method="taylor", **batch, **TOLERANCES)
    monkeypatch.setattr(way, limit, 2)
    found = qddot.simulate_batch(model, (0.0, 0.3), method="taylor", **batch, **TOLERANCES)
    assert not found.in_lanes
    assert "fills vectors alone" in found.reason
    np.testing.assert_allclose(found.final, expected.final, rtol=0, atol=1e-11)


@pytest.mark.parametrize("runs", [0, 1, 8, 17])
def test_any_number_of_runs_gives_the_same(runs):
    """A run does not depend on its lane, nor on its neighbours: to the bit."""
    model = load("cart_pole")
    batch = batch_of(model, 17)
    given = {"method": "taylor", "output_times": 4, **TOLERANCES}
    whole = qddot.simulate_batch(model, (0.0, 0.5), **batch, **given)
    part = {name: each[:runs] for name, each in batch.items() if name != "inputs"}
    part["inputs"] = {
        name: qddot.per_run(each.signal, each.rate[:runs], each.offset[:runs]) for name, each in batch["inputs"].items()
    }
    found = qddot.simulate_batch(model, (0.0, 0.5), **part, **given)
    for name in ("final", "samples", "status", "steps", "evaluations"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name)[:runs])


def test_threads_share_the_runs():
    model = load("double_pendulum")
    batch = batch_of(model, 40)
    given = {"method": "taylor", "output_times": 3, **TOLERANCES}
    one, two = (qddot.simulate_batch(model, (0.0, 1.0), threads=k, **batch, **given) for k in (1, 2))
    np.testing.assert_array_equal(one.samples, two.samples)


SPAN = st.tuples(st.floats(-1.0, 1.0), st.floats(0.01, 1.0))


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    spans=st.lists(SPAN, min_size=1, max_size=19),
    seed=st.integers(0, 1000),
    name=st.sampled_from(["cart_pole", "half_car", "double_pendulum"]),
    options=st.fixed_dictionaries(
        {}, optional={"max_step": st.sampled_from([0.03, 0.3]), "first_step": st.sampled_from([1e-4, 10.0])}
    ),
)
def test_random_spans_starts_parameters_and_options(spans, seed, name, options):
    model, runs = load(name), len(spans)
    batch = batch_of(model, runs, seed)
    t0, length = np.array(spans).T
    found = qddot.simulate_batch(
        model, (t0, t0 + length), method="taylor", output_times=4, **batch, **TOLERANCES, **options
    )  # fmt: skip
    assert found.success.all()
    assert_alike(model, found, batch, (t0, t0 + length), {0, runs // 2, runs - 1}, 1e-10, **options)


def test_a_run_that_diverges_fails_alone_as_it_does_by_itself():
    model = load("cart_pole")
    batch = batch_of(model, 12)
    given = {"method": "taylor", **TOLERANCES}
    good = qddot.simulate_batch(model, (0.0, 2.0), **batch, **given)
    batch["initial"][[3, 9], 2] = 9e3, -2e5  # too far after a second, too fast at once
    found = qddot.simulate_batch(model, (0.0, 2.0), divergence_limit=1e4, **batch, **given)
    others = np.setdiff1d(np.arange(12), [3, 9])
    assert found.success[others].all()
    np.testing.assert_array_equal(found.final[others], good.final[others])
    for run in (3, 9):
        one = alone(model, (0.0, 2.0), batch, run, [2.0], divergence_limit=1e4)
        assert Status(found.status[run]) is one.status is Status.NON_FINITE
        assert found.failed_at[run] == pytest.approx(one.failed_at, rel=1e-12)
        assert found.failed_state[run] == one.failed_state
        assert (found.steps[run], found.evaluations[run]) == (one.statistics.steps, one.statistics.evaluations)
        np.testing.assert_allclose(found.final[run], one.states[-1], rtol=1e-11)


def test_a_start_that_is_no_number_and_too_many_steps_end_a_run():
    model = load("double_pendulum")
    x = np.random.default_rng(5).uniform(-1.0, 1.0, (11, 4))
    x[4, 2] = 1e200
    found = qddot.simulate_batch(model, (0.0, 1.0), method="taylor", initial=x, output_times=3)
    assert Status(found.status[4]) is Status.NON_FINITE
    assert found.failed_at[4] == 0.0
    assert (found.success == (np.arange(11) != 4)).all()
    np.testing.assert_array_equal(found.final[4], x[4])
    few = qddot.simulate_batch(model, (0.0, [1.0, 50.0, 50.0]), method="taylor", initial=x[:3], max_steps=40)
    assert [Status(each) for each in few.status] == [Status.FINISHED, *2 * [Status.TOO_MANY_STEPS]]
    assert few.steps.tolist() == [few.steps[0], 40, 40]


def test_every_lane_ends_its_steps_where_its_own_inputs_jump():
    """The recoil of shots at other times, beside exact propagation."""
    model, shots = load("m113"), np.linspace(0.03, 0.15, 11)
    shot = qddot.signal.pulse_train(times=[0.0], duration=0.02, impulse=605.0)
    given = {"parameters": "as_run_unloaded", "inputs": {"F": qddot.per_run(shot, offset=-shots)}}
    found = qddot.simulate_batch(model, (0.0, 0.3), method="taylor", rtol=1e-11, atol=1e-14, **given)
    exact = qddot.simulate_batch(model, (0.0, 0.3), method="exact", **given)
    assert found.in_lanes
    np.testing.assert_allclose(found.final, exact.final, rtol=0, atol=1e-11)


def test_a_long_table_is_walked_piece_by_piece():
    """Other methods compute in lanes where on a long table they are."""
    model, x = load("quarter_car"), np.linspace(-1.0, 31.0, 401)
    road = qddot.signal.table(x, 0.01 * np.sin(x), kind="cubic")
    speeds = np.linspace(8.0, 15.0, 9)
    given = {"inputs": {model.tables.free_inputs[0]: qddot.per_run(road, rate=speeds)}, "initial": np.zeros(4)}
    found = qddot.simulate_batch(model, (0.0, 2.0), method="taylor", **given, **TOLERANCES)
    exact = qddot.simulate_batch(model, (0.0, 2.0), method="exact", **given)
    assert found.steps.min() > 2.0 * 8.0 / (x[1] - x[0])
    np.testing.assert_allclose(found.final, exact.final, rtol=0, atol=1e-9)


@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_parts_of_any_width_give_the_same(lanes, monkeypatch):
    """What a register holds is the machine's matter: rows go in parts, or whole."""
    model = load("pendulum")
    tables = model.tables
    inputs = tuple(channel.name for channel in tables.inputs[: tables.rhs_inputs])
    monkeypatch.setattr(series_code, "_register", lambda: lanes)
    code = series_code.series_code.__wrapped__(tables.recurrence, model.state_names, inputs, tables.constant_names, 8)
    batch = batch_of(model, 9)
    expected = qddot.simulate_batch(model, (0.0, 0.5), method="taylor", **batch, **TOLERANCES)
    monkeypatch.setitem(vars(model), "lane_series", code)
    found = qddot.simulate_batch(model, (0.0, 0.5), method="taylor", **batch, **TOLERANCES)
    np.testing.assert_allclose(found.final, expected.final, rtol=1e-13, atol=1e-13)


def test_no_signal_is_left_out():
    """What the tests above give to inputs has every kind of piece."""
    rng = np.random.default_rng(0)
    of_channel = signals(1, rng)
    kinds = [of_channel(i).signal for i in range(5)]
    assert all(isinstance(each, Signal) for each in kinds)
    assert [bool(each.pieces[:, 5].any()) for each in kinds] == [True, True, False, False, True]
