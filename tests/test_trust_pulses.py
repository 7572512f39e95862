"""Inputs far from t = 0 or shorter than a step: values, impulses and breakpoints as defined, by every method."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numba import njit

import qddot
from qddot.runner.inputs.bind import bind, check_smooth
from qddot.runner.inputs.instants import RESOLVED, ROUNDING, apart, between, side_of
from qddot.runner.inputs.signal import START, jumps, values_at
from qddot.runner.load import load
from qddot.runner.tables import Channel

DAY, EPOCH = 86_400.0, 1.7e9
SHAPES = ("half_sine", "triangle", "trapezoid", "exponential")
AREA = {"half_sine": 2 / np.pi, "triangle": 0.5, "trapezoid": 0.75, "exponential": 1 / np.log(100) - 0.01 / 0.99}
#: A decay is made of cubics.
APART = dict.fromkeys(SHAPES, 2e-9) | {"exponential": 1e-6}
EDGES = {"half_sine": (0, 1), "triangle": (0, 0.5, 1), "trapezoid": (0, 0.25, 0.75, 1), "exponential": (0, 1)}
ADAPTIVE = ("ode23", "ode45", "tsit5", "vern7", "dop853", "ode15s", "rodas5p")
IN_LANES = ("rk4", "ode45", "dop853")


@pytest.fixture(scope="module")
def model():
    return load("tests/sample_models/oscillator.py")


def definition(shape, s):
    """A pulse of peak and duration 1 at s, from its definition."""
    inside = (s >= 0) & (s < 1)
    s = np.clip(s, 0, 1)
    if shape == "half_sine":
        return np.where(inside, np.sin(np.pi * s), 0.0)
    if shape == "exponential":
        return np.where(inside, (0.01**s - 0.01) / 0.99, 0.0)
    return np.where(inside, np.minimum(1.0, np.minimum(s, 1 - s) * (2 if shape == "triangle" else 4)), 0.0)


def integral(signal):
    """The integral of all pieces, each over its own length, by Gauss's rule."""
    places, weights = np.polynomial.legendre.leggauss(12)
    lengths = np.diff(signal.pieces[1:, START])
    parts = [values_at(signal.pieces[1:-1], lengths * (1 + place) / 2)[0] for place in places]
    return float(np.sum(lengths / 2 * (weights @ np.array(parts))))


def after_impulse(since, impulse, m=1.0, k=100.0):
    """Displacement of a mass on a spring, at rest before an impulse."""
    omega = np.sqrt(k / m)
    return impulse / (m * omega) * np.sin(omega * since)


UNDAMPED = {"m_1": 1.0, "k_1": 100.0, "b_1": 0.0, "g": 0.0}


# What a pulse is


@pytest.mark.parametrize(
    ("shape", "start", "duration"),
    [
        ("trapezoid", 1067629.2934, 1e-2),
        ("triangle", 106000.0123, 1e-3),
        ("half_sine", 1000.0, 1e-5),
        ("trapezoid", 1000.0, 1e-3),
        ("exponential", EPOCH, 1e-2),
        ("half_sine", -EPOCH - 0.3, 1e-3),
    ],
)
def test_a_pulse_far_from_zero_has_its_peak_its_impulse_and_its_edges(shape, start, duration):
    signal = qddot.signal.pulse_train(shape, times=[start], peak=1.0, duration=duration)
    t = np.unique(np.linspace(start, start + duration, 100_001))
    spacing = np.spacing(abs(start))
    assert signal(t).max() <= 1.0 + 1e-12
    assert signal(t).max() == pytest.approx(1.0, abs=10 * spacing / duration)
    assert integral(signal) == pytest.approx(AREA[shape] * duration, rel=APART[shape] + 4 * (spacing / duration) ** 2)
    assert len(signal.breakpoints) == len(EDGES[shape])
    assert np.abs(signal.breakpoints - (start + duration * np.array(EDGES[shape]))).max() <= spacing
    assert len(jumps(signal.pieces)) == (shape == "exponential")


