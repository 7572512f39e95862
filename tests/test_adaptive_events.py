import numpy as np
import pytest
from adaptive_runs import ADAPTIVE, circle, falling, forced, run
from numba import njit

from qddot.runner.frame.events import Event, OutputCrossing, StateCrossing
from qddot.runner.inputs.signal import Signal
from qddot.runner.problem import Status

FALL = np.sqrt(2 * 10 / 9.81)


@njit
def height(t, x, u, c):
    return x[0]


@njit
def late(t, x, u, c):
    return t - 0.5


@njit
def angle_outputs(t, x, u, c, y):
    y[0] = x[0] - x[1]
    y[1] = x[0] * x[1]


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_fall_ends_on_the_ground(method):
    """The step that crosses reaches far beyond; the run ends at the crossing."""
    trajectory = run(
        falling, (0, 10), (10, 0), method, events=[Event(height, direction=-1, terminal=True, name="ground")]
    )
    assert trajectory.status == Status.TERMINATED
    assert trajectory.t[-1] == pytest.approx(FALL, abs=1e-12)
    np.testing.assert_allclose(trajectory.states[-1], (0, -9.81 * FALL), atol=1e-11)
    assert trajectory.states[-1, 0] <= 0
    assert (np.diff(trajectory.t) > 0).all()
    np.testing.assert_allclose(trajectory.extras["events"].times("ground"), trajectory.t[-1])


@pytest.mark.parametrize("output_times", [None, np.linspace(0, 10, 101)])
def test_nothing_is_saved_after_a_terminal_event(output_times):
    trajectory = run(falling, (0, 10), (10, 0), events=[Event(height, terminal=True)], output_times=output_times)
    assert trajectory.t[-1] == pytest.approx(FALL)
    if output_times is not None:
        np.testing.assert_array_equal(trajectory.t[:-1], output_times[output_times < FALL])


@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize(("direction", "first", "period"), [(1, 1.5, 2), (-1, 0.5, 2), (0, 0.5, 1)])
def test_crossings_and_their_directions(method, direction, first, period):
    """cos t goes through zero at pi/2, 3 pi/2, ..."""
    event = StateCrossing(0, direction=direction, name="zero")
    trajectory = run(circle, (0, 20), (1, 0), method, events=[event], rtol=1e-9, atol=1e-12)
    expected = np.pi * np.arange(first, 20 / np.pi, period)
    log = trajectory.extras["events"]
    np.testing.assert_allclose(log.times("zero"), expected, atol=1e-5 if method == "ode23" else 1e-6)
    assert np.abs(log.states[:, 0]).max() < 1e-12
    assert trajectory.status == Status.FINISHED


def test_several_events_in_one_step_are_in_order_of_time():
    """One step over the whole span of free fall, which every method solves exactly."""
    events = [StateCrossing(0, 2.0, name="low"), Event(late, name="half"), StateCrossing(0, 8.0, name="high")]
    trajectory = run(falling, (0, 1.4), (10, 0), events=events, first_step=1.4, max_step=1.4)
    assert trajectory.statistics.steps == 1
    log = trajectory.extras["events"]
    assert [log.names[i] for i in log.event] == ["half", "high", "low"]
    np.testing.assert_allclose(log.t, [0.5, np.sqrt(2 * 2 / 9.81), np.sqrt(2 * 8 / 9.81)], atol=1e-12)


def test_a_terminal_event_ends_the_list():
    events = [StateCrossing(0, 2.0), Event(late, terminal=True), StateCrossing(0, 8.0)]
    trajectory = run(falling, (0, 1.4), (10, 0), events=events, first_step=1.4, max_step=1.4)
    assert list(trajectory.extras["events"].event) == [1]
    assert trajectory.t[-1] == pytest.approx(0.5, abs=1e-14)


@pytest.mark.parametrize("count", [1, 9])
def test_an_output_crosses_a_level(count):
    """cos t - sin t = 0 at pi/4; cos t sin t = 1/4 at pi/12; more events than fit a small fixed table."""
    events = [OutputCrossing(angle_outputs, 2, 0), OutputCrossing(angle_outputs, 2, 1, 0.25)] * count
    log = run(circle, (0, 1), (1, 0), "dop853", events=events, rtol=1e-10, atol=1e-12).extras["events"]
    np.testing.assert_allclose(log.t, [np.pi / 12] * count + [np.pi / 4] * count, atol=1e-9)


def test_more_events_than_first_expected():
    """The list of events grows."""
    trajectory = run(circle, (0, 400), (1, 0), "dop853", events=[StateCrossing(0)], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(trajectory.extras["events"].t, np.pi * np.arange(0.5, 400 / np.pi), atol=1e-3)


def test_a_value_that_starts_at_zero_has_not_crossed():
    assert len(run(circle, (0, 1), (1, 0), events=[StateCrossing(1)]).extras["events"].t) == 0


@njit
def force_less_one(t, x, u, c):
    return u[0] - 1.0


@pytest.mark.parametrize("terminal", [False, True])
def test_a_jump_of_an_input_is_an_event_at_its_breakpoint(terminal):
    signal = Signal(np.array([[0, *[0.0] * 7], [0.3, 2, *[0.0] * 6]]), np.array([0.3]))
    event = Event(force_less_one, direction=1, terminal=terminal)
    trajectory = run(forced, (0, 1), (0, 0), c=(1.0, 0.0), inputs=(signal,), events=[event])
    assert list(trajectory.extras["events"].t) == [0.3]
    assert trajectory.t[-1] == (0.3 if terminal else 1.0)


def test_a_bouncing_ball_by_restarting():
    """Each flight lasts 2 v / g; restitution 0.8."""
    t, x, bounces = 0.0, np.array([10.0, 0.0]), []
    for _ in range(5):
        flight = run(falling, (t, t + 10), x, "dop853", events=[Event(height, direction=-1, terminal=True)])
        t, x = flight.t[-1], np.array([0.0, -0.8 * flight.states[-1, 1]])
        bounces.append(t)
    expected = FALL + np.concatenate([[0], np.cumsum(2 * FALL * 0.8 ** np.arange(1, 5))])
    np.testing.assert_allclose(bounces, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("events", "message"),
    [
        ([lambda: 1], "events.0. is .* expected an Event"),
        ([Event(lambda t, x, u, c: 1.0)], "jitted by numba"),
        ([StateCrossing(2)], "number 2, expected 0 to 1"),
        ([OutputCrossing(angle_outputs, 2, 2)], "number 2, expected 0 to 1"),
        ([OutputCrossing(angle_outputs, 2, 0), OutputCrossing(falling, 2, 0)], "different output kernels"),
    ],
)
def test_events_that_make_no_sense_are_refused(events, message):
    with pytest.raises(ValueError, match=message):
        run(circle, (0, 1), (1, 0), events=events)


def test_a_direction_is_one_of_three():
    with pytest.raises(ValueError, match="direction is 2"):
        StateCrossing(0, direction=2)


def test_an_event_that_was_not_watched_for():
    log = run(circle, (0, 1), (1, 0), events=[StateCrossing(0)]).extras["events"]
    with pytest.raises(ValueError, match="'event_1'"):
        log.times("ground")
