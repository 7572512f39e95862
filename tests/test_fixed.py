import tracemalloc

import numpy as np
import pytest
from commands import command
from numba import njit
from runs import exploding

from qddot.runner.inputs.shapes import pulse_train, sine
from qddot.runner.inputs.tables import table
from qddot.runner.load import load
from qddot.runner.methods import METHODS
from qddot.runner.problem import Status
from qddot.runner.simulate import IntegrationError, simulate
from qddot.runner.solve import solve

PAGES = [method.tableau for method in METHODS.values() if method.family == "fixed"]
OMEGA = 5.0  # of the undamped oscillator, sqrt(50 / 2) rad/s


@njit
def swinging(t, x, u, c, dx):
    """x' = x cos t, so x = x0 exp(sin t)."""
    dx[0] = x[0] * np.cos(t)


@njit
def rooted(t, x, u, c, dx):
    """The second state's slope is no number once the first is negative."""
    dx[0] = -1.0
    dx[1] = np.sqrt(x[0])
    dx[2] = x[1]


@njit
def following(t, x, u, c, dx):
    """x' = u: the state is the integral of the input."""
    dx[0] = u[0]


@pytest.fixture(scope="module")
def oscillator():
    return load("tests/sample_models/oscillator.py")


def observed_order(error, steps):
    errors = [error(step) for step in steps]
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def undamped(oscillator, force, step, method="rk4", t1=1.5):
    initial = {"q_1": 0.01}
    run = simulate(
        oscillator, (0, t1), method=method, step=step, parameters="undamped", inputs={"F": force}, initial=initial
    )
    return run.states[-1]


def half_sine_response(t, t0, peak, duration):
    """Undamped oscillator at rest, half-sine force from t0 on (Harris, Shock and Vibration Handbook, chapter 8)."""
    ratio = np.pi / duration / OMEGA

    def forced(s):
        scale = peak / 50.0 / (1 - ratio**2)
        return scale * np.array(
            [
                np.sin(ratio * OMEGA * s) - ratio * np.sin(OMEGA * s),
                ratio * OMEGA * (np.cos(ratio * OMEGA * s) - np.cos(OMEGA * s)),
            ]
        )

    if t <= t0 + duration:
        return forced(t - t0)
    return free(forced(duration), t - t0 - duration)


def free(x, s):
    cos, sin = np.cos(OMEGA * s), np.sin(OMEGA * s)
    return np.array([x[0] * cos + x[1] / OMEGA * sin, -x[0] * OMEGA * sin + x[1] * cos])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_observed_order_is_that_of_the_tableau(page):
    def error(step):
        run = solve(swinging, (0, 2), [1.0], method=page.name, step=step)
        return abs(run.states[-1, 0] - np.exp(np.sin(2.0)))

    assert observed_order(error, 2 / np.array([40, 80, 160, 320])) == pytest.approx(page.order, rel=0.1)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_order_survives_a_jump_off_the_grid(oscillator, page):
    start, duration, t1 = np.sqrt(0.1), np.sqrt(0.2), 1.5
    force = pulse_train("trapezoid", times=[start], peak=3.0, duration=duration, rise=0)
    deflection = 3.0 / 50.0
    x = free(np.array([0.01, 0.0]), start) - [deflection, 0]
    x = free(x, duration) + np.array([deflection, 0])
    exact = free(x, t1 - start - duration)

    def error(step):
        return np.linalg.norm((undamped(oscillator, force, step, page.name) - exact) * [OMEGA, 1])

    assert observed_order(error, t1 / np.array([150, 300, 600, 1200])) == pytest.approx(page.order, rel=0.1)


def test_half_sine_pulse_shorter_than_a_step_is_felt(oscillator):
    start, duration, peak = 0.3337, 0.004, 500.0
    force = pulse_train("half_sine", times=[start], peak=peak, duration=duration)
    felt = undamped(oscillator, force, 0.01) - free(np.array([0.01, 0.0]), 1.5)
    # One step over the pulse would give Simpson's impulse: 2/3 of peak times duration in place of 2/pi.
    np.testing.assert_allclose(felt, half_sine_response(1.5, start, peak, duration), rtol=2e-4)


@pytest.mark.parametrize("t1", [0.5, 1.5])
def test_half_sine_response_is_the_analytic_one(oscillator, t1):
    force = pulse_train("half_sine", times=[0.1234567], peak=20.0, duration=0.7)
    exact = half_sine_response(t1, 0.1234567, 20.0, 0.7) + free(np.array([0.01, 0.0]), t1)
    np.testing.assert_allclose(undamped(oscillator, force, 1e-3, t1=t1), exact, rtol=1e-9, atol=1e-11)


