"""Events with every method: several in one step, in pairs, in order, counted; against zeros that are known."""

import linear_runs as linear
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

import qddot
from qddot.runner.frame.events import Event, OutputCrossing, StateCrossing
from qddot.runner.frame.turns import points, room, to_bernstein, turning_points
from qddot.runner.problem import Status

#: x'' = 6 t + 12 from -8: (t + 6)(t + 2)(t - 2).
TRIPLE = linear.double_integral(linear.polynomial(12.0, 6.0), (-120, 92), (-8.0, 8.0))


@njit
def position(t, x, u, c):
    return x[0]


@njit
def quick(t, x, u, c):
    return np.cos(10.0 * x[0])


@njit
def squares(t, x, u, c, y):
    y[0] = x[0] * x[0]
    y[1] = x[0] * x[0] * x[1]


def times(trajectory, event=0):
    log = trajectory.extras["events"]
    return log.t[log.event == event]


@pytest.mark.parametrize("method", linear.EVERY)
def test_a_fall_ends_on_the_ground(method):
    """Ten metres at 10 m/s^2 take sqrt(2) s; a parabola is its own cubic."""
    fall = linear.double_integral(None, (10, 0), (0, 10), pull=-10.0)
    found = linear.run(method, fall, 0.01, events=[StateCrossing(0, terminal=True)], rtol=1e-8, atol=1e-10)
    near = {"euler": 0.006, "ode15s": 1e-6}.get(method, 1e-12)
    assert found.status is Status.TERMINATED
    assert found.t[-1] == pytest.approx(np.sqrt(2), abs=near)
    assert found.states[-1] == pytest.approx([0, -10 * np.sqrt(2)], abs=10 * near)
    assert (np.diff(found.t) > 0).all()


def test_a_fall_ends_on_the_ground_by_the_front_door():
    """The run of the issue: rk4 at 0.01 fell on to -490 m, and called that a success."""

    @njit
    def falling(t, x, u, c, dx):
        dx[0], dx[1] = x[1], -10.0

    ground = [qddot.Event(position, terminal=True, name="ground")]
    run = qddot.solve(falling, (0, 10), [10.0, 0.0], method="rk4", step=0.01, events=ground)
    assert run.success
    assert run.t[-1] == run.events.times("ground")[0] == pytest.approx(np.sqrt(2), abs=1e-14)


@pytest.mark.parametrize("method", linear.EVERY)
def test_three_zeros_of_a_cubic(method):
    found = times(linear.run(method, TRIPLE, 0.01, events=[StateCrossing(0)], rtol=1e-6, atol=1e-6))
    near = 0.05 if method == "euler" else 1e-3 if method not in linear.EXACT_ON_CUBICS else 1e-10
    assert found == pytest.approx([-6, -2, 2], abs=near)


@pytest.mark.parametrize("method", [name for name in linear.EXACT_ON_CUBICS if name not in (*linear.FIXED, "exact")])
def test_three_zeros_in_one_step(method):
    """A step over the whole span, whose ends say that there is one zero."""
    found = linear.run(
        method,
        TRIPLE,
        0.0,
        events=[StateCrossing(0), Event(position)],
        rtol=0.1,
        atol=1e6,
        first_step=16.0,
        max_step=16.0,
    )
    assert found.statistics.steps == 1
    assert times(found, 0) == pytest.approx([-6, -2, 2], abs=1e-11)
    assert times(found, 1) == pytest.approx([-6, -2, 2], abs=1e-11)


@pytest.mark.parametrize("step", [16.0, 4.1])
def test_three_zeros_in_one_step_of_constant_length(step):
    found = linear.run("rk4", TRIPLE, step, events=[StateCrossing(0)])
    assert times(found) == pytest.approx([-6, -2, 2], abs=1e-12)