@given(
    st.sampled_from(SHAPES),
    st.floats(-1e9, 1e9),
    st.lists(st.floats(0.0, 3.0), min_size=1, max_size=5),
    st.floats(-7, 3).map(lambda power: 10.0**power),
)
@example("trapezoid", 1067629.2934, [0.0], 1e-2)
@example("triangle", 106000.0123, [0.0], 1e-3)
@example("half_sine", 0.9, [0.0, 3.0], 1e-7)
@example("trapezoid", 1e9, [0.0, 0.5, 0.5000001], 1e3)
@settings(max_examples=150, deadline=None, print_blob=True, derandomize=True)
def test_trains_anywhere_are_the_sum_of_their_pulses(shape, origin, behind, duration):
    """Greatest value, impulse, breakpoints and rates, starts from -1e9 to 1e9 s, alone and overlapping."""
    starts = np.unique(origin + duration * np.array(behind))
    farthest = max(abs(starts[0]), abs(starts[-1] + duration))
    spacing, parts = np.spacing(farthest), np.diff(EDGES[shape]).min()
    if parts * duration < RESOLVED * spacing:
        if parts * duration < RESOLVED * np.spacing(np.abs(starts)).min() * 0.99:
            with pytest.raises(ValueError, match="floating-point numbers there are"):
                qddot.signal.pulse_train(shape, times=starts, peak=1.0, duration=duration)
        return
    signal = qddot.signal.pulse_train(shape, times=starts, peak=1.0, duration=duration)
    pieces = signal.pieces
    assert (np.diff(pieces[:, START]) > 0).all()
    assert integral(signal) == pytest.approx(len(starts) * AREA[shape] * duration, rel=1e-6)
    edges = np.unique(np.add.outer(starts, duration * np.array(EDGES[shape])))
    expected = edges[apart(edges)]
    assert len(signal.breakpoints) <= len(expected)
    assert np.abs(signal.breakpoints[:, None] - edges).min(axis=0).max() <= 2 * ROUNDING * farthest
    t = np.linspace(starts[0], starts[-1] + duration, 997)
    t = t[(np.abs(t[:, None] - edges) > spacing).all(axis=1)]
    values = sum(definition(shape, (t - start) / duration) for start in starts)
    np.testing.assert_allclose(signal(t), values, rtol=1e-6, atol=2e-6)
    assert signal(t).max(initial=0.0) <= values.max(initial=0.0) + 2e-6
    if shape != "exponential":
        assert not jumps(pieces).size
        s = [(t - start) / duration for start in starts]
        if shape == "half_sine":
            rates = sum(np.where((e > 0) & (e < 1), np.pi * np.cos(np.pi * e), 0.0) for e in s) / duration
            np.testing.assert_allclose(signal.derivative(t) * duration, rates * duration, atol=1e-5)


def test_a_pulse_that_time_does_not_resolve_is_refused_with_what_to_do():
    message = (
        r"shortest part of the pulse at 1700000000.0 s is 1e-07 s long, but .* 2.38e-07 s apart.* count from nearer"
    )
    with pytest.raises(ValueError, match=message):
        qddot.signal.pulse_train(times=[0.0, EPOCH], impulse=1.0, duration=1e-7)
    with pytest.raises(ValueError, match=r"the bump at 1000000000000\.0 m is 0\.01 m long"):
        qddot.road.cosine_bump(0.1, 0.01, at=1e12)


def test_a_measured_curve_far_from_zero_is_the_curve():
    t, values = np.array([0.0, 1e-3, 4e-3, 1e-2]), np.array([0.0, 2.0, 1.0, 0.0])
    signal = qddot.signal.measured_pulse_train(t, values, times=[DAY, DAY + 0.3])
    at = DAY + 0.3 + np.linspace(0, 1e-2, 10_001)
    np.testing.assert_allclose(signal(at), np.interp(at - (DAY + 0.3), t, values), atol=1e-6)
    assert len(signal.breakpoints) == 8
    assert integral(signal) == pytest.approx(2 * np.trapezoid(values, t), rel=1e-10)


def test_pulses_end_to_end_far_from_zero_share_their_edges():
    signal = qddot.signal.pulse_train("triangle", times=EPOCH + 0.1 * np.arange(50), peak=1.0, duration=0.1)
    assert len(signal.breakpoints) in (101, *range(102, 152))  # 0.1 s is no whole number of spacings there
    near = qddot.signal.pulse_train("triangle", times=DAY + 0.125 * np.arange(50), peak=1.0, duration=0.125)
    assert len(near.breakpoints) == 101


