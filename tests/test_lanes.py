"""Runs in lanes: each equals the same run alone, whatever its neighbours do."""

import re
from pathlib import Path

import numpy as np
import pytest
from commands import command
from lane_assembly import FEATURES, PACKED, SCALAR, fresh, needs_avx
from models import MODELS
from numba import njit, types

import qddot
from qddot.model import chain
from qddot.runner import abi
from qddot.runner.lanes.kernel import form_of, lane_rhs
from qddot.runner.lanes.vectors import combine, conclude, estimate_errors
from qddot.runner.lanes.way import IN_LANES
from qddot.runner.machine.calls import call_advance, call_lanes
from qddot.runner.machine.memory import on_cache_line
from qddot.runner.machine.pointers import pointer
from qddot.runner.methods import METHODS
from qddot.runner.problem import Status

RTOL = 1e-6


@pytest.fixture(scope="module")
def m113_model():
    return qddot.load("m113")


def settings_of(method):
    return {"rtol": RTOL, "atol": 1e-9} if METHODS[method].adaptive else {"step": 2e-4}


def random_runs(model, runs, seed=3):
    """Parameters (runs, p), initial states (runs, n) and inputs of a batch, all of them different."""
    rng = np.random.default_rng(seed)
    p = model.parameter_values() * rng.uniform(0.9, 1.1, (runs, len(model.tables.parameters)))
    x = rng.uniform(-0.3, 0.3, (runs, len(model.state_names)))
    pulse = qddot.signal.pulse_train(times=[0.0], peak=1.0, duration=0.03)
    wave = qddot.signal.sine(0.02, 1.0)
    names = [c.name for c in model.tables.inputs if not c.order]
    inputs = {
        name: qddot.per_run(
            wave if i % 2 else pulse, offset=-rng.uniform(0.01, 0.1, runs), rate=rng.uniform(1, 2, runs)
        )
        for i, name in enumerate(names)
    }
    return p, x, inputs


def alone(model, span, method, p, x, inputs, run, times):
    """The same run by `simulate`."""
    names = [parameter.name for parameter in model.tables.parameters]
    signals = {name: each.signal.shifted(each.rate[run], each.offset[run]) for name, each in inputs.items()}
    return qddot.simulate(
        model, span, method=method, parameters=dict(zip(names, map(float, p[run]), strict=True)), initial=x[run],
        inputs=signals, output_times=times, on_failure="return", **settings_of(method),
    )  # fmt: skip


@pytest.mark.parametrize("name", MODELS)
def test_a_lane_equals_the_run_alone_for_every_model_and_method(name):
    model, runs, span = qddot.load(name), 11, (0.0, 0.2)
    p, x, inputs = random_runs(model, runs)
    names = [*model.state_names, *(output.name for output in model.tables.outputs)]
    same = 0
    for method in IN_LANES:
        batch = qddot.simulate_batch(
            model, span, method=method, parameters=p, initial=x, inputs=inputs, output_times=5, names=names,
            **settings_of(method),
        )  # fmt: skip
        assert batch.in_lanes
        assert batch.success.all()
        for run in (0, 4, 10):
            solution = alone(model, span, method, p, x, inputs, run, batch.output_times[run])
            expected = np.array([solution[each] for each in names]).T
            scale = 1.0 + np.abs(expected).max(axis=0)
            alike = solution.statistics.steps == batch.steps[run]
            same += alike
            # Where rounding decides whether a step is good, the steps differ and so does the error, within tolerance.
            allowed = 1e-9 if alike else 100 * RTOL
            assert np.abs((batch.samples[run] - expected) / scale).max() < allowed, (method, run)
            assert np.abs(batch.final[run] - solution.states[-1]).max() < allowed * scale.max()
            if alike:
                assert batch.evaluations[run] == solution.statistics.evaluations
                assert batch.failed_attempts[run] == solution.statistics.failed_attempts
    assert same >= 24