@pytest.mark.parametrize("method", linear.EVERY)
def test_seven_crossings_near_the_top(method):
    """cos t passes 0.995 at 2 pi k plus and minus arccos 0.995: pairs that are 0.2 s apart, 6.3 s from each other."""
    events = [StateCrossing(0, 0.995), StateCrossing(0, 0.995, direction=1), StateCrossing(0, 0.995, direction=-1)]
    step = 2e-5 if method == "euler" else 0.01
    found = linear.run(method, linear.cosine(1.0, 0.0, (0, 20)), step, events=events, rtol=1e-6, atol=1e-8)
    before = np.arccos(0.995)
    rising, falling = 2 * np.pi * np.arange(1, 4) - before, 2 * np.pi * np.arange(4) + before
    near = {"exact": 1e-13, "rk4": 1e-8, "ode15s": 0.02, "ode23": 1e-3}.get(method, 5e-3)
    assert times(found, 0) == pytest.approx(np.sort([*rising, *falling]), abs=near)
    np.testing.assert_array_equal(times(found, 1), times(found, 0)[1::2])
    np.testing.assert_array_equal(times(found, 2), times(found, 0)[::2])


@pytest.mark.parametrize("method", linear.EVERY)
def test_events_are_in_order_of_time_and_of_the_list(method):
    """Levels of a fall, some twice: equal times in the order of the list."""
    fall = linear.double_integral(None, (10, 0), (0, 1.4), pull=-10.0)
    levels = [2.0, 8.0, 5.0, 8.0]
    events = [StateCrossing(0, level) for level in levels]
    log = linear.run(method, fall, 0.07 if method == "euler" else 0.7, events=events, rtol=1e-3, atol=10.0).extras[
        "events"
    ]
    if method not in ("euler", "heun", "midpoint", "ode15s"):
        assert log.t == pytest.approx(np.sqrt([0.4, 0.4, 1.0, 1.6]), abs=1e-12)
    assert list(log.event) == [1, 3, 2, 0]
    assert (np.diff(log.t) >= 0).all()


@pytest.mark.parametrize("method", linear.EVERY)
@pytest.mark.parametrize(("count", "direction", "end"), [(1, 0, -6), (2, 0, -2), (3, 0, 2), (2, 1, 2), (1, -1, -2)])
def test_a_run_ends_at_the_nth_crossing(method, count, direction, end):
    events = [StateCrossing(0, direction=direction, terminal=count), StateCrossing(0)]
    found = linear.run(method, TRIPLE, 0.01, events=events, rtol=1e-8, atol=1e-8)
    assert found.status is Status.TERMINATED
    assert found.t[-1] == pytest.approx(end, abs=0.05 if method == "euler" else 1e-4)
    assert len(times(found, 0)) == count
    assert len(times(found, 1)) == [-6, -2, 2].index(end)  # what happens with the end, but stands behind it in the list


@pytest.mark.parametrize("method", linear.EVERY)
def test_a_count_that_is_not_reached_ends_nothing(method):
    found = linear.run(method, TRIPLE, 0.01, events=[StateCrossing(0, terminal=4)], rtol=1e-6, atol=1e-6)
    assert found.status is Status.FINISHED
    assert len(times(found)) == 3


@pytest.mark.parametrize("method", [*linear.EVERY, "taylor", "auto"])
@pytest.mark.parametrize("part", [1e-3, 1.0, 1.997])
def test_a_weight_on_a_spring_passes_near_its_turns(method, part):
    """q = -a (1 - cos w t): levels near both turns are passed in pairs, some thousandths of a period apart."""
    axle, span = qddot.load("one_axle"), 0.1
    omega = np.sqrt((2.15e6 + 6.5e4) / 120.0)
    level, angle, turns = -part * 9.81 / omega**2, np.arccos(1 - part), 2 * np.pi * np.arange(3)
    expected = np.sort(np.concatenate([turns + angle, turns + 2 * np.pi - angle])) / omega
    options = {"step": 2e-7 if method == "euler" else 1e-5} if method in linear.FIXED else {}
    options |= {"rtol": 1e-10, "atol": 1e-14} if method not in (*linear.FIXED, "exact") else {}
    events = [qddot.crossing(axle, "q_2", level), qddot.crossing(axle, "axle_force", level * (2.15e6 + 6.5e4))]
    run = qddot.simulate(axle, (0, span), method=method, initial=[0, 0], events=events, **options)
    near = {"exact": 1e-12, "auto": 1e-12, "taylor": 1e-8, "euler": 1e-4}.get(
        method, 2e-5 if method in linear.FIXED else 1e-6
    )
    for name in ("q_2", "axle_force"):
        assert run.events.times(name) == pytest.approx(expected[expected < span], abs=near)


