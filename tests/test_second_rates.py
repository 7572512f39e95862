"""Inputs whose second rate a model reads: every family of methods, lanes, runs backward; what has none is refused."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import qddot
from qddot.runner.inputs.signal import Signal
from qddot.runner.load import load

L, G, D, END = 2.0, 9.81, 0.3, 2.0
#: Rests at 0, goes 3 tau^2 - 2 tau^3 m within a second and rests again: its second rate jumps at both ends.
RAMP = Signal(
    np.array([[-1.0, 0, 0, 0, 0, 0, 0, 0], [0.0, 0, 0, 3, -2, 0, 0, 0], [1.0, 1, 0, 0, 0, 0, 0, 0]]),
    np.array([0.0, 1.0]),
)


def ramp_acceleration(t):
    return 6.0 - 12.0 * t if 0 <= t < 1 else 0.0


def sine_acceleration(t):
    omega = 2 * np.pi * 0.6
    return -0.4 * omega**2 * np.sin(omega * t + 0.2)


COURSES = {
    "ramp": (RAMP, ramp_acceleration, (0.0, 1.0, END)),
    "faster ramp": (RAMP.shifted(2.0, 0.0), lambda t: 4 * ramp_acceleration(2 * t), (0.0, 0.5, END)),
    "sine": (qddot.signal.sine(0.4, 0.6, 0.2), sine_acceleration, (0.0, END)),
}


@pytest.fixture(scope="module")
def model():
    return load(Path(__file__).parent / "sample_models" / "trolley.py")


def reference(acceleration, stops):
    """The state at END by SciPy, from stop to stop; the limit from within each."""
    x = np.zeros(2)
    for start, end in pairwise(stops):

        def slope(t, x, start=start, end=end):
            a = acceleration(min(max(t, start), end - 1e-12))
            return [x[1], -(a + G * x[0] + D * x[1]) / L]

        x = solve_ivp(slope, (start, end), x, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return x


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize(
    ("method", "options", "tolerance"),
    [
        ("rk4", {"step": 1e-3}, 1e-10),
        ("dop853", {"rtol": 1e-10, "atol": 1e-12}, 1e-9),
        ("rodas5p", {"rtol": 1e-9, "atol": 1e-11}, 1e-7),
        ("exact", {}, 1e-11),
    ],
)
def test_a_load_swings_as_its_trolley_is_accelerated(model, course, method, options, tolerance):
    signal, acceleration, stops = COURSES[course]
    run = qddot.simulate(model, (0, END), method=method, inputs={"s": signal}, initial=[0.0, 0.0], **options)
    np.testing.assert_allclose(run.states[-1], reference(acceleration, stops), rtol=0, atol=tolerance)
    t = END - 1e-9
    slope = (signal(t + 1e-6) - signal(t - 1e-6)) / 2e-6
    assert run["speed"][-1] == pytest.approx(float(slope) + L * run.states[-1, 1], abs=1e-6)


def test_lanes_and_runs_backward_read_second_rates_too(model):
    signals = [signal for signal, _, _ in COURSES.values()] * 3
    batch = qddot.simulate_batch(
        model, (0, END), method="rk4", step=1e-3, inputs={"s": signals}, initial=[0.0, 0.0], output_times=[END]
    )
    for run, (_, acceleration, stops) in enumerate(list(COURSES.values()) * 3):
        found = [batch["phi"][run, -1], batch["phidot"][run, -1]]
        np.testing.assert_allclose(found, reference(acceleration, stops), rtol=0, atol=1e-10)
    end = reference(ramp_acceleration, (0.0, 1.0, END))
    back = qddot.simulate(model, (END, 0), method="dop853", rtol=1e-10, atol=1e-12, inputs={"s": RAMP}, initial=end)
    np.testing.assert_allclose(back.states[-1], 0.0, atol=1e-9)


def test_a_batch_over_a_long_table_reads_second_rates(model):
    """Even tables have a quick way in lanes that knows values and rates alone."""
    pieces, t = [[-1.0, 0, 0, 0, 0, 0, 0, 0]], np.arange(40) * 0.05
    for start in t:  # s = t^3 / 6 in pieces of the same length
        pieces.append([start, start**3 / 6, start**2 / 2, start / 2, 1 / 6, 0, 0, 0])
    signal = Signal(np.array(pieces, dtype=float), np.array([0.0]))
    batch = qddot.simulate_batch(
        model, (0, 1.9), runs=8, method="rk4", step=1e-3, inputs={"s": signal}, initial=[0.0, 0.0], output_times=[1.9]
    )
    expected = solve_ivp(lambda t, x: [x[1], -(t + G * x[0] + D * x[1]) / L], (0, 1.9), [0, 0], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(batch["phi"][:, -1], expected.y[0, -1], rtol=0, atol=1e-10)


def test_derivatives_of_signals():
    t = np.array([-0.5, 0.25, 0.5, 0.75, 1.5])
    np.testing.assert_allclose(RAMP.derivative(t, 2), [ramp_acceleration(each) for each in t], atol=1e-14)
    np.testing.assert_allclose(RAMP.derivative(t), [0, 1.125, 1.5, 1.125, 0], atol=1e-14)
    sine = qddot.signal.sine(0.4, 0.6, 0.2)
    np.testing.assert_allclose(sine.derivative(t, 2), sine_acceleration(t), atol=1e-12)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        (
            qddot.signal.table([0, 1, 2], [0, 1, 1], kind="linear"),
            r"input s has a kink, where its rate jumps, at t = 0, ",
        ),
        (qddot.road.step(0.1), "input s jumps at t = 0"),
    ],
)
def test_a_course_without_a_second_rate_is_refused(model, signal, message):
    with pytest.raises(ValueError, match=message + r".*reads its second rate sddot"):
        qddot.simulate(model, (0, 1), inputs={"s": signal}, initial=[0, 0], step=1e-2)
    with pytest.raises(ValueError, match=message):
        qddot.simulate_batch(model, (0, 1), runs=2, inputs={"s": signal}, initial=[0, 0], step=1e-2)
    with pytest.raises(ValueError, match="sddot is the second rate of s; give s"):
        qddot.simulate(model, (0, 1), inputs={"sddot": 1.0}, initial=[0, 0], step=1e-2)
