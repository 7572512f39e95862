"""Models drawn at random, by all methods, alone, in lanes, exactly, against runs that nothing of qddot's computed."""

import numpy as np
import pytest
from random_models import COUNT, SPAN, case
from reference_runs import TIMES, digest, reference, stored

import qddot
from qddot.codegen.generate import generate
from qddot.runner.lanes.way import IN_LANES
from qddot.runner.methods import METHODS

#: Numbers of the models that are drawn anew behind the mark, beside those whose runs are stored.
MORE = range(COUNT, 3 * COUNT)
#: Tolerances of methods of variable step, and the error that is allowed then, of the largest state.
RTOL, ATOL, ALLOWED = 1e-10, 1e-12, 1e-7
#: Step of methods of constant step, s; a run of half of it tells the error.
STEP = 1e-3
#: Runs of a batch: more than there are lanes, so that one is refilled.
RUNS = 11


def loaded(drawn, folder):
    return qddot.load(generate(drawn.system, folder))


def settings(drawn):
    inputs = {name: drive.signal for name, drive in drawn.drives.items()}
    return {"inputs": inputs, "initial": drawn.initial, "output_times": TIMES}


def states(solution, model):
    """States (3, n_states) at TIMES."""
    places = np.searchsorted(solution.t, np.array(TIMES) - 1e-9)
    return np.stack([solution[name][places] for name in model.state_names], axis=1)


def assert_alone(drawn, model, method, x, accelerations):
    """A run by this method is the reference, to the error that its own steps or tolerances allow."""
    size, given = max(1.0, np.abs(x).max()), settings(drawn)

    def run(**options):
        return qddot.simulate(model, SPAN, method=method, **options, **given)

    if METHODS[method].family == "fixed":
        coarse, fine = (states(run(step=h), model) for h in (STEP, STEP / 2))
        off, allowed = np.abs(fine - x).max(), 2.0 * np.abs(coarse - fine).max() + 1e-10 * size
        assert off < allowed, (method, off, allowed)
        return
    solution = run() if method == "exact" else run(rtol=RTOL, atol=ATOL)
    off = np.abs(states(solution, model) - x).max()
    assert off < ALLOWED * size, (method, off)
    found = solution["acceleration"][np.searchsorted(solution.t, np.array(TIMES) - 1e-9)]
    assert np.abs(found - accelerations).max() < 100 * ALLOWED * max(1.0, np.abs(accelerations).max()), method


def assert_in_batches(drawn, model, methods):
    """Runs at once, of which each has a first parameter of its own, are what they are alone."""
    name = next(iter(drawn.values))
    values = drawn.values[name] * (1 + 0.01 * np.arange(RUNS))
    given = settings(drawn)
    for method in methods:
        fixed = METHODS[method].family == "fixed"
        options = {"step": STEP} if fixed else {} if method == "exact" else {"rtol": RTOL, "atol": ATOL}
        batch = qddot.simulate_batch(model, SPAN, method=method, parameters={name: values}, **options, **given)
        assert batch.reason == "" or method == "exact" or (method == "taylor" and drawn.kind == "kinked")
        for run in (0, RUNS - 1):
            alone = qddot.simulate(model, SPAN, method=method, parameters={name: values[run]}, **options, **given)
            np.testing.assert_allclose(batch.samples[run], states(alone, model), rtol=0, atol=1e-8, err_msg=method)


def methods_of(drawn):
    return [name for name in METHODS if name != "exact" or drawn.kind == "linear"]


@pytest.fixture(scope="session")
def folder(request, tmp_path_factory):
    """Where kernels are kept from one session to the next, so that they are compiled once."""
    cache = getattr(request.config, "cache", None)
    return cache.mkdir("drawn_models") if cache is not None else tmp_path_factory.mktemp("drawn_models")


@pytest.mark.parametrize("number", range(COUNT))
def test_every_method_gives_what_others_compute(number, folder):
    drawn, kept = case(number), stored()[str(number)]
    assert digest(drawn) == kept["digest"], "the model is another: python tests/reference_runs.py"
    model = loaded(drawn, folder)
    assert model.tables.linear == (drawn.kind == "linear")
    for method in methods_of(drawn):
        assert_alone(drawn, model, method, np.array(kept["x"]), np.array(kept["a"]))
    if number % 3 == 0 or number < 12:
        in_lanes = [method for method in IN_LANES if number < 12 or method in ("rk4", "dop853")]
        assert_in_batches(drawn, model, [*in_lanes, *(["exact"] if drawn.kind == "linear" else [])])


def test_the_models_are_of_all_kinds():
    drawn = [case(number) for number in range(COUNT)]
    assert {(each.kind, len(each.drives)) for each in drawn} >= {(kind, 1) for kind in ("linear", "curved", "kinked")}
    assert {len(each.system.coordinates) for each in drawn} == {1, 2, 3}
    assert {drive.sine is None for each in drawn for drive in each.drives.values()} == {True, False}
    assert {digest(each) for each in drawn} == {each["digest"] for each in stored().values()}


@pytest.mark.long
@pytest.mark.parametrize("number", [*range(COUNT), *MORE])
def test_more_models_and_the_stored_runs_computed_again(number, folder):
    drawn = case(number)
    print(f"model {number}: {digest(drawn)}")
    x, accelerations = reference(drawn)
    if number < COUNT:
        np.testing.assert_allclose(stored()[str(number)]["x"], x, rtol=0, atol=1e-9)
    model = loaded(drawn, folder)
    for method in methods_of(drawn):
        assert_alone(drawn, model, method, x, accelerations)
    exact = ["exact"] if drawn.kind == "linear" else []
    assert_in_batches(drawn, model, [*IN_LANES, *exact])