@pytest.mark.parametrize("method", ["rk4", "dop853", "ode15s", "exact", "taylor"])
def test_a_prepared_run_counts_anew(method):
    car = qddot.load("quarter_car")
    options = {"step": 1e-3} if method == "rk4" else {} if method == "exact" else {"rtol": 1e-6, "atol": 1e-9}
    event = qddot.crossing(car, "z_s", terminal=2)
    run = qddot.prepare(car, (0, 10), method=method, initial={"z_s": 0.1}, events=[event], **options)
    first, second = run(), run()
    assert len(first.events.t) == len(second.events.t) == 2
    assert first.t[-1] == second.t[-1] == first.events.t[-1]


@pytest.mark.parametrize("method", linear.EVERY)
def test_a_jump_counts(method):
    """u jumps over 1 at 0.3 and back at 0.6."""
    rows = np.zeros((3, 8))
    rows[:, 0], rows[:, 1] = (0, 0.3, 0.6), (0, 2, 0)
    pulse = qddot.runner.inputs.signal.Signal(rows, np.array([0.3, 0.6]))
    made = linear.problem([[0, 1], [0, 0]], [[0, 0], [1, 0]], (0, 0), (0.0, 1.0), pulse)
    for count, end in ((1, 0.3), (2, 0.6)):
        found = linear.run(method, made, 0.01, events=[Event(over_one, terminal=count)])
        assert found.t[-1] == pytest.approx(end, abs=1e-15)


@njit
def over_one(t, x, u, c):
    return u[0] - 1.0


@pytest.mark.parametrize("method", linear.EVERY)
def test_functions_that_turn_faster_than_the_state(method):
    """cos(10 x), x rising evenly from 0 to 20: a method may take all of it in one step. x^2 = 1 and x^2 v = 4 once."""
    made = linear.problem([[0, 1], [0, 0]], np.zeros((2, 2)), (0, 1), (0.0, 20.0))
    events = [Event(quick), OutputCrossing(squares, 2, 0, 1.0), OutputCrossing(squares, 2, 1, 4.0)]
    found = linear.run(method, made, 5.0, events=events)
    near = 1e-10 if method != "ode15s" else 1e-4
    assert times(found, 0) == pytest.approx(np.pi / 20 * np.arange(1, 128, 2), abs=near)
    assert times(found, 1) == pytest.approx([1.0], abs=near)
    assert times(found, 2) == pytest.approx([2.0], abs=near)


@pytest.mark.parametrize("method", linear.EVERY)
def test_backward_runs_find_the_same(method):
    end = ((8 + 6) * (8 + 2) * (8 - 2), 3 * 8**2 + 12 * 8 - 4)
    made = linear.double_integral(linear.polynomial(12.0, 6.0), end, (8.0, -8.0))
    events = [StateCrossing(0), StateCrossing(0, direction=1, terminal=True)]
    found = linear.run(method, made, 0.001 if method == "euler" else 0.01, events=events, rtol=1e-8, atol=1e-8)
    near = 0.05 if method == "euler" else 1e-3
    assert times(found, 0) == pytest.approx([2, -2], abs=near)
    assert found.t[-1] == pytest.approx(-2, abs=near)  # against time the cubic rises there


ROOTS = st.floats(-3.0, 3.0)