@pytest.mark.parametrize("method", ["rk4", "tsit5"])
def test_lanes_are_refilled_whatever_the_lengths_of_runs(m113_model, method):
    runs = 37
    p, x, inputs = random_runs(m113_model, runs)
    ends = np.linspace(0.02, 0.3, runs)[np.random.default_rng(1).permutation(runs)]
    settings = {"method": method, "parameters": p, "initial": x, "inputs": inputs, **settings_of(method)}
    batch = qddot.simulate_batch(m113_model, (0.0, ends), output_times=3, **settings)
    assert batch.success.all()
    for run in (0, 7, 8, 20, 36):
        solution = alone(m113_model, (0.0, ends[run]), method, p, x, inputs, run, batch.output_times[run])
        np.testing.assert_allclose(batch.final[run], solution.states[-1], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(batch.samples[run], solution.states, rtol=1e-9, atol=1e-9)
        assert batch.steps[run] == solution.statistics.steps


@pytest.mark.parametrize("runs", [0, 1, 3])
def test_fewer_runs_than_lanes(m113_model, runs):
    p, x, inputs = random_runs(m113_model, 8)
    chosen = {name: qddot.per_run(each.signal, each.rate[:runs], each.offset[:runs]) for name, each in inputs.items()}
    given = {"step": 1e-3, "output_times": 2}
    whole = qddot.simulate_batch(m113_model, (0, 0.1), parameters=p, initial=x, inputs=inputs, **given)
    part = qddot.simulate_batch(m113_model, (0, 0.1), parameters=p[:runs], initial=x[:runs], inputs=chosen, **given)
    assert part.final.shape == (runs, 14)
    assert part.samples.shape == (runs, 2, 14)
    np.testing.assert_array_equal(part.final, whole.final[:runs])


@pytest.mark.parametrize("method", ["rk4", "tsit5", "dop853"])
def test_a_lane_that_is_no_number_leaves_its_neighbours_alone(method):
    model = qddot.load("double_pendulum")
    x = np.random.default_rng(5).uniform(-1, 1, (16, 4))
    settings = {"method": method, **(settings_of(method) | {"output_times": 3})}
    good = qddot.simulate_batch(model, (0, 0.2), initial=x, **settings)
    x[5, 2] = 1e200  # its square overflows in the first stage
    bad = qddot.simulate_batch(model, (0, 0.2), initial=x, **settings)
    others = np.arange(16) != 5
    assert Status(bad.status[5]) is Status.NON_FINITE
    assert bad.failed_at[5] <= 2e-4
    assert np.isfinite(bad.final[5]).all()
    assert np.isnan(bad.samples[5, 1:]).all()
    assert bad.success[others].all()
    np.testing.assert_allclose(bad.final[others], good.final[others], rtol=1e-12, atol=1e-12)


def test_a_run_that_diverges_says_when_and_by_which_state_as_it_does_alone():
    model, stiffness = qddot.load("quarter_car"), np.full(12, 2.0e5)
    stiffness[[2, 9]] = 4.0e8  # too stiff for the step
    settings = {"method": "rk4", "step": 2e-3, "initial": np.array([0.1, 0.0, 0.0, 0.0])}
    batch = qddot.simulate_batch(model, (0, 4.0), parameters={"k_t": stiffness}, divergence_limit=1e6, **settings)
    lone = qddot.simulate(
        model, (0, 4.0), parameters={"k_t": 4.0e8}, divergence_limit=1e6, on_failure="return", **settings
    )
    assert list(np.flatnonzero(~batch.success)) == [2, 9]
    for run in (2, 9):
        assert Status(batch.status[run]) is lone.status is Status.NON_FINITE
        assert batch.failed_at[run] == lone.failed_at
        assert batch.failed_state[run] == lone.failed_state
        assert batch.steps[run] == lone.statistics.steps
        np.testing.assert_allclose(batch.final[run], lone.states[-1], rtol=1e-9)


def test_every_lane_lands_on_its_own_breakpoints(m113_model):
    shots = np.linspace(0.0301, 0.15017, 13)
    pulse = qddot.signal.pulse_train(times=[0.0], duration=0.02, impulse=605.0)
    settings = {"parameters": "as_run_unloaded", "method": "dop853", "rtol": 1e-9, "atol": 1e-12}
    batch = qddot.simulate_batch(m113_model, (0, 0.3), inputs={"F": qddot.per_run(pulse, offset=-shots)}, **settings)
    for run, shot in enumerate(shots):
        one = qddot.signal.pulse_train(times=[shot], duration=0.02, impulse=605.0)
        solution = qddot.simulate(m113_model, (0, 0.3), inputs={"F": one}, **settings)
        np.testing.assert_allclose(batch.final[run], solution.states[-1], rtol=0, atol=1e-11)


def test_every_run_starts_from_its_own_equilibrium(m113_model):
    masses = np.linspace(8000, 14000, 9)
    batch = qddot.simulate_batch(
        m113_model, (0, 0.01), step=1e-3, parameters=("as_run_unloaded", {"m_6": masses}), output_times=[0.0]
    )
    for run, mass in enumerate(masses):
        rest = qddot.equilibrium(m113_model, ("as_run_unloaded", {"m_6": float(mass)}))
        np.testing.assert_allclose(batch.samples[run, 0], rest, rtol=0, atol=1e-12)
    with pytest.raises(qddot.EquilibriumError, match="run 0: model cart_pole: the static state is not isolated"):
        qddot.simulate_batch(qddot.load("cart_pole"), (0, 1), step=1e-3, runs=2)


def test_what_does_not_go_in_lanes_goes_alone_with_the_same_results():
    model = qddot.load("quarter_car")
    x = np.random.default_rng(2).uniform(-0.1, 0.1, (3, 4))
    batch = qddot.simulate_batch(
        model, (0, 0.5), method="ode15s", initial=x, output_times=4, names=["z_s", "zdot_u"], rtol=1e-6
    )
    assert not batch.in_lanes
    assert "ode15s" in batch.reason
    lanes = qddot.simulate_batch(
        model, (0, 0.5), method="dop853", initial=x, output_times=4, names=["z_s", "zdot_u"], rtol=1e-9
    )
    np.testing.assert_allclose(batch.samples, lanes.samples, rtol=0, atol=1e-4)
    np.testing.assert_allclose(batch.final, lanes.final, rtol=0, atol=1e-4)


def test_samples_outside_a_run_are_missing(m113_model):
    batch = qddot.simulate_batch(
        m113_model,
        (0, [0.05, 0.2]),
        step=1e-3,
        parameters="as_run_unloaded",
        output_times=[0.0, 0.1, 0.2],
        names=["pitch"],
    )
    assert np.isfinite(batch.samples[:, :, 0]).tolist() == [[True, False, False], [True, True, True]]


def test_inputs_may_be_one_mapping_for_each_run(m113_model):
    settings = {"parameters": "as_run_unloaded", "step": 1e-3}
    mappings = [{"F": 100.0}, {}, {"F": qddot.signal.sine(50.0, 3.0)}]
    batch = qddot.simulate_batch(m113_model, (0, 0.05), inputs=mappings, **settings)
    for run, inputs in enumerate(mappings):
        solution = qddot.simulate(m113_model, (0, 0.05), method="rk4", inputs=inputs, **settings)
        np.testing.assert_allclose(batch.final[run], solution.states[-1], rtol=0, atol=1e-12)


def test_limits_of_time_and_steps_end_a_batch(m113_model):
    heard = []
    batch = qddot.simulate_batch(
        m113_model, (0, 1e4), step=1e-4, parameters="as_run_unloaded", runs=20, time_limit=0.2, progress=heard.append
    )
    assert {Status(each) for each in batch.status} == {Status.TIME_LIMIT}
    assert batch.wall_time < 30
    assert heard
    few = qddot.simulate_batch(
        m113_model, (0, 1), method="tsit5", parameters="as_run_unloaded", initial=np.full((9, 14), 0.01), max_steps=5
    )
    assert {Status(each) for each in few.status} == {Status.TOO_MANY_STEPS}
    assert (few.steps == 5).all()


def test_what_is_given_wrongly_is_named(m113_model):
    def batch(span=(0, 1), **given):
        return qddot.simulate_batch(m113_model, span, **({"step": 1e-3} | given))

    with pytest.raises(ValueError, match=r"number of runs is not clear.*parameters: 3.*initial: 2"):
        batch(parameters={"m_6": [1e4, 1e4, 1e4]}, initial=np.zeros((2, 14)))
    with pytest.raises(ValueError, match="did you mean 'm_6'"):
        batch(parameters={"m6": [1e4, 2e4]})
    with pytest.raises(ValueError, match="span of run 1"):
        batch(span=([0, 1], [1, 0.5]), initial=np.zeros(14))
    with pytest.raises(ValueError, match="zdot_1 is the rate of z_1"):
        batch(inputs={"zdot_1": [1.0, 2.0]})
    with pytest.raises(ValueError, match="unknown state or output 'pich'; did you mean 'pitch'"):
        batch(names=["pich"])
    with pytest.raises(ValueError, match="give step="):
        qddot.simulate_batch(m113_model, (0, 1))
    with pytest.raises(ValueError, match="run 1: model m113: constant inverse_m_6 is inf; zero: m_6"):
        batch(parameters={"m_6": [1e4, 0.0]})


@pytest.mark.parametrize("method", ["rk4", "vern7"])
def test_sines_of_one_frequency_and_of_others_stand_side_by_side(m113_model, method):
    """Channels that turn together are written together: as many as follow each other, the last of them read or not."""
    runs, rng = 9, np.random.default_rng(5)
    p, x, _ = random_runs(m113_model, runs)
    speed, wave = rng.uniform(1, 2, runs), qddot.signal.sine(0.02, 3.0, mean=0.01)
    leaning = qddot.signal.table([0.0, 0.9], [0.0, 0.1])
    names = ["d_1", "tyre_force_2", "tyre_force_5"]
    for others in ([wave], [leaning], [wave, leaning]):
        signals = {f"z_{i}": [wave] * runs for i in range(1, 6)} | {
            "z_4": [others[r % len(others)] for r in range(runs)]
        }
        moved = {
            name: [
                one.shifted(v * (2 if name == "z_3" else 1), rng.uniform(0, 0.4))
                for one, v in zip(s, speed, strict=True)
            ]
            for name, s in signals.items()
        }
        batch = qddot.simulate_batch(
            m113_model, (0.0, 0.2), method=method, parameters=p, initial=x, inputs=moved, output_times=3, names=names,
            **settings_of(method),
        )  # fmt: skip
        assert batch.in_lanes
        for run in (0, 8):
            given = {
                name: qddot.per_run(s[run], rate=np.ones(runs), offset=np.zeros(runs)) for name, s in moved.items()
            }
            solution = alone(m113_model, (0.0, 0.2), method, p, x, given, run, batch.output_times[run])
            expected = np.array([solution[each] for each in names]).T
            np.testing.assert_allclose(batch.samples[run], expected, rtol=1e-9)


@njit
def _by_both(rhs, advancing, given, slopes, base, target, h, weight):
    call_lanes(rhs, *given, slopes[0])
    call_advance(advancing, *given, slopes[1], base, target, h, weight)


@pytest.mark.parametrize("name", MODELS)
def test_the_kernel_that_advances_finds_the_same_slopes_and_goes_along_them(name):
    model, weight = qddot.load(name), 0.375
    rng = np.random.default_rng(8)
    n, channels = len(model.state_names), max(1, len(model.tables.inputs))
    t, h = rng.uniform(0.1, 1.0, (2, 1, abi.LANES))
    x, base = rng.uniform(-0.3, 0.3, (2, n, abi.LANES))
    u = rng.uniform(-0.1, 0.1, (channels, abi.LANES))
    c = np.repeat(model.constants(model.parameter_values())[:, None], abi.LANES, axis=1)
    t, h, x, base, u, c, slopes, same, target = (
        on_rows(each) for each in (t, h, x, base, u, c, np.zeros_like(x), np.zeros_like(x), np.zeros_like(x))
    )
    kernels = tuple(pointer(lane_rhs(model, form), kind, form) for form, kind in abi.LANE_KERNELS.items())
    given = tuple(each.ctypes.data for each in (t, x, u, c))
    both = slopes.ctypes.data, same.ctypes.data
    _by_both(*kernels, given, both, base.ctypes.data, target.ctypes.data, h.ctypes.data, weight)
    np.testing.assert_allclose(same, slopes, rtol=1e-14)
    np.testing.assert_allclose(target, base + weight * h * slopes, rtol=1e-13, atol=1e-15)
    assert np.abs(slopes).max() > 0


def on_rows(values):
    """A copy on a cache line, as compiled lanes want their rows."""
    copied = on_cache_line(values.size).reshape(values.shape)
    copied[:] = values
    return copied


@needs_avx
@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("form", abi.LANE_KERNELS)
def test_the_lane_kernel_is_vectors_throughout(name, form):
    assembly = fresh(lane_rhs(qddot.load(name), form).py_func, abi.LANE_KERNELS[form])
    assert re.search(PACKED, assembly)
    assert not re.search(SCALAR, assembly)
    assert not re.search(r"\bcall", assembly)
    if FEATURES.get("avx512f"):
        assert "%zmm" in assembly


@needs_avx
@pytest.mark.parametrize("form", abi.LANE_KERNELS)
def test_the_lane_kernel_of_a_hundred_masses_is_vectors_throughout(form, tmp_path):
    """LLVM gives up on loops of many loads and stores where nobody tells it not to."""
    model = qddot.load(qddot.generate(chain.system(100), tmp_path))
    assembly = fresh(lane_rhs(model, form).py_func, abi.LANE_KERNELS[form])
    assert re.search(PACKED, assembly)
    assert not re.search(SCALAR, assembly)


@pytest.mark.parametrize("masses", [60, 70])
@pytest.mark.parametrize("method", [name for name in IN_LANES if METHODS[name].family == "fixed"])
def test_runs_of_large_models_equal_those_alone(method, masses, tmp_path):
    """The larger one does not advance its states by itself."""
    model = qddot.load(qddot.generate(chain.system(masses), tmp_path))
    assert (form_of(model, METHODS[method]) == "advance") is (masses == 60)
    starts = np.random.default_rng(5).uniform(-0.3, 0.3, (11, 2 * masses))
    batch = qddot.simulate_batch(model, (0, 0.2), method=method, step=1e-3, initial=starts)
    assert batch.in_lanes
    for run in (0, 7, 10):
        solution = qddot.simulate(model, (0, 0.2), method=method, step=1e-3, initial=starts[run])
        np.testing.assert_allclose(batch.final[run], solution.states[-1], rtol=1e-10, atol=1e-12)


@needs_avx
def test_the_sums_of_a_step_are_vectors_throughout():
    def sums(n, row, h, now, slopes, new, atol, sizes):
        combine("dop853", row, n, h, now, slopes, new)
        estimate_errors("dop853", n, h, now, new, slopes, atol, 1e-6, 1e100, sizes)
        conclude("rk4", 3, n, h, new, slopes, new, sizes)

    assembly = fresh(sums, types.void(*[types.int64] * 8))
    assert len(re.findall(PACKED, assembly)) > 100
    assert not re.search(SCALAR, assembly)


def test_a_model_that_calls_a_function_without_vectors_runs_alone_with_the_same_results(m113_model, monkeypatch):
    settings = {
        "step": 1e-3,
        "parameters": ("as_run_unloaded", {"m_6": [9e3, 1e4]}),
        "output_times": 3,
        "names": ["pitch"],
    }
    lanes = qddot.simulate_batch(m113_model, (0, 0.05), inputs={"F": 50.0}, **settings)
    monkeypatch.setattr("qddot.runner.lanes.way.lane_rhs", lambda model, form: None)
    lone = qddot.simulate_batch(m113_model, (0, 0.05), inputs={"F": 50.0}, **settings)
    assert lanes.in_lanes
    assert not lone.in_lanes
    assert "no lane kernel" in lone.reason
    np.testing.assert_allclose(lone.samples, lanes.samples, rtol=1e-10)
    np.testing.assert_allclose(lone.final, lanes.final, rtol=1e-10, atol=1e-12)
    assert (lone.steps == lanes.steps).all()


@pytest.mark.parametrize(("expression", "lanes"), [("math.erf(state[0])", False), ("math.tanh(state[0])", True)])
def test_only_functions_that_have_vectors_run_in_lanes(expression, lanes, tmp_path):
    text = Path(qddot.load("quarter_car").module.__file__).read_text()
    text = text.replace("delta_s = z_s - z_u", f"delta_s = z_s - z_u + 0.0 * {expression}").replace(
        "from numba import njit", "import math\n\nfrom numba import njit"
    )
    (tmp_path / "quarter_car.py").write_text(text)
    assert (lane_rhs(qddot.load(tmp_path / "quarter_car.py")) is not None) == lanes


def test_a_kernel_changed_in_place_is_compiled_anew_for_lanes(tmp_path):
    """Numba's cache knows the file of the loop, not that of the kernel in it."""
    text, found = Path(qddot.load("one_axle").module.__file__).read_text(), []
    for factor in ("2.0", "3.0"):
        path = tmp_path / f"changed_{factor[0]}.py"
        path.write_text(re.sub(r"derivative\[1\] = ", f"derivative[1] = {factor} + 0.0 * ", text))
        batch = qddot.simulate_batch(qddot.load(path), (0, 1), step=0.1, initial=np.zeros((2, 2)))
        found.append(batch.final[0, 1])
    np.testing.assert_allclose(found, [2.0, 3.0], rtol=1e-12)


OTHER_PROCESS = """
import sys, numpy as np, qddot
batch = qddot.simulate_batch(qddot.load(sys.argv[1]), (0, 1), step=0.1, initial=np.zeros((2, 2)))
print(batch.success.all())
"""


def test_the_same_kernel_in_another_folder_finds_its_own_code_in_a_process_that_knows_no_other(tmp_path):
    text = Path(qddot.load("one_axle").module.__file__).read_text()
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "axle.py"
        path.write_text(text.replace("derivative[1] = ", "derivative[1] = 0.25 + "))
        done = command(path, code=OTHER_PROCESS)
        assert done.stdout.strip() == "True", done.stderr