def test_no_breakpoint_is_lost():
    signal = qddot.signal.pulse_train("half_sine", times=[0.9, 1.3], impulse=1.0, duration=1e-7)
    np.testing.assert_allclose(signal.breakpoints, [0.9, 0.9 + 1e-7, 1.3, 1.3 + 1e-7], rtol=1e-15)


@pytest.mark.parametrize(
    ("shape", "start", "duration"), [("half_sine", 1e3, 1e-5), ("trapezoid", 1e3, 1e-3), ("triangle", EPOCH, 0.1)]
)
def test_a_continuous_pulse_far_from_zero_has_a_rate(model, shape, start, duration):
    signal = qddot.signal.pulse_train(shape, times=[start], peak=1.0, duration=duration)
    bind(model.tables, {"z_1": signal})
    check_smooth(Channel("zdot_1", "z_1", 1, "m/s", ""), signal.shifted(20.0, -3e5))


def test_a_jump_far_from_zero_has_none(model):
    rectangle = qddot.signal.pulse_train("trapezoid", times=[EPOCH], peak=1.0, duration=0.1, rise=0)
    with pytest.raises(ValueError, match=r"input z_1 jumps at t = 1\.7e"):
        bind(model.tables, {"z_1": rectangle})


# Which times are one


def test_times_are_one_by_their_own_spacing_alone():
    assert between(np.array([1.0, 1.0 + 1e-9, 1e9 - 1.0]), 0.0, 1e9).tolist() == [1.0, 1.0 + 1e-9, 1e9 - 1.0]
    assert between(np.array([np.nextafter(1.0, 2), 2.0, np.nextafter(2.0, 3)]), 1.0, 3.0).tolist() == [2.0]
    chain = 1.0 + 12 * 2.0**-52 * np.arange(9)  # each is one with the last, the third is not one with the first
    assert apart(chain).sum() == 5


@given(st.floats(-1e9, 1e9), st.floats(0, 20).map(lambda power: 2.0**power), st.floats(0, 1))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_the_side_of_a_stage_is_inside_its_step(t, spacings, c):
    h = (t + 2 * np.ceil(spacings) * max(np.spacing(abs(t)), 1e-300)) - t
    assert t <= side_of.py_func(t, h, c) < t + h


# What methods make of it


@pytest.mark.parametrize("method", [*ADAPTIVE, "exact"])
def test_the_second_pulse_of_a_train_acts(model, method):
    """The issue's case: m = 1, k = 100, from 1.1 to 1.45 s; 0.09974950 is sin(1.5)/10."""
    pulses = qddot.signal.pulse_train("half_sine", times=[0.9, 1.3], impulse=1.0, duration=1e-7)
    options = {} if method == "exact" else {"rtol": 1e-8, "atol": 1e-10}
    s = qddot.simulate(
        model, (1.1, 1.45), method=method, parameters=UNDAMPED, initial=[0, 0], inputs={"F": pulses}, **options
    )
    assert s["q_1"][-1] == pytest.approx(after_impulse(0.15, 1.0), rel=2e-5)


FAR = [
    ("half_sine", DAY + 0.1, 1e-6, (DAY, DAY + 0.25)),
    ("rectangle", DAY + 0.1, 1e-6, (DAY, DAY + 0.25)),
    ("rectangle", EPOCH + 0.1, 1e-3, (EPOCH, EPOCH + 0.25)),
    ("half_sine", EPOCH + 0.1, 1e-3, (EPOCH, EPOCH + 0.25)),
    ("triangle", -EPOCH + 0.1, 2e-3, (-EPOCH, -EPOCH + 0.25)),
]


def pulse_of(shape, start, duration):
    sizes = {"times": [start], "impulse": 1.0, "duration": duration}
    return (
        qddot.signal.pulse_train("trapezoid", rise=0, **sizes)
        if shape == "rectangle"
        else qddot.signal.pulse_train(shape, **sizes)
    )


def tolerances(start, duration):
    """Where the spacing of time counts beside the pulse, tighter ones cannot be met, and a run says so."""
    coarse = np.spacing(abs(start)) > 1e-6 * duration
    return {"rtol": 1e-3, "atol": 1e-4} if coarse else {"rtol": 1e-6, "atol": 1e-10}


