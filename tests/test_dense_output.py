"""What lies between saved points: `at`, extremes, curves, samples; against solutions that are known."""

import pickle

import linear_runs as linear
import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import qddot
from qddot.runner.dense import output
from qddot.runner.metrics.reading import curve_at
from qddot.runner.pictures.arrange import run_picture
from qddot.runner.problem import Status
from qddot.runner.solution import ENOUGH

CAR = qddot.load("quarter_car")
BUMP = qddot.signal.pulse_train(times=[0.5], duration=0.2, peak=0.1)
#: Each method and options with which it meets what is asked here.
METHODS = {
    "euler": {"step": 1e-5},
    "heun": {"step": 1e-4},
    "midpoint": {"step": 1e-4},
    "rk4": {"step": 1e-3},
    **{
        name: {"rtol": 1e-7, "atol": 1e-9}
        for name in ("ode23", "ode45", "tsit5", "dop853", "vern7", "ode15s", "rodas5p", "taylor")
    },
    "exact": {},
    "auto": {},
}
#: Those that take a function.
FUNCTIONS = [name for name in METHODS if name not in ("exact", "taylor", "auto")]


def test_the_table_has_every_method():
    assert set(METHODS) == set(qddot.methods())


def over_the_bump(method="dop853", **options):
    return qddot.simulate(CAR, (0, 3), method=method, inputs={"z_r": BUMP}, **options)


@pytest.fixture(scope="module")
def truth():
    """Body acceleration and states by SciPy, in pieces between the edges of the bump: (a, x), functions of time."""
    p = CAR.parameter_values(None)
    c, rhs = CAR.constants(p), CAR.kernel("rhs")

    def slope(t, x):
        dx = np.empty(4)
        rhs(t, x, np.array([float(BUMP(t)), 0.0]), c, dx)
        return dx

    x, pieces = over_the_bump("exact").states[0], []
    for start, end in ((0.0, 0.5), (0.5, 0.7), (0.7, 3.0)):
        solved = solve_ivp(
            lambda t, x, start=start, end=end: slope(min(max(t, start + 1e-13), end - 1e-13), x),
            (start, end),
            x,
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            dense_output=True,
            max_step=0.01,
        )
        x = solved.y[:, -1]
        pieces.append((start, end, solved.sol))

    def states(t):
        return next(sol(t) for start, end, sol in reversed(pieces) if t >= start)

    return (lambda t: slope(t, states(t))[2]), states


GRID = np.linspace(0, 3, 3001)


@pytest.fixture(scope="module")
def on_grid(truth):
    """The true body acceleration at GRID."""
    return np.array([truth[0](t) for t in GRID])


@pytest.fixture(scope="module")
def greatest(truth, on_grid):
    """The greatest true body acceleration, and when it is there."""
    best = GRID[np.argmax(on_grid)]
    found = minimize_scalar(
        lambda t: -truth[0](t), bounds=(best - 2e-3, best + 2e-3), options={"xatol": 1e-10}, method="bounded"
    )
    return -found.fun, found.x


@pytest.mark.parametrize("method", METHODS)
def test_the_greatest_acceleration_is_found_between_points(greatest, method):
    value, at = greatest
    found = over_the_bump(method, **METHODS[method]).extremes("body_acceleration")
    near = {"exact": 1e-9, "auto": 1e-9, "euler": 5e-3, "ode15s": 3e-4}.get(method, 3e-5)
    assert found.greatest == pytest.approx(value, rel=near)
    assert found.greatest_at == pytest.approx(at, abs=1e-3 if near > 1e-9 else 1e-6)


def test_default_options_see_what_saved_points_miss(greatest):
    """dop853 as it comes: a step is long, what it knows within is not."""
    value, _ = greatest
    run = over_the_bump()
    assert run["body_acceleration"].max() < 0.99 * value
    assert run.extremes("body_acceleration").greatest == pytest.approx(value, rel=5e-3)
    assert qddot.reading(run, "body_acceleration", "greatest") == run.extremes("body_acceleration").greatest


@pytest.mark.parametrize("method", METHODS)
def test_states_at_any_time_are_those_of_the_solution(truth, method):
    run, times = over_the_bump(method, **METHODS[method]), np.random.default_rng(3).uniform(0, 3, (4, 5))
    found = run.at(times)
    assert found["z_s"].shape == times.shape
    expected = np.array([truth[1](t)[0] for t in times.flat]).reshape(times.shape)
    near = {"exact": 1e-11, "auto": 1e-11, "euler": 1e-5, "ode15s": 1e-5}.get(method, 2e-7)
    np.testing.assert_allclose(found["z_s"], expected, atol=near)
    np.testing.assert_array_equal(found["z_r"], BUMP(times))
    assert float(run.at(1.25)["z_s"]) == run.at([0.3, 1.25])["z_s"][1]
    assert run.at([])["z_s"].shape == (0,)


