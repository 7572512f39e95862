from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from qddot.runner.inputs.bind import bind
from qddot.runner.inputs.reader import evaluate, reader_for, sample
from qddot.runner.inputs.shapes import constant, pulse_train, sine
from qddot.runner.inputs.tables import table
from qddot.runner.load import load

CONTINUOUS = ["half_sine", "triangle", "trapezoid"]
SHAPES = [*CONTINUOUS, "exponential"]
numbers = st.floats(-1e3, 1e3)
durations = st.floats(1e-3, 10.0)


@st.composite
def samples(draw):
    steps = draw(st.lists(st.floats(1e-3, 10.0), min_size=2, max_size=20))
    t = draw(numbers) + np.cumsum(steps)
    return t, np.array(draw(st.lists(numbers, min_size=len(t), max_size=len(t))))


def pulse(shape, s, rise):
    """One pulse of peak and duration 1, from its definition."""
    if shape == "half_sine":
        return np.where((s >= 0) & (s <= 1), np.sin(np.pi * s), 0.0)
    if shape == "exponential":
        return np.where((s >= 0) & (s < 1), (0.01 ** np.clip(s, 0, 1) - 0.01) / 0.99, 0.0)
    rise = 0.5 if shape == "triangle" else rise
    return np.clip(np.minimum(s, 1 - s) / rise, 0.0, 1.0)


@pytest.fixture(scope="module")
def oscillator():
    return load("tests/sample_models/oscillator.py")


def test_constant_and_sine_have_the_values_of_their_formulas():
    t = np.linspace(-3, 5, 101)
    wave = sine(2.0, 0.5, phase=0.3, mean=1.0)
    np.testing.assert_allclose(wave(t), 1 + 2 * np.sin(np.pi * t + 0.3), atol=1e-14)
    np.testing.assert_allclose(wave.derivative(t), 2 * np.pi * np.cos(np.pi * t + 0.3), atol=1e-13)
    assert (constant(3.5)(t) == 3.5).all()
    assert constant(3.5)(0.0).shape == ()


@given(samples(), st.lists(st.floats(-1.5e3, 1.5e3), min_size=1, max_size=20))
@settings(max_examples=60, deadline=None)
def test_linear_table_is_numpy_interp(given_samples, times):
    t, values = given_samples
    np.testing.assert_allclose(table(t, values)(times), np.interp(times, t, values), rtol=1e-9, atol=1e-6)


@given(samples())
@settings(max_examples=60, deadline=None)
def test_linear_table_bends_only_at_its_breakpoints(given_samples):
    t, values = given_samples
    signal = table(t, values)
    slopes = np.concatenate([[0.0], np.diff(values) / np.diff(t), [0.0]])
    bends = np.abs(np.diff(slopes)) > 1e-9 * np.maximum(np.abs(slopes[1:]), np.abs(slopes[:-1]))
    np.testing.assert_array_equal(signal.breakpoint_times(), t[bends])


def test_cubic_table_is_the_spline_inside_and_constant_outside():
    t, values = np.array([0.0, 0.3, 1.0, 1.2, 2.0]), np.array([1.0, -2.0, 0.5, 3.0, 2.0])
    signal, spline = table(t, values, "cubic"), CubicSpline(t, values)
    inside = np.linspace(0, 2, 201)[:-1]
    np.testing.assert_allclose(signal(inside), spline(inside), atol=1e-13)
    np.testing.assert_allclose(signal.derivative(inside), spline(inside, 1), atol=1e-12)
    assert signal(-1.0) == 1.0
    assert signal(3.0) == 2.0
    assert signal.breakpoints.tolist() == [0.0, 2.0]


