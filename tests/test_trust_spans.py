"""Spans as SciPy's users know them: backward, of no length, without an end; a relative tolerance for each state."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp

import qddot
from qddot.runner.problem import Status

CAR = qddot.load("quarter_car")
ROAD = qddot.signal.table(np.linspace(0, 2, 9), [0, 0.01, -0.01, 0.02, 0, 0, 0.01, -0.02, 0], kind="linear")
SHOT = qddot.signal.pulse_train(times=[0.7, 1.31], duration=0.05, peak=2.0)
WAYS = {
    "rk4": ({"step": 5e-4}, 1e-9),
    "ode45": ({"rtol": 1e-8, "atol": 1e-10}, 1e-7),
    "dop853": ({"rtol": 1e-10, "atol": 1e-12}, 1e-9),
    "ode15s": ({"rtol": 1e-7, "atol": 1e-9}, 1e-4),
    "rodas5p": ({"rtol": 1e-9, "atol": 1e-11}, 1e-6),
}
START = np.array([0.3, -0.2])


@njit(cache=True)
def pendulum(t, x, u, c, dx):
    """A damped pendulum that time and an input drive."""
    dx[0] = x[1]
    dx[1] = -c[0] * np.sin(x[0]) - 0.1 * x[1] + np.cos(3.0 * t) + u[0]


@njit(cache=True)
def late(t, x, u, c):
    return t - 0.9


@cache
def _reference(t0, t1):
    """SciPy's, piece by piece between the kinks of the input."""

    def rhs(t, x):
        return [x[1], -4.0 * np.sin(x[0]) - 0.1 * x[1] + np.cos(3.0 * t) + float(SHOT(t))]

    edges = np.array([0.7, 0.75, 1.31, 1.36])
    inside = edges[(edges > min(t0, t1)) & (edges < max(t0, t1))]
    stops = [t0, *(inside if t1 > t0 else inside[::-1]), t1]
    x = START
    for begin, end in pairwise(stops):
        x = solve_ivp(rhs, (begin, end), x, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return x


@pytest.mark.parametrize("method", WAYS)
def test_backward_is_what_scipy_gives(method):
    options, near = WAYS[method]
    s = qddot.solve(pendulum, (2.0, 0.0), START, method=method, constants=[4.0], inputs=[SHOT], **options)
    assert (s.t[0], s.t[-1]) == (2.0, 0.0)
    assert (np.diff(s.t) < 0).all()
    assert not np.signbit(s.t[-1])
    np.testing.assert_allclose(s.states[-1], _reference(2.0, 0.0), atol=near)
    np.testing.assert_array_equal(s["u_1"], SHOT(s.t))
    assert s.message.endswith("finished at t = 0 s")


@pytest.mark.parametrize("method", [*WAYS, "exact"])
def test_a_run_there_and_back_ends_where_it_began(method):
    options, near = WAYS.get(method, ({"step": 0.1}, 1e-9))
    there = qddot.simulate(CAR, (0.1, 0.4), method=method, inputs={"z_r": ROAD}, **options)
    back = qddot.simulate(CAR, (0.4, 0.1), method=method, inputs={"z_r": ROAD}, initial=there.states[-1], **options)
    scale = np.abs(there.states).max(axis=0)
    np.testing.assert_allclose(back.states[-1] / scale, there.states[0] / scale, atol=1e3 * near)
    assert back.statistics.steps > 0


@pytest.mark.parametrize("method", [*WAYS, "exact"])
def test_output_times_fall_with_the_run(method):
    options, near = WAYS.get(method, ({}, 1e-9))
    times = np.array([0.35, 0.26, 0.2, 0.13])
    given = {"inputs": {"z_r": ROAD}, "initial": np.array([0.01, 0.0, 0.0, 0.1]), "output_times": times}
    s = qddot.simulate(CAR, (0.4, 0.1), method=method, **given, **options)
    np.testing.assert_array_equal(s.t, [0.4, *times, 0.1])
    exact = qddot.simulate(CAR, (0.4, 0.1), method="exact", **given)
    scale = np.abs(exact.states).max(axis=0)
    np.testing.assert_allclose(s.states / scale, exact.states / scale, atol=1e3 * near)


@pytest.mark.parametrize(
    ("times", "message"),
    [([0.2, 0.3], "output_times must fall, as the span from 0.4 to 0.1 does"), ([0.05], "output time 0.05 is outside")],
)
def test_wrong_output_times_of_a_backward_run_are_named(times, message):
    with pytest.raises(ValueError, match=message):
        qddot.simulate(CAR, (0.4, 0.1), step=1e-3, output_times=times)


@pytest.mark.parametrize("method", ["dop853", "rodas5p", "ode15s"])
def test_events_of_a_backward_run(method):
    events = [qddot.Event(late, name="late", direction=-1), qddot.Event(late, name="never", direction=1)]
    s = qddot.solve(
        pendulum, (2.0, 0.0), START, method=method, rtol=1e-9, atol=1e-11, constants=[4.0], inputs=[SHOT], events=events
    )
    assert s.events.times("late") == pytest.approx([0.9], abs=1e-12)
    assert not len(s.events.times("never"))
    k = np.searchsorted(-s.t, -0.9)
    assert s["x_1"][k - 1] >= s.events.states[0, 0] >= s["x_1"][k] or s["x_1"][k - 1] <= s.events.states[0, 0]
    level = float(_reference(2.0, 1.95)[0])
    stop = qddot.solve(
        pendulum, (2.0, 0.0), START, method=method, rtol=1e-9, atol=1e-11, constants=[4.0], inputs=[SHOT],
        events=[_crossing(0, level)],
    )  # fmt: skip
    assert stop.status is Status.TERMINATED
    assert stop.t[-1] == pytest.approx(1.95, abs=1e-5)


def _crossing(state, level):
    from qddot.runner.frame.events import StateCrossing

    return StateCrossing(state, level, terminal=True)


def test_a_failure_of_a_backward_run_says_when():
    s = qddot.solve(
        pendulum, (2.0, 0.0), START, method="dop853", constants=[4.0], inputs=[SHOT], divergence_limit=1.0,
        on_failure="return",
    )  # fmt: skip
    assert s.status is Status.NON_FINITE
    assert 0 < s.failed_at < 2.0
    assert s.failed_at <= s.t[-1]


@pytest.mark.parametrize("method", [*WAYS, "exact"])
def test_a_span_of_no_length_is_one_point(method):
    options = {"step": 1e-3} if method == "rk4" else {}
    s = qddot.simulate(CAR, (0.3, 0.3), method=method, inputs={"z_r": ROAD}, initial={"z_s": 0.1}, **options)
    assert s.success
    assert s.statistics.steps == 0
    np.testing.assert_array_equal(s.t, [0.3])
    np.testing.assert_array_equal(s.states, [[0.1, 0, 0, 0]])
    assert s["z_r"] == pytest.approx(ROAD(np.array([0.3])))
    with pytest.raises(ValueError, match=r"output time 0.4 is outside the span from 0.3 to 0.3"):
        qddot.simulate(CAR, (0.3, 0.3), method=method, initial={"z_s": 0.1}, output_times=[0.4], **options)


@njit(cache=True)
def falling(t, x, u, c, dx):
    dx[0], dx[1] = x[1], -9.81 + u[0]


LANDS = float(np.sqrt(2 * 1e3 / 9.81))


@pytest.mark.parametrize("method", ["ode45", "dop853", "ode15s", "rodas5p"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_run_without_an_end_goes_on_to_its_event(method, sign):
    options = {"rtol": 1e-8, "atol": 1e-9, "events": [_crossing(0, 0.0)]}
    s = qddot.solve(falling, (1.0, sign * np.inf), [1e3, 0.0], method=method, **options)
    assert s.status is Status.TERMINATED
    assert s.success
    assert s.t[-1] == pytest.approx(1.0 + sign * LANDS, rel=1e-6)
    assert np.isfinite(s.values).all()


def test_a_run_without_an_end_lands_on_breakpoints():
    """It stands still until a push of 1 N s, far too short to be met by chance, sets it going."""
    push = qddot.signal.pulse_train(times=[1000.0], duration=1e-3, impulse=1.0)
    s = qddot.solve(
        still, (0.0, np.inf), [0.0, 0.0], method="dop853", rtol=1e-9, inputs=[push], events=[_crossing(0, 5.0)]
    )
    assert s.t[-1] == pytest.approx(1005.0005, abs=1e-6)


@njit(cache=True)
def still(t, x, u, c, dx):
    dx[0], dx[1] = x[1], u[0]


def test_a_run_without_an_end_and_without_its_event_has_failed():
    s = qddot.solve(still, (0.0, np.inf), [0.0, 0.0], method="ode45", events=[_crossing(0, 5.0)], on_failure="return")
    assert s.status is Status.NO_EVENT
    assert not s.success
    assert "met no terminal event" in s.message


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"method": "dop853"}, r"span is \(0, inf\), but no event with terminal=True would end the run"),
        ({"method": "rk4", "step": 1e-3}, "method rk4 goes to a finite end"),
        ({"method": "exact"}, "method exact goes to a finite end"),
    ],
)
def test_a_span_without_an_end_needs_an_event_that_ends_it(given, message):
    with pytest.raises(ValueError, match=message):
        qddot.simulate(CAR, (0, np.inf), **given)