@pytest.mark.parametrize(("shape", "start", "duration", "span"), FAR)
@pytest.mark.parametrize("method", [*ADAPTIVE, "exact", "rk4", "heun", "euler"])
def test_a_short_pulse_acts_with_its_impulse(model, method, shape, start, duration, span):
    """Also one no longer than the constant step, and one of few thousand spacings of time."""
    pulse = pulse_of(shape, start, duration)
    steps = {"exact": None, "rk4": 1e-3, "heun": 1e-3, "euler": 1e-4}
    options = {"step": steps[method]} if method in steps else tolerances(start, duration)
    s = qddot.simulate(model, span, method=method, parameters=UNDAMPED, initial=[0, 0], inputs={"F": pulse}, **options)
    expected = after_impulse(span[1] - start - duration / 2, integral(pulse))
    near = {"exact": 1e-5, "rk4": 1e-5, "heun": 1e-2, "euler": 1e-2}.get(method, 5 * options.get("rtol", 0.0))
    assert s["q_1"][-1] == pytest.approx(expected, rel=near + 4 * np.spacing(abs(start)) / duration)


def test_a_long_span_hides_no_pulse_at_its_beginning(model):
    """To 1e9 s: times there are 1e-7 s apart, at 1 s they are not."""
    pulse = pulse_of("rectangle", 1.0, 1e-7)
    times = [1.15, 1e9]
    damped = {"m_1": 1.0, "k_1": 100.0, "b_1": 4.0, "g": 0.0}
    omega = np.sqrt(100.0 - 4.0)
    expected = np.exp(-2 * 0.15) / omega * np.sin(omega * 0.15)
    s = qddot.simulate(
        model, (0.0, 1e9), method="exact", parameters=damped, initial=[0, 0], inputs={"F": pulse}, output_times=times
    )
    assert s["q_1"][s.t == 1.15] == pytest.approx(expected, rel=1e-5)
    s = qddot.simulate(
        model,
        (0.0, 1e9),
        method="rodas5p",
        parameters=damped,
        initial=[0, 0],
        inputs={"F": pulse},
        output_times=times,
        max_step=1e9,
        rtol=1e-6,
    )
    assert s["q_1"][s.t == 1.15] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("method", [*IN_LANES, "exact"])
def test_lanes_and_batches_read_pulses_far_from_zero(model, method):
    """One pulse for all runs, shifted for each, by offsets up to an epoch; and one signal for each run."""
    cases = FAR
    options = {"rk4": {"step": 1e-3}, "exact": {}}.get(method, tolerances(EPOCH, 1e-3))
    begin, end = np.array([case[3] for case in cases]).T
    each = [pulse_of(*case[:3]) for case in cases]
    own = qddot.simulate_batch(
        model, (begin, end), method=method, parameters=UNDAMPED, initial=[0, 0], inputs={"F": each}, **options
    )
    expected = [
        after_impulse(case[3][1] - case[1] - case[2] / 2, integral(f)) for case, f in zip(cases, each, strict=True)
    ]
    np.testing.assert_allclose(own.final[:, 0], expected, rtol=5e-3)
    starts = np.array([0.1, DAY + 0.1, 30 * DAY + 0.1, EPOCH + 0.1, -EPOCH + 0.1])
    for shape in ("half_sine", "rectangle", "exponential"):
        pulse = pulse_of(shape, 0.0, 1e-3)
        moved = qddot.per_run(pulse, offset=-starts)
        batch = qddot.simulate_batch(
            model,
            (starts - 0.1, starts + 0.1),
            method=method,
            parameters=UNDAMPED,
            initial=[0, 0],
            inputs={"F": moved},
            **options,
        )
        np.testing.assert_allclose(batch.final[:, 0], batch.final[0, 0], rtol=5e-3)
        np.testing.assert_allclose(
            batch.final[0, 0], after_impulse(0.1 - (0.0005 if shape != "exponential" else 0.0002), 1.0), rtol=5e-3
        )