@pytest.mark.parametrize(
    ("t", "values", "message"),
    [
        ([0, 1, 1, 2], [0, 0, 0, 0], "sample 2: time 1.0 repeats that of sample 1"),
        ([0, 2, 1], [0, 0, 0], "sample 2: time 1.0 is before that of sample 1, 2.0; times must rise"),
        ([0, 1, 2], [0, np.nan, 0], "sample 1: value is nan, expected a finite number"),
        ([0, np.inf], [0, 0], "sample 1: time is inf"),
        ([0], [0], "two samples or more"),
        ([0, 1], [0], "as many values as times; found 2 and 1"),
        ([[0, 1]], [0, 1], r"t has shape \(1, 2\)"),
    ],
)
def test_bad_samples_are_named(t, values, message):
    with pytest.raises(ValueError, match=message):
        table(t, values)


def test_unknown_kind_of_table_names_the_nearest():
    with pytest.raises(ValueError, match="unknown kind of table 'linar'; did you mean 'linear'"):
        table([0, 1], [0, 1], "linar")


@given(
    st.sampled_from(SHAPES),
    st.lists(st.floats(-10, 10), min_size=1, max_size=6),
    numbers,
    durations,
    st.floats(0.01, 0.5),
    st.lists(st.floats(-12, 22), min_size=1, max_size=20),
)
@settings(max_examples=150, deadline=None)
def test_pulse_train_is_the_sum_of_its_pulses(shape, times, peak, duration, rise, at):
    signal = pulse_train(shape, times=times, peak=peak, duration=duration, rise=rise)
    at = np.array(at)
    jumps = np.array(times) if shape == "exponential" else np.empty(0)
    at = at[(np.abs(at[:, None] - jumps) > 1e-8 * duration).all(axis=1)]
    expected = sum(peak * pulse(shape, (at - start) / duration, rise) for start in times)
    np.testing.assert_allclose(signal(at), expected, rtol=1e-6, atol=1e-6 * (1 + abs(peak)) / rise)