def test_quadrature_of_a_broken_line_is_exact():
    """Midpoint steps that land on every kink integrate straight lines without error."""
    t = np.cumsum(np.random.default_rng(3).uniform(0.01, 0.2, 40))
    values = np.random.default_rng(4).normal(size=40)
    run = solve(following, (0, 5), [0.0], method="midpoint", step=0.1, inputs=[table(t, values)])
    beyond = values[0] * t[0] + values[-1] * (5 - t[-1])
    assert run.states[-1, 0] == pytest.approx(np.trapezoid(values, t) + beyond, abs=1e-13)


def test_breakpoints_on_grid_points_cost_no_step():
    kinks = table(0.1 * np.arange(11), np.arange(11) % 2)
    assert solve(following, (0, 1), [0.0], step=0.1, inputs=[kinks]).statistics.steps == 10


def test_grid_is_not_accumulated():
    run = solve(swinging, (0, 1000), [1.0], method="euler", step=0.1, every=1)
    np.testing.assert_array_equal(run.t, [*(0.1 * np.arange(10_000)), 1000.0])


def test_last_step_lands_on_the_end():
    run = solve(swinging, (0.05, 1), [1.0], step=0.3, every=1)
    np.testing.assert_allclose(run.t, [0.05, 0.35, 0.65, 0.95, 1.0])
    assert run.t[-1] == 1.0


def test_step_longer_than_the_span_is_one_step():
    assert solve(swinging, (0, 0.1), [1.0], step=5.0).statistics.steps == 1


def test_every_kth_grid_point_and_the_ends_are_saved():
    run = solve(swinging, (0, 1), [1.0], step=0.1, every=4)
    np.testing.assert_allclose(run.t, [0, 0.4, 0.8, 1.0])


def test_default_saves_about_five_thousand_points():
    assert len(solve(swinging, (0, 1), [1.0], step=1e-5).t) == 5001
    assert len(solve(swinging, (0, 1), [1.0], step=1e-2).t) == 101


def test_requested_times_are_saved_exactly():
    times = np.sort(np.random.default_rng(1).uniform(0, 2, 50))
    run = solve(swinging, (0, 2), [1.0], step=0.01, output_times=times)
    np.testing.assert_array_equal(run.t, [0, *times, 2])
    np.testing.assert_allclose(run["x_1"], np.exp(np.sin(run.t)), rtol=1e-8)


def test_requested_times_next_to_grid_and_breakpoints_are_one_step():
    kink = table([0.0, 0.5 + 1e-15, 1.0], [0.0, 1.0, 0.0])
    times = [0.0, 0.3, np.nextafter(0.5, 0), 0.7 - 1e-16, 1.0]
    run = solve(following, (0, 1), [0.0], step=0.1, output_times=times, inputs=[kink])
    np.testing.assert_array_equal(run.t, times)
    assert run.statistics.steps == 10
    assert run.states[-1, 0] == pytest.approx(0.5, abs=1e-14)


def test_output_time_outside_the_span_is_refused():
    with pytest.raises(ValueError, match=r"output time 2\.5 is outside the span from 0\.0 to 2\.0"):
        solve(swinging, (0, 2), [1.0], step=0.1, output_times=[1, 2.5])


def test_memory_does_not_grow_with_the_steps():
    def peak(steps):
        tracemalloc.start()
        solve(swinging, (0, 1), [1.0], step=1 / steps)
        used = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return used

    peak(10_000)
    assert peak(1_000_000) < 1.1 * peak(10_000)


def test_inputs_between_stages_are_those_of_their_times():
    run = solve(following, (0, 1), [0.0], step=0.01, inputs=[sine(1.0, 1.0)])
    assert run.states[-1, 0] == pytest.approx(0.0, abs=1e-8)
    half = solve(following, (0, 0.5), [0.0], step=0.01, inputs=[sine(1.0, 1.0)])
    assert half.states[-1, 0] == pytest.approx(1 / np.pi, rel=1e-8)


def test_divergence_names_time_state_and_last_value():
    with pytest.raises(IntegrationError) as caught:
        solve(exploding, (0, 4), [1.0, 1.0], method="euler", step=0.125, state_names=["calm", "wild"])
    run = caught.value.solution
    assert run.status is Status.NON_FINITE
    assert not run.success
    assert run.failed_state == "wild"
    assert run.failed_at == run.t[-1] + 0.125
    assert np.isfinite(run.states).all()
    assert str(caught.value) == (
        f"exploding diverged at t = {run.failed_at:.9g} s (method euler with step 0.125 s): wild left first, "
        f"from {run['wild'][-1]:.6g} at t = {run.t[-1]:.9g} s; "
        "try a smaller step, a stiff method, or check the parameters"
    )