def test_a_batch_goes_forward_and_says_so():
    with pytest.raises(ValueError, match=r"span of run 1 is \(2.0, 1.0\).*qddot.simulate goes backward"):
        qddot.simulate_batch(CAR, (np.array([0.0, 2.0]), 1.0), step=1e-3)


@njit(cache=True)
def apart(t, x, u, c, dx):
    """Two oscillators that know nothing of each other."""
    for i in range(2):
        dx[2 * i] = x[2 * i + 1]
        dx[2 * i + 1] = -((1.0 + 2.0 * i) ** 2) * x[2 * i]


@pytest.mark.parametrize("method", ["ode23", "ode45", "tsit5", "dop853", "ode15s", "rodas5p"])
def test_equal_relative_tolerances_are_one(method):
    options = {"method": method, "atol": 1e-9}
    one = qddot.solve(apart, (0, 5), [1.0, 0, 1.0, 0], rtol=1e-5, **options)
    four = qddot.solve(apart, (0, 5), [1.0, 0, 1.0, 0], rtol=[1e-5] * 4, **options)
    np.testing.assert_array_equal(one.values, four.values)
    assert four.metadata["rtol"] == "1e-05, 1e-05, 1e-05, 1e-05"


@pytest.mark.parametrize("method", ["ode45", "dop853", "ode15s", "rodas5p"])
def test_a_tolerance_counts_for_its_own_state(method):
    """The quick one of two decides on steps and errors, whatever is asked of the slow one."""

    def errors(rtol):
        s = qddot.solve(apart, (0, 5), [1.0, 0, 1.0, 0], method=method, rtol=rtol, atol=1e-12)
        return np.abs(s["x_3"] - np.cos(3 * s.t)).max(), s.statistics.steps

    tight, only_quick, only_slow = errors(1e-8), errors([1e-3, 1e-3, 1e-8, 1e-8]), errors([1e-8, 1e-8, 1e-3, 1e-3])
    assert only_quick[0] < 2 * tight[0]
    assert only_quick[1] == pytest.approx(tight[1], rel=0.1)
    assert only_slow[0] > 100 * tight[0]
    assert only_slow[1] < 0.6 * tight[1]


def test_tolerances_of_states_hold_in_lanes():
    rtol = np.array([1e-9, 1e-5, 1e-4, 1e-3])
    given = {"method": "dop853", "rtol": rtol, "atol": 1e-9, "inputs": {"z_r": ROAD}, "initial": {"z_s": 0.01}}
    batch = qddot.simulate_batch(CAR, (0, 0.5), runs=2, **given)
    alone = qddot.simulate(CAR, (0, 0.5), **given)
    assert batch.in_lanes
    assert (batch.steps == alone.statistics.steps).all()
    np.testing.assert_allclose(batch.final[1], alone.states[-1], rtol=1e-9, atol=1e-15)
    other = qddot.simulate(CAR, (0, 0.5), **{**given, "rtol": float(rtol.min())})
    assert other.statistics.steps > alone.statistics.steps
    with pytest.raises(ValueError, match="rtol has 3 entries, expected one number or one for each of 4 states"):
        qddot.simulate_batch(CAR, (0, 0.5), runs=2, method="dop853", rtol=[1e-3] * 3)