@given(st.sampled_from(SHAPES), numbers.filter(lambda x: abs(x) > 1e-3), durations, st.floats(0, 0.5))
@example("trapezoid", 1.0, 1.0, 5e-324)  # a ramp too short to have a slope
@settings(max_examples=60, deadline=None)
def test_integral_of_a_pulse_is_its_impulse(shape, impulse, duration, rise):
    signal = pulse_train(shape, times=[2.0], impulse=impulse, duration=duration, rise=rise)
    edges = signal.breakpoints
    knots = edges if shape != "exponential" else signal.pieces[1:, 0]
    integral = sum(quad(signal, a, np.nextafter(b, a), epsabs=0)[0] for a, b in pairwise(knots))
    assert integral == pytest.approx(impulse, rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_any_two_of_peak_duration_and_impulse_agree(shape):
    reference = pulse_train(shape, times=[1.0], peak=3.0, duration=0.2)
    areas = {"half_sine": 2 / np.pi, "triangle": 0.5, "trapezoid": 0.75, "exponential": 1 / np.log(100) - 0.01 / 0.99}
    impulse = areas[shape] * 3.0 * 0.2
    for given_two in ({"impulse": impulse, "duration": 0.2}, {"impulse": impulse, "peak": 3.0}):
        np.testing.assert_allclose(
            pulse_train(shape, times=[1.0], **given_two).pieces, reference.pieces, rtol=1e-6, atol=1e-12
        )


def test_pulses_end_to_end_share_their_edge():
    starts = 0.1 * np.arange(50)
    signal = pulse_train("triangle", times=starts, peak=1.0, duration=0.1)
    assert len(signal.breakpoints) == 101
    assert signal(2.45) == pytest.approx(1.0)


def test_breakpoints_of_a_pulse_are_its_edges():
    signal = pulse_train("trapezoid", times=[1.0], peak=2.0, duration=0.4, rise=0.25)
    np.testing.assert_allclose(signal.breakpoints, [1.0, 1.1, 1.3, 1.4], rtol=1e-15)
    assert pulse_train("trapezoid", times=[1.0], peak=2.0, duration=0.4, rise=0).breakpoints.tolist() == [1.0, 1.4]


@pytest.mark.parametrize(
    ("given_arguments", "message"),
    [
        ({"peak": 1.0}, "needs two of peak, duration and impulse; given: peak"),
        ({"peak": 1.0, "duration": 1.0, "impulse": 1.0}, "given: peak and duration and impulse"),
        ({"peak": 1.0, "duration": 0.0}, "duration is 0.0, expected a time greater than 0"),
        ({"peak": 1.0, "impulse": -1.0}, "must have the same sign"),
        ({"peak": np.nan, "duration": 1.0}, "peak is nan, expected a finite number"),
        ({"peak": 1.0, "duration": 1.0, "times": []}, "expected one or more finite times"),
        ({"peak": 1.0, "duration": 1.0, "rise": 0.6}, "rise is 0.6"),
        ({"peak": 1.0, "duration": 1.0, "shape": "halfsine"}, "did you mean 'half_sine'"),
    ],
)
def test_wrong_pulse_is_refused(given_arguments, message):
    with pytest.raises(ValueError, match=message):
        pulse_train(**({"times": [0.0]} | given_arguments))


def test_shifted_signal_reads_the_road_under_an_axle():
    road = table([0, 1, 2], [0, 1, 0])
    axle = road.shifted(rate=10.0, offset=-0.5)
    assert axle(0.15) == pytest.approx(1.0)
    assert axle.derivative(0.1) == pytest.approx(10.0)
    np.testing.assert_allclose(axle.breakpoint_times(), [0.05, 0.15, 0.25])


def test_value_at_a_jump_is_the_limit_from_within_the_step():
    signal = pulse_train("trapezoid", times=[1.0], peak=2.0, duration=0.5, rise=0)
    channels = bind(load("tests/sample_models/oscillator.py").tables, {"F": signal})
    reader, u = reader_for(channels), np.zeros(3)
    evaluate(channels, reader, 1.0, 0.999, 3, u)
    assert u[0] == 0.0
    evaluate(channels, reader, 1.0, 1.001, 3, u)
    assert u[0] == 2.0


def test_bind_orders_channels_and_derives_rates(oscillator):
    channels = bind(oscillator.tables, {"z_1": sine(0.1, 2.0), "F": 5})
    values = np.empty((50, 3))
    t = np.linspace(0, 1, 50)
    sample(channels, t, values)
    np.testing.assert_array_equal(values[:, 0], 5.0)
    np.testing.assert_allclose(values[:, 1], 0.1 * np.sin(4 * np.pi * t), atol=1e-15)
    np.testing.assert_allclose(values[:, 2], 0.4 * np.pi * np.cos(4 * np.pi * t), atol=1e-14)


def test_inputs_not_given_are_zero(oscillator):
    values = np.ones((3, 3))
    sample(bind(oscillator.tables, None), np.array([0.0, 1.0, 2.0]), values)
    assert not values.any()


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"f": 1.0}, "model oscillator: unknown input 'f'; did you mean 'F'"),
        ({"zdot_1": 1.0}, "zdot_1 is the rate of z_1; give z_1"),
        ({"F": np.inf}, "input F is inf, expected a finite number"),
        ({"F": "big"}, "input F is 'big', expected a number"),
        (
            {"z_1": pulse_train("trapezoid", times=[0.5], peak=1.0, duration=0.1, rise=0)},
            "input z_1 jumps at t = 0.5, but the model reads its rate zdot_1",
        ),
    ],
)
def test_wrong_input_is_named(oscillator, inputs, message):
    with pytest.raises(ValueError, match=message):
        bind(oscillator.tables, inputs)


def test_continuous_pulses_are_no_jump(oscillator):
    for shape in CONTINUOUS:
        bind(oscillator.tables, {"z_1": pulse_train(shape, times=[0.1, 0.15, 7.0], peak=1e-3, duration=0.1)})