def test_a_batch_refuses_a_pulse_that_an_offset_makes_too_short(model):
    pulse = pulse_of("half_sine", 0.0, 1e-6)
    moved = qddot.per_run(pulse, offset=[0.0, -EPOCH])
    with pytest.raises(
        ValueError, match=r"input F of run 1 has breakpoints 1e-06 s apart at t = .*count time from nearer"
    ):
        qddot.simulate_batch(model, (EPOCH, EPOCH + 1), method="ode45", initial=[0, 0], inputs={"F": moved})
    with pytest.raises(ValueError, match="input F has breakpoints 1e-06 s apart"):
        qddot.simulate(model, (EPOCH, EPOCH + 1), method="ode45", inputs={"F": pulse.shifted(1.0, -EPOCH)})


@njit
def integrator(t, x, u, c, dx):
    """x' = u."""
    dx[0] = u[0]


@pytest.mark.parametrize("method", ["ode45", "dop853", "rk4"])
@given(
    st.sampled_from(("rectangle", *SHAPES)),
    st.floats(-1e9, 1e9),
    st.lists(st.floats(0.0, 3.0), min_size=1, max_size=4),
    st.floats(-6, 1).map(lambda power: 10.0**power),
)
@settings(max_examples=40, deadline=None, print_blob=True, derandomize=True)
def test_the_integral_over_a_train_is_its_impulse(method, shape, origin, behind, duration):
    starts = origin + duration * np.array(behind)
    if 0.2 * duration < RESOLVED * np.spacing(abs(origin) + 5 * duration):
        return
    pulses = (
        qddot.signal.pulse_train("trapezoid", times=starts, rise=0, impulse=1.0, duration=duration)
        if shape == "rectangle"
        else qddot.signal.pulse_train(shape, times=starts, impulse=1.0, duration=duration)
    )
    span = (starts.min() - duration, starts.max() + 2 * duration)
    blur = np.spacing(max(map(abs, span))) / duration
    options = {"step": 0.01 * duration} if method == "rk4" else dict.fromkeys(("rtol", "atol"), 1e-6 + 10 * blur)
    if method == "rk4" and options["step"] < 64 * np.spacing(max(map(abs, span))):
        return
    s = qddot.solve(integrator, span, [0.0], method=method, inputs=[pulses], **options)
    assert s.states[-1, 0] == pytest.approx(len(starts), rel=3e-4 + 40 * blur)


def test_the_last_stage_before_a_jump_reads_what_was_before_it(model):
    """A step of 2^12 spacings: a side of a millionth of the step inside it would be the jump's own time."""
    rectangle = qddot.signal.pulse_train("trapezoid", times=[EPOCH + 0.25], rise=0, peak=1.0, duration=2.0**-10)
    s = qddot.solve(integrator, (EPOCH, EPOCH + 0.5), [0.0], method="rk4", step=2.0**-10, inputs=[rectangle])
    assert s.states[-1, 0] == pytest.approx(2.0**-10, rel=1e-12)
    assert s.states[s.t == EPOCH + 0.25, 0] == 0.0


def test_a_table_far_from_zero_is_read_where_it_lies(model):
    t = EPOCH + 0.01 * np.arange(101)
    road = qddot.signal.table(t, np.sin(20 * (t - EPOCH)), kind="cubic")
    at = np.linspace(EPOCH, EPOCH + 1, 1000)
    near = qddot.signal.table(t - EPOCH, np.sin(20 * (t - EPOCH)), kind="cubic")
    np.testing.assert_allclose(road(at), near(at - EPOCH), atol=1e-6)
    batch = qddot.simulate_batch(
        model, (EPOCH, EPOCH + 1), method="dop853", runs=2, initial=[0, 0], inputs={"z_1": road}, rtol=1e-8
    )
    alone = qddot.simulate(model, (0, 1), method="dop853", initial=[0, 0], inputs={"z_1": near}, rtol=1e-8)
    np.testing.assert_allclose(batch.final[0], alone.states[-1], rtol=1e-4, atol=1e-5)


def test_a_varying_speed_at_a_late_time_keeps_the_kinks_of_the_road(model):
    speed = qddot.signal.table([0.0, EPOCH, EPOCH + 1, EPOCH + 2], [0.0, 0.0, 2.0, 2.0])
    road = qddot.signal.table([0.0, 1.0, 2.0, 2.5], [0.0, 0.0, 0.1, 0.1])
    z = qddot.drive(model, road, speed, positions={"z_1": 0.0}, span=(EPOCH, EPOCH + 2))["z_1"]
    inside = z.breakpoint_times()[(z.breakpoint_times() > EPOCH + 0.1) & (z.breakpoint_times() < EPOCH + 1.9)]
    np.testing.assert_allclose(inside - EPOCH, [1.0, 1.5], atol=1e-6)
    assert z(EPOCH + 1.25) == pytest.approx(0.05, abs=1e-6)