@settings(max_examples=60, deadline=None, print_blob=True)
@given(st.sampled_from(linear.EXACT_ON_CUBICS), st.lists(ROOTS, min_size=3, max_size=3), st.floats(-5.0, 5.0))
def test_all_zeros_of_any_cubic(method, roots, scale):
    roots = np.sort(roots)
    if np.diff(roots).min() < 1e-3 or abs(scale) < 0.1:
        return
    cubic = scale * np.polynomial.Polynomial.fromroots(roots)
    signal = linear.polynomial(*cubic.deriv(2).coef)
    made = linear.double_integral(signal, (cubic(-4.0), cubic.deriv()(-4.0)), (-4.0, 4.0))
    # rodas5p differentiates f by time with forward differences, good to 1e-8 alone, but for tight tolerances
    options = {"rtol": 1e-8 if method == "rodas5p" else 1e-3, "atol": 1.0}
    found = times(linear.run(method, made, 1.7, events=[StateCrossing(0)], **options))
    assert len(found) == 3
    slopes = np.abs(cubic.deriv()(roots))
    assert (np.abs(found - roots) <= 1e-11 * np.abs(cubic(4.0) - cubic(-4.0)) / slopes + 1e-12).all()


@settings(max_examples=60, deadline=None, print_blob=True)
@given(
    st.sampled_from([name for name in linear.EVERY if name not in ("euler", "heun", "midpoint", "ode15s", "ode23")]),
    st.floats(0.3, 5.0),
    st.floats(-np.pi, np.pi),
    st.floats(-0.999, 0.999),
)
def test_all_crossings_of_any_cosine(method, omega, phase, level):
    """As many as there are, where they are; of 10 s, its ends left out."""
    angle, k = np.arccos(level), np.arange(-2, 12)
    crossings = np.sort(np.concatenate([(2 * np.pi * k + sign * angle - phase) / omega for sign in (-1, 1)]))
    crossings = crossings[(crossings > 0) & (crossings < 10)]
    if np.abs(np.concatenate([crossings, [5.0]])[:, None] - [0.0, 10.0]).min() < 1e-2:
        return
    made = linear.cosine(omega, phase, (0.0, 10.0))
    found = times(linear.run(method, made, 0.005, events=[StateCrossing(0, level)], rtol=1e-9, atol=1e-11))
    steepest = omega * np.sqrt(1 - level**2)
    assert found == pytest.approx(crossings, abs=1e-12 if method == "exact" else 2e-6 / steepest)


@pytest.mark.parametrize("terminal", [-1, 3.5, "yes", 0, None, np.nan, [1]])
def test_what_is_no_count_is_refused(terminal):
    with pytest.raises(
        ValueError, match=r"event 'low': terminal is .*, expected True, False, or a number of crossings"
    ):
        Event(position, terminal=terminal, name="low")
    with pytest.raises(ValueError, match=r"terminal is .*, expected True, False, or a number of crossings, at least 1"):
        qddot.crossing(qddot.load("quarter_car"), "z_s", terminal=terminal)


@njit
def turns_from_python(c, degree, stack, found):
    return turning_points(c, degree, stack, found)


@settings(max_examples=200, deadline=None, print_blob=True)
@given(st.lists(st.floats(0.01, 0.99), min_size=1, max_size=6))
def test_every_turn_of_a_polynomial_is_found(turns):
    """A polynomial whose derivative has these zeros, from its values at Chebyshev's points."""
    turns = np.sort(turns)
    if len(turns) > 1 and np.diff(turns).min() < 1e-2:
        return
    polynomial = np.polynomial.Polynomial.fromroots(turns).integ()
    degree = len(turns) + 1
    found, stack = np.zeros(2 * degree), np.zeros(room(degree))
    c = to_bernstein(degree) @ polynomial(points(degree))
    count = turns_from_python(c, degree, stack.ctypes.data, found)
    assert found[:count] == pytest.approx(turns, abs=1e-6)
