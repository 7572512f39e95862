"""What a program holds survives pickle, copy, and processes that are forked or spawned."""

import copy
import importlib
import multiprocessing
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

import qddot
from qddot.runner.load import LoadError, load
from qddot.runner.problem import Status

ROOT = Path(__file__).parents[1]
CAR = qddot.load("quarter_car")
PULSE = qddot.signal.table([0.0, 0.1, 0.2], [0.0, 0.01, 0.0])
WAYS = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@pytest.fixture(scope="module")
def diverged():
    return _failing(CAR)


@pytest.fixture(params=WAYS)
def again(request):
    return WAYS[request.param]


def _failing(model):
    """A run that leaves its limit, as an exception."""
    try:
        qddot.simulate(model, (0, 1), step=1e-3, initial={"z_s": 1e-3}, inputs={"z_r": PULSE}, divergence_limit=1e-9)
    except qddot.IntegrationError as error:
        return error
    raise AssertionError("it should have failed")


def _raise_in_worker(model):
    raise _failing(model)


def test_a_failed_run_survives(diverged, again):
    error = again(diverged)
    assert type(error) is qddot.IntegrationError
    assert str(error) == str(diverged)
    found, expected = error.solution, diverged.solution
    assert found.status is expected.status is Status.NON_FINITE
    np.testing.assert_array_equal(found.values, expected.values)
    assert found.metadata == expected.metadata
    assert not found.t.flags.writeable
    np.testing.assert_array_equal(found[CAR.state_names[0]], expected[CAR.state_names[0]])


def _exceptions():
    """Every exception class of ours, found in the source."""
    for room in ("units", "model", "codegen", "runner"):
        for path in sorted((ROOT / room).rglob("*.py")):
            for name in re.findall(r"(?m)^class (\w*(?:Error|Exception))\b", path.read_text(encoding="utf-8")):
                yield ".".join(("qddot", *path.relative_to(ROOT).with_suffix("").parts)), name


@pytest.mark.parametrize(("room", "name"), sorted(set(_exceptions())))
def test_every_exception_survives(room, name, diverged, again):
    kind = getattr(importlib.import_module(room), name)
    error = diverged if kind is qddot.IntegrationError else kind("what was found, what was expected")
    found = again(error)
    assert type(found) is kind
    assert str(found) == str(error)
    assert vars(found).keys() == vars(error).keys()


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_a_pool_hands_on_a_failure_and_takes_a_model(method, diverged):
    with multiprocessing.get_context(method).Pool(1) as pool:
        job = pool.apply_async(_raise_in_worker, (CAR,))
        with pytest.raises(qddot.IntegrationError, match="diverged") as caught:
            job.get(timeout=240)
    np.testing.assert_array_equal(caught.value.solution.values, diverged.solution.values)


def test_a_model_is_the_same_after_all(again):
    assert again(CAR) is CAR


def _text_of(name):
    return (ROOT / "generated" / f"{name}.py").read_text(encoding="utf-8")


def test_a_model_by_path_carries_its_path_and_refuses_another(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(_text_of("quarter_car"), encoding="utf-8")
    model = load(path)
    assert (model.name, model.source) == ("quarter_car", str(path))
    told = pickle.dumps(model)
    assert pickle.loads(told) is model
    other = told.replace(model.digest.encode(), b"0" * len(model.digest))
    with pytest.raises(LoadError, match=r"mine.py is not the module that was pickled: its digest"):
        pickle.loads(other)


def test_what_is_pickled_of_a_model_is_its_name_and_digest_alone():
    assert len(pickle.dumps(CAR)) < 300
    assert CAR.__reduce__()[1] == ("quarter_car", "quarter_car", CAR.digest)


def test_a_regenerated_model_is_refused_where_it_is_unpickled(tmp_path):
    path = tmp_path / "changing.py"
    path.write_text(_text_of("quarter_car"), encoding="utf-8")
    told = pickle.dumps(load(path))
    path.write_text(_text_of("quarter_car") + "\n# another\n", encoding="utf-8")
    with multiprocessing.get_context("spawn").Pool(1) as pool, pytest.raises(LoadError, match="model quarter_car: "):
        pool.apply_async(pickle.loads, (told,)).get(timeout=240)


@pytest.mark.parametrize(("method", "step"), [("rk4", 1e-3), ("exact", 1e-3), ("rodas5p", None)])
def test_a_prepared_run_survives(method, step, again):
    run = qddot.prepare(CAR, (0, 0.2), method=method, step=step, inputs={"z_r": PULSE}, initial={"zdot_s": 0.1})
    found = again(run)
    assert found.model is CAR
    np.testing.assert_array_equal(found().values, run().values)


def test_signals_events_and_batches_survive(again):
    signal = again(qddot.signal.pulse_train(times=[0.1], peak=1.0, duration=0.1).shifted(2.0, 0.3))
    assert signal(-0.075) == pytest.approx(1.0)
    runs = qddot.per_run(PULSE, offset=np.array([0.0, 0.1]))
    np.testing.assert_array_equal(again(runs).offset, runs.offset)
    event = again(qddot.crossing(CAR, CAR.state_names[0], 0.005, direction=1, terminal=True))
    options = {"method": "dop853", "initial": np.zeros(4), "inputs": {"z_r": PULSE}}
    solution = qddot.simulate(CAR, (0, 1), events=[event], **options)
    assert solution.status is Status.TERMINATED
    np.testing.assert_array_equal(again(solution).events.t, solution.events.t)
    batch = qddot.simulate_batch(CAR, (0, 0.1), runs=2, output_times=3, **options)
    found = again(batch)
    np.testing.assert_array_equal(found.samples, batch.samples)
    assert found.success.all()


def test_every_public_method_survives(again):
    from qddot.runner.methods import METHODS

    for name in METHODS:
        assert again(METHODS[name]) is METHODS[name]