@pytest.mark.parametrize("method", METHODS)
def test_saved_points_are_on_the_curve(method):
    run = over_the_bump(method, **METHODS[method])
    np.testing.assert_allclose(run.at(run.t).values, run.values, rtol=1e-10, atol=1e-10)


@njit
def lorenz(t, x, u, c, dx):
    dx[0] = 10.0 * (x[1] - x[0]) + u[0]
    dx[1] = x[0] * (28.0 - x[2]) - x[1]
    dx[2] = x[0] * x[1] - 8.0 / 3.0 * x[2]


@pytest.mark.parametrize("method", FUNCTIONS)
def test_the_run_is_made_again_to_the_last_digit(method):
    """A chaotic one, which rounding would make another: 40 s, with an input that has kinks and jumps."""
    kinks = qddot.signal.table(np.arange(0.0, 41.0, 1.3), np.random.default_rng(1).uniform(-1, 1, 32))
    jumps = qddot.signal.pulse_train(times=[3.1, 17.7], duration=0.5, peak=2.0, shape="exponential")
    options = {"step": 2e-3, "every": 7} if method in linear.FIXED else {"rtol": 1e-5, "atol": 1e-8}
    for signal in (kinks, jumps, 0.0):
        run = qddot.solve(lorenz, (0, 40), [1.0, 1.0, 25.0], method=method, inputs=[signal], **options)
        steps = run.t[:: 4 if method == "ode45" else 1]  # ode45 saves three points within each step
        np.testing.assert_array_equal(run.at(steps).values[:, :3], run.states[:: 4 if method == "ode45" else 1])


@pytest.mark.parametrize("method", FUNCTIONS)
@pytest.mark.parametrize("back", [False, True])
def test_a_cosine_at_any_time_and_its_extremes(method, back):
    """1.5 periods of cos(3 t) from t = -1, either way."""
    span = (2.0, -1.0) if back else (-1.0, 2.0)
    run = cosine_run(method, span)
    times = np.linspace(-1, 2, 301)
    near = {"ode45": 1e-4, "ode23": 1e-4, "euler": 5e-4, "ode15s": 1e-4}.get(method, 1e-5)
    np.testing.assert_allclose(run.at(times)["x_1"], np.cos(3 * times), atol=near)
    found = run.extremes("x_1", after=-0.5, before=1.5)
    assert (found.greatest, found.least) == pytest.approx((1, -1), abs=near)
    assert (found.greatest_at, found.least_at) == pytest.approx((0, np.pi / 3), abs=np.sqrt(near))
    found = run.extremes("x_1", after=0.2, before=0.5)
    assert (found.greatest, found.greatest_at) == pytest.approx((np.cos(0.6), 0.2), abs=near)
    assert (found.least, found.least_at) == pytest.approx((np.cos(1.5), 0.5), abs=near)
    found = run.extremes("x_1", after=0.2, before=0.2 + 1e-4)  # a window within one step
    assert (found.greatest, found.greatest_at) == pytest.approx((np.cos(0.6), 0.2), abs=near)
    assert (found.least, found.least_at) == pytest.approx((np.cos(0.6003), 0.2001), abs=near)


def cosine_run(method, span, **options):
    """x = cos 3t, by every method that takes a function."""
    given = METHODS[method]
    x0 = [np.cos(3 * span[0]), -3 * np.sin(3 * span[0])]
    return qddot.solve(cosine, span, x0, method=method, **given, **options)


@njit
def cosine(t, x, u, c, dx):
    dx[0] = x[1]
    dx[1] = -9.0 * x[0]


def test_both_sides_of_a_jump_count():
    """A saw tooth rises to 1 and falls to 0 there: 1 is its greatest value, though no saved point has it."""
    rows = np.zeros((2, 8))
    rows[1, 0], rows[0, 2] = 0.73, 1 / 0.73
    tooth = qddot.Signal(rows, np.array([0.73]))
    for method in ("dop853", "rk4", "ode15s"):
        options = {"step": 0.01} if method == "rk4" else {}
        run = qddot.simulate(CAR, (0, 1), method=method, inputs={"z_r": tooth}, **options)
        found = run.extremes("z_r")
        assert found.greatest == pytest.approx(1.0, abs=1e-6)
        assert found.greatest_at == pytest.approx(0.73, abs=1e-9)
        assert run.at(0.73)["z_r"] == 0.0  # the limit from the right, as at saved points


def test_what_a_terminal_event_cut_off_is_not_shown():
    fall = [qddot.Event(height, terminal=True)]
    for method in ("dop853", "rk4"):
        options = {"step": 0.05} if method == "rk4" else {}
        run = qddot.solve(falling, (0, 10), [10.0, 0.0], method=method, events=fall, **options)
        assert run.extremes("x_1").least == pytest.approx(0, abs=1e-12)
        assert run.extremes("x_2").least == pytest.approx(-np.sqrt(200), rel=1e-12)
        assert run.at(1.0)["x_1"] == pytest.approx(5.0, abs=1e-12)
        with pytest.raises(ValueError, match=r"t is 1.5 s, but the run goes from 0 to 1.414"):
            run.at([1.0, 1.5])


