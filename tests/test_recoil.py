"""Guns: what a shot gives, when shots fall, and measured curves as pulses."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qddot.runner.inputs.recoil import measured_pulse_train, recoil_impulse, shot_times
from qddot.runner.inputs.shapes import pulse_train
from qddot.runner.inputs.signal import START

starts = st.lists(st.floats(-10, 10), min_size=1, max_size=6)


def integral(signal):
    """The integral of all pieces, by Gauss's rule."""
    edges = signal.pieces[1:, START]
    places, weights = np.polynomial.legendre.leggauss(12)
    return sum((b - a) / 2 * weights @ signal((a + b) / 2 + (b - a) / 2 * places) for a, b in pairwise(edges))


@st.composite
def curves(draw):
    steps = draw(st.lists(st.floats(0.01, 0.5), min_size=1, max_size=8))
    t = draw(st.floats(-5, 5)) + np.concatenate([[0.0], np.cumsum(steps)])
    values = draw(st.lists(st.floats(0.1, 1e3), min_size=len(t), max_size=len(t)))
    return t, np.array(values)


def test_the_shell_of_the_paper_has_its_momentum():
    assert recoil_impulse(0.725, 1385.0) == pytest.approx(1004.125)
    assert recoil_impulse(0.725, 1385.0, charge_mass=0.3) == pytest.approx(1385 * (0.725 + 1.75 * 0.3))
    assert recoil_impulse(0.725, 1385.0, 0.3, 1.5) == pytest.approx(1385 * (0.725 + 1.5 * 0.3))


@given(st.integers(1, 50), st.floats(0.01, 10), st.floats(-10, 10))
def test_a_schedule_has_its_shots_at_its_intervals(count, interval, start):
    times = shot_times(count, interval, start=start)
    assert len(times) == count
    assert times[0] == start
    np.testing.assert_allclose(np.diff(times), interval, rtol=1e-9)
    np.testing.assert_allclose(shot_times(count, rate_of_fire=60 / interval, start=start), times, rtol=1e-12)


@given(starts, st.sampled_from(["half_sine", "triangle", "trapezoid", "exponential"]), st.floats(0.01, 3.0))
@settings(deadline=None)
def test_every_edge_of_every_shot_is_a_breakpoint_and_every_shot_counts(times, shape, duration):
    signal = pulse_train(shape, times=times, impulse=7.0, duration=duration)
    edges = np.add.outer(times, [0.0, duration]).ravel()
    assert np.abs(signal.breakpoints[:, None] - edges).min(axis=0).max() <= 1e-8 * duration
    assert integral(signal) == pytest.approx(7.0 * len(times), rel=1e-6)


@given(curves(), starts, st.sampled_from(["linear", "cubic"]))
@settings(deadline=None, max_examples=50)
def test_a_measured_curve_is_repeated_at_every_shot(curve, times, kind):
    t, values = curve
    signal = measured_pulse_train(t, values, times=times, kind=kind)
    alone = measured_pulse_train(t, values, times=[0.0], kind=kind)
    length = t[-1] - t[0]
    edges = np.add.outer(np.array(times), [0.0, length]).ravel()
    at = np.linspace(-11, 15, 503)
    at = at[np.abs(at[:, None] - edges).min(axis=1) > 1e-6]
    np.testing.assert_allclose(signal(at), sum(alone(at - start) for start in times), rtol=1e-6, atol=1e-4)
    inside = np.linspace(0, length, 50)[1:-1]
    if kind == "linear":
        np.testing.assert_allclose(alone(inside), np.interp(t[0] + inside, t, values), rtol=1e-9)
        assert integral(alone) == pytest.approx(np.trapezoid(values, t), rel=1e-9)


@given(curves(), st.floats(1, 100), st.floats(0.01, 2))
@settings(deadline=None, max_examples=50)
def test_a_measured_curve_is_stretched_to_what_is_asked(curve, peak, duration):
    t, values = curve
    area, length, highest = np.trapezoid(values, t), t[-1] - t[0], values.max()

    def scaled(**sizes):
        return measured_pulse_train(t, values, times=[2.0], **sizes)

    def found(signal):
        edges = signal.breakpoint_times()
        return signal(np.nextafter(edges[:-1], 99)).max(), edges[-1] - edges[0], integral(signal)

    at_end = int(values[-1] == highest)  # the curve's last sample is a limit from the left
    for signal, expected in (
        (scaled(peak=peak), (peak, length, area * peak / highest)),
        (scaled(duration=duration), (highest, duration, area * duration / length)),
        (scaled(impulse=50.0), (highest * 50 / area, length, 50.0)),
        (scaled(peak=peak, duration=duration), (peak, duration, area * peak / highest * duration / length)),
        (scaled(duration=duration, impulse=50.0), (highest * 50 / area * length / duration, duration, 50.0)),
        (scaled(peak=peak, impulse=50.0), (peak, length * 50 / (area * peak / highest), 50.0)),
    ):
        assert found(signal)[at_end:] == pytest.approx(expected[at_end:], rel=1e-6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: shot_times(0, 1.0), "count is 0, expected a whole number, at least 1"),
        (lambda: shot_times(2.5, 1.0), "count is 2.5, expected a whole number"),
        (lambda: shot_times(10**9, 1.0), "count is 1000000000, expected at most 100000 shots"),
        (lambda: shot_times(2), "2 shots need an interval or a rate_of_fire"),
        (lambda: shot_times(2, -1.0), "interval is -1.0, expected a number greater than 0"),
        (lambda: shot_times(2, rate_of_fire=0.0), "rate_of_fire is 0.0, expected a number greater than 0"),
        (lambda: shot_times(2, 1.0, rate_of_fire=1.0), "give interval or rate_of_fire, not both"),
        (lambda: recoil_impulse(0.0, 900.0), "shell_mass is 0.0, expected a number greater than 0"),
        (lambda: recoil_impulse(0.1, np.nan), "muzzle_velocity is nan, expected a finite number"),
        (lambda: recoil_impulse(0.1, 900.0, -1.0), "charge_mass is -1.0, expected 0 or more"),
        (lambda: measured_pulse_train([0, 1], [0, 0], times=[0], peak=1.0), "the measured curve is 0 in peak"),
        (lambda: measured_pulse_train([0, 1], [1, -1], times=[0], impulse=1.0), "the measured curve is 0 in peak or"),
        (lambda: measured_pulse_train([0, 1], [1, 1], times=[0], duration=0.0), "duration is 0.0, expected a time"),
        (lambda: measured_pulse_train([0, 1], [1, 1], times=[0], peak=1, duration=1, impulse=1), "given: all three"),
        (lambda: measured_pulse_train([0, 1], [1, 1], times=[0], peak=-1.0, impulse=1.0), "do not go with the signs"),
        (lambda: measured_pulse_train([0, 0], [1, 1], times=[0]), "sample 1: time 0.0 repeats that of sample 0"),
        (lambda: measured_pulse_train([0, 1], [1, 1], times=[]), "expected one or more finite times"),
    ],
)
def test_wrong_shots_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