def test_state_whose_slope_is_no_number_is_the_one_named():
    run = solve(rooted, (0, 2), [1.0, 0.0, 0.0], step=0.3, on_failure="return")
    assert run.failed_state == "x_2"
    assert run.failed_at == pytest.approx(1.2)
    np.testing.assert_allclose(run.t, [0, 0.3, 0.6, 0.9])


def test_unstable_step_of_eulers_method_diverges_on_a_stable_model(oscillator):
    with pytest.raises(IntegrationError, match=r"oscillator diverged at t = .* left first, from .* m"):
        simulate(oscillator, (0, 1000), method="euler", step=0.5, initial={"q_1": 1.0})


def test_divergence_limit_is_the_users():
    run = solve(exploding, (0, 2), [1.0, 1.0], step=1e-3, divergence_limit=10.0, on_failure="return")
    assert run.failed_at == pytest.approx(0.9, abs=1.5e-3)


def test_time_limit_keeps_the_part_computed():
    run = solve(swinging, (0, 1), [1.0], step=1e-7, time_limit=1e-9, on_failure="return")
    assert run.status is Status.TIME_LIMIT
    assert 0 < run.t[-1] < 1
    assert run["x_1"][-1] == pytest.approx(np.exp(np.sin(run.t[-1])), rel=1e-9)


def test_interrupt_keeps_the_part_computed(monkeypatch):
    def stop(fraction):
        raise KeyboardInterrupt

    monkeypatch.setattr("qddot.runner.frame.slices.REPORT_INTERVAL", 0.0)
    run = solve(swinging, (0, 1), [1.0], step=1e-6, progress=stop, on_failure="return")
    assert run.status is Status.INTERRUPTED
    assert 0 < run.t[-1] < 1


def test_slices_do_not_change_the_result(monkeypatch, oscillator):
    force = pulse_train(times=[0.2, 0.7], peak=3.0, duration=0.1)
    whole = simulate(oscillator, (0, 1), step=1e-3, inputs={"F": force})
    monkeypatch.setattr("qddot.runner.explicit.fixed.SLICE_WORK", 1)
    seen = []
    monkeypatch.setattr("qddot.runner.frame.slices.REPORT_INTERVAL", 0.0)
    sliced = simulate(oscillator, (0, 1), step=1e-3, inputs={"F": force}, progress=seen.append)
    np.testing.assert_array_equal(sliced.values, whole.values)
    assert len(seen) > 50
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "method 'rk4' marches with a constant step: give step=, such as step=1e-3"),
        ({"step": 1e-17}, "too small to advance a time as large as 1.0"),
        ({"stepp": 1}, "unknown option 'stepp'; did you mean 'step'"),
        ({"step": 0.1, "on_failure": "ignore"}, "on_failure is 'ignore', expected 'raise' or 'return'"),
        ({"step": 0.1, "span": (1, np.inf)}, r"span is \(1, inf\), but method \w+ goes to a finite end"),
        ({"step": 0.1, "span": (0, np.nan)}, "span: its end is nan, expected a finite number"),
        ({"step": 0.1, "x0": [np.inf]}, "expected a row of finite numbers"),
        ({"step": 0.1, "state_names": ["a", "b"]}, "2 names for 1 states"),
        ({"step": 0.1, "inputs": ["F"]}, r"inputs\[0\] is 'F', expected a number"),
    ],
)
def test_wrong_argument_is_named(given, message):
    arguments = {"span": (0, 1), "x0": [1.0]} | given
    with pytest.raises(ValueError, match=message):
        solve(swinging, arguments.pop("span"), arguments.pop("x0"), **arguments)


SECOND_PROCESS = """
from qddot.runner.explicit import fixed
from qddot.runner.load import load
from qddot.runner.simulate import simulate

model = load("tests/sample_models/oscillator.py")
for method in ("rk4", "euler"):
    simulate(model, (0, 1), method=method, step=0.1)
stats = fixed._compiled_loop().function.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


def test_second_process_takes_the_loop_from_the_cache():
    first, second = (command(code=SECOND_PROCESS) for _ in range(2))
    assert sum(map(int, first.stdout.split())) == 1
    assert second.stdout.split() == ["1", "0"]