# A function as an input


def test_a_function_is_sampled_to_the_stated_tolerance():
    def bump(t):
        return np.exp(-((t - 3.0) ** 2) / 1e-2) + 0.1 * np.sin(5 * t)

    for tolerance in (1e-3, 1e-6, 1e-9):
        signal = qddot.signal.sampled(bump, 0.0, 10.0, tolerance=tolerance)
        t = np.linspace(0, 10, 100_003)
        assert np.abs(signal(t) - bump(t)).max() < 2 * tolerance
    assert len(signal.pieces) < 3000
    assert signal(-1.0) == pytest.approx(bump(0.0), abs=1e-12)
    assert signal(11.0) == pytest.approx(bump(10.0), abs=1e-12)
    assert signal.breakpoints.tolist() == [0.0, 10.0]
    assert not jumps(signal.pieces).size


def test_a_function_that_jumps_wants_breakpoints():
    def switched(t):
        return 2.0 if 0.3 <= t < 0.7 else t

    with pytest.raises(ValueError, match=r"cannot be followed to 0.001 at 0\.[37].*breakpoints=\[0\.[37]"):
        qddot.signal.sampled(switched, 0.0, 1.0, tolerance=1e-3)
    signal = qddot.signal.sampled(switched, 0.0, 1.0, tolerance=1e-9, breakpoints=[0.3, 0.7])
    t = np.linspace(0, 0.999, 1000)
    np.testing.assert_allclose(signal(t), [switched(each) for each in t], atol=1e-8)
    assert signal.breakpoints.tolist() == [0.0, 0.3, 0.7, 1.0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((3.0, 0.0, 1.0, 1e-3, ()), "function is 3.0, expected a function"),
        ((np.sin, 1.0, 1.0, 1e-3, ()), "expected a start before the end"),
        ((np.sin, 0.0, 1.0, 0.0, ()), "tolerance is 0.0, expected a number greater than 0"),
        ((np.sin, 0.0, 1.0, 1e-3, [2.0]), "expected times between 0.0 and 1.0"),
        ((lambda t: "x", 0.0, 1.0, 1e-3, ()), "the function at 0.0 is 'x', expected a number"),
        ((lambda t: np.nan, 0.0, 1.0, 1e-3, ()), "the function at 0.0 is nan, expected a finite number"),
        ((lambda t: 1e4 * np.sin(1e9 * t) % 1.0, 0.0, 1.0, 1e-6, ()), "cannot be followed"),
    ],
)
def test_a_function_that_is_none_is_named(arguments, message):
    function, start, end, tolerance, breakpoints = arguments
    with pytest.raises(ValueError, match=message):
        qddot.signal.sampled(function, start, end, tolerance=tolerance, breakpoints=breakpoints)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.sin, r"input F is a function; give qddot.signal.sampled\(.*qddot.signal.table"),
        (np.zeros(100), r"input F is a row of 100 values; give qddot.signal.table\(t, values\)"),
        ([1.0, 2.0], r"input F is a row of 2 values; give qddot.signal.table"),
    ],
)
def test_what_is_no_signal_is_told_how_to_become_one(model, value, message):
    with pytest.raises(ValueError, match=message):
        qddot.simulate(model, (0, 1), step=0.1, inputs={"F": value})


def test_a_sampled_function_drives_a_model_as_the_sine_it_is(model):
    sampled = qddot.signal.sampled(lambda t: 3 * np.sin(7 * t), 0.0, 2.0, tolerance=1e-9)
    exact = qddot.signal.sine(3.0, 7 / (2 * np.pi))
    runs = [
        qddot.simulate(model, (0, 2), method="dop853", initial=[0, 0], rtol=1e-9, inputs={"F": f, "z_1": f})
        for f in (sampled, exact)
    ]
    np.testing.assert_allclose(runs[0].states[-1], runs[1].states[-1], atol=1e-6)
    assert [b - a for a, b in pairwise(sampled.breakpoints)] == [2.0]