@njit
def falling(t, x, u, c, dx):
    dx[0] = x[1]
    dx[1] = -10.0


@njit
def height(t, x, u, c):
    return x[0]


@pytest.mark.parametrize("wrong", ["now", [np.nan], None, [[1.0], [2.0, 3.0]]])
def test_what_is_no_time_of_the_run_is_refused(wrong):
    with pytest.raises(ValueError, match=r"^t is "):
        over_the_bump().at(wrong)


def test_names_are_checked():
    run = over_the_bump()
    with pytest.raises(KeyError, match="did you mean 'z_s'"):
        run.at(1.0)["zs"]
    with pytest.raises(KeyError, match="unknown quantity"):
        run.extremes("zs")
    with pytest.raises(ValueError, match="holds nothing of the run"):
        run.extremes("z_s", after=5.0)


def test_long_runs_are_gone_through_in_parts(monkeypatch):
    """Where the pieces are too many to be kept, the run is made again each time: with the same results."""
    run, again = over_the_bump("rk4", step=1e-4), over_the_bump("rk4", step=1e-4)
    monkeypatch.setattr(output, "MOST_KEPT", 1000)
    times = np.linspace(0, 3, 77)
    few = again.at(times).values
    assert not again._dense._kept
    monkeypatch.undo()
    np.testing.assert_array_equal(run.at(times).values, few)
    assert len(run._dense._kept) == 1
    for name in run:
        assert run.extremes(name).greatest == pytest.approx(again.extremes(name).greatest, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("method", ["rk4", "tsit5", "ode15s", "exact"])
def test_unpickled_solutions_know_what_lies_between(method):
    run = over_the_bump(method, **METHODS[method])
    again = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(again.at([0.1, 0.61, 2.9]).values, run.at([0.1, 0.61, 2.9]).values)


def test_runs_that_end_early_have_what_they_reached():
    run = over_the_bump("tsit5", max_steps=20, on_failure="return")
    assert run.status is Status.TOO_MANY_STEPS
    full = over_the_bump("tsit5")
    np.testing.assert_allclose(run.at(0.9 * run.t[-1]).values, full.at(0.9 * run.t[-1]).values, rtol=1e-12)
    at_once = qddot.simulate(CAR, (1, 1), method="dop853")
    assert at_once.at(1.0)["z_s"] == at_once["z_s"][0] == at_once.extremes("z_s").greatest


def test_a_figure_is_smooth(truth):
    run = over_the_bump()
    shown = run_picture(run.closely, run.headlines, "over a bump", ["body_acceleration"]).panels[0].curves[0]
    assert len(run.t) < 100 < ENOUGH <= len(shown.x)
    expected = np.array([truth[0](t) for t in shown.x])
    np.testing.assert_allclose(shown.values, expected, atol=0.02 * np.abs(expected).max())
    fine = over_the_bump("rk4", step=1e-3)
    assert fine.closely.t.tolist() == fine.t.tolist()  # it has points enough


def test_readings_and_metrics_are_of_the_curve(truth, on_grid, greatest):
    run = over_the_bump(rtol=1e-8, atol=1e-10)
    found = qddot.metric(run, "rms", "body_acceleration", interval=1e-3)
    assert found == pytest.approx(np.sqrt(np.trapezoid(on_grid**2, GRID) / 3), rel=1e-3)
    assert qddot.metric(run, "max", "body_acceleration", interval=1e-3) == pytest.approx(greatest[0], rel=1e-4)
    assert curve_at(run, "z_s", np.array([0.612]))[0] == pytest.approx(truth[1](0.612)[0], abs=1e-6)


@pytest.mark.parametrize("method", ["rk4", "dop853", "vern7", "exact"])
def test_samples_of_batches_are_those_of_single_runs(method):
    """In lanes, exactly and alone, at times that no step meets."""
    times = np.linspace(0, 3, 1000)
    options = {"step": 1e-3} if method == "rk4" else {} if method == "exact" else {"rtol": 1e-5, "atol": 1e-8}
    batch = qddot.simulate_batch(
        CAR,
        (0, 3),
        method=method,
        inputs={"z_r": [BUMP] * 9},
        output_times=times,
        names=["z_s", "body_acceleration"],
        **options,
    )
    run = qddot.simulate(CAR, (0, 3), method=method, inputs={"z_r": BUMP}, **options).at(times)
    near = 1e-9 if method != "rk4" else 1e-5
    for name in ("z_s", "body_acceleration"):
        scale = np.abs(run[name]).max()
        np.testing.assert_allclose(batch[name][0], run[name], atol=near * scale)
        np.testing.assert_allclose(batch[name][8], run[name], atol=near * scale)
