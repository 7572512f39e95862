"""An absorber in a dead zone, free within |x| < d and on a spring beyond it, beside its piecewise solution."""

import numpy as np
import pytest
from mechanisms import HALF, coordinates, energy, parameters
from sympy import Abs, Max, symbols

import qddot
from qddot.model import System

x, xdot, m, k_s, d = symbols("x xdot m k_s d")
MASS, STOP, GAP = 2.0, 5000.0, 0.05


@pytest.fixture(scope="module")
def absorber(tmp_path_factory):
    made = System(
        "absorber",
        "Oscillator in a dead zone",
        coordinates("m", "x"),
        parameters(m=(MASS, "kg"), k_s=(STOP, "N/m"), d=(GAP, "m")),
        HALF * m * xdot**2,
        HALF * k_s * Max(0, Abs(x) - d) ** 2,
    )
    return qddot.load(qddot.generate(made, tmp_path_factory.mktemp("kernels")))


def place(t, speed):
    """From the middle at this speed: across at it, half a sine against the stop, and back; x and xdot at t."""
    omega = np.sqrt(STOP / MASS)
    across, against = 2 * GAP / speed, np.pi / omega
    half = across + against
    count, left = divmod(t + GAP / speed, half)
    sign = 1.0 if count % 2 == 0 else -1.0
    if left <= across:
        return sign * (speed * left - GAP), sign * speed
    phase = omega * (left - across)
    return sign * (GAP + speed / omega * np.sin(phase)), sign * speed * np.cos(phase)


WAYS = [
    ("dop853", {"rtol": 1e-12, "atol": 1e-14}, 1e-9),
    ("vern7", {"rtol": 1e-12, "atol": 1e-14}, 1e-9),
    ("tsit5", {"rtol": 1e-12, "atol": 1e-14}, 1e-9),
    ("taylor", {"rtol": 1e-13, "atol": 1e-14}, 1e-9),
    ("ode45", {"rtol": 1e-11, "atol": 1e-13}, 1e-8),
    ("ode23", {"rtol": 1e-8, "atol": 1e-10}, 1e-4),
    ("rodas5p", {"rtol": 1e-11, "atol": 1e-13}, 1e-7),
    ("ode15s", {"rtol": 1e-10, "atol": 1e-12}, 1e-5),
    ("rk4", {"step": 2e-4, "switching": "locate"}, 1e-8),
]


@pytest.mark.parametrize(("method", "options", "tolerance"), WAYS)
def test_an_absorber_in_a_dead_zone_is_its_piecewise_solution(absorber, method, options, tolerance):
    """Every stop is met and left at its time: the period is 4 d / v + 2 pi / omega."""
    speed, end = 1.3, 2.0
    watched = [qddot.crossing(absorber, "x", side * GAP, called=name) for side, name in ((1, "right"), (-1, "left"))]
    run = qddot.simulate(absorber, (0.0, end), initial=[0.0, speed], method=method, events=watched, **options)
    np.testing.assert_allclose([run["x"][-1], run["xdot"][-1]], place(end, speed), rtol=0, atol=100 * tolerance)
    half = 2 * GAP / speed + np.pi / np.sqrt(STOP / MASS)
    for name, first in (("right", GAP / speed), ("left", GAP / speed + half)):
        met = np.arange(first, end, 2 * half)
        left = np.arange(first + np.pi / np.sqrt(STOP / MASS), end, 2 * half)
        expected = np.sort(np.concatenate([met, left]))
        assert len(expected) > 13
        np.testing.assert_allclose(run.events.times(name), expected, rtol=0, atol=tolerance)
    assert np.ptp(energy(absorber, run)) < 10 * tolerance


def test_the_period_of_the_absorber_depends_on_its_speed(absorber):
    """As by hand for every speed: the stop is a straight spring, the way between is crossed freely."""
    for speed in (0.2, 1.0, 5.0):
        crossing = qddot.crossing(absorber, "x", 0.0, direction=1, called="period")
        end = 2.5 * (4 * GAP / speed + 2 * np.pi / np.sqrt(STOP / MASS))
        run = qddot.simulate(
            absorber, (0.0, end), initial=[0.0, speed], method="dop853", events=[crossing], rtol=1e-12, atol=1e-14
        )
        times = run.events.times("period")
        np.testing.assert_allclose(np.diff(times[times > 1e-6], prepend=0.0), end / 2.5, rtol=0, atol=1e-9)
