"""Roads: their shapes, the spectrum of random ones, and what each axle reads at a constant and at a varying speed."""

import numpy as np
import pytest
from commands import command
from hypothesis import example, given, settings
from hypothesis import strategies as st
from matrices import linear_matrices
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import welch

from qddot.runner.equilibrium import equilibrium
from qddot.runner.inputs.drive import Way, drive, roads_at
from qddot.runner.inputs.iso8608 import CLASSES, octave_bands, power_spectral_density, random_road, road_class
from qddot.runner.inputs.roads import cosine_bump, pothole, ramp, sine, step
from qddot.runner.inputs.shapes import constant
from qddot.runner.inputs.signal import START
from qddot.runner.inputs.tables import table
from qddot.runner.load import load
from qddot.runner.simulate import simulate

lengths = st.floats(0.1, 10.0)
heights = st.floats(-1.0, 1.0)
places = st.floats(-20.0, 20.0)


@pytest.fixture(scope="module")
def m113():
    return load("m113")


@given(heights, lengths, places)
@settings(deadline=None, max_examples=40)
def test_shapes_are_their_formulas(height, length, at):
    x = np.linspace(at - length, at + 2 * length, 301)
    s = (x - at) / length
    inside = (s > 0) & (s < 1)
    clear = (np.abs(s) > 1e-6) & (np.abs(s - 1) > 1e-6)
    expected = {
        ramp: height * np.clip(s, 0, 1),
        cosine_bump: np.where(inside, height / 2 * (1 - np.cos(2 * np.pi * s)), 0.0),
        pothole: np.where(inside, -height, 0.0),
    }
    for shape, values in expected.items():
        found = shape(height, length, at)
        np.testing.assert_allclose(found(x)[clear], values[clear], atol=1e-9)
    np.testing.assert_allclose(step(height, at)(x), np.where(x >= at, height, 0.0), atol=1e-12)
    sloped = np.clip(np.minimum(s, 1 - s) / 0.25, 0, 1)
    np.testing.assert_allclose(pothole(height, length, at, 0.25 * length)(x), -height * sloped, atol=1e-9)
    waves = 0.1 + height * np.sin(2 * np.pi * x / length + 0.3)
    np.testing.assert_allclose(sine(height, length, 0.3, 0.1)(x), waves, rtol=1e-15, atol=1e-12 * abs(height))


@pytest.mark.parametrize("of", CLASSES)
def test_a_random_road_has_the_spectrum_of_its_class(of):
    """ISO 8608: Gd(n) = Gd(n0) (n / n0)^-2 from 0.011 to 2.83 cycles/m; a class is from half to twice of it."""
    length, n = 4000.0, 2**17
    road = random_road(of, seed=8608, length=length)
    heights = road(np.linspace(0, length, n, endpoint=False))
    frequencies, psd = welch(heights, n / length, nperseg=n // 8)
    kept = (frequencies > 0.02) & (frequencies < 2.0)
    centres, means = octave_bands(frequencies[kept], psd[kept])
    assert len(centres) >= 5
    ratio = means / (16e-6 * 4.0 ** "ABCDEFGH".index(of) * (centres / 0.1) ** -2)
    assert np.abs(ratio - 1).max() < 0.15
    assert road_class(means[centres == 0.1][0]) == of


def test_its_variance_is_the_integral_of_its_spectrum():
    road = random_road(1e-3, seed=2, length=1000.0, waviness=2.5, shortest=0.5, longest=50.0)
    heights = road(np.linspace(0, 1000, 40_000, endpoint=False))
    expected = quad(lambda n: 1e-3 * (n / 0.1) ** -2.5, 1 / 50, 2)[0]
    assert heights.var() == pytest.approx(expected, rel=0.05)
    frequencies, psd = power_spectral_density(road, 0, 1000, 10)
    assert psd[frequencies > 2.5].max() < 1e-4 * psd[frequencies < 1].min()
    slope = np.polyfit(*np.log([each[(frequencies > 0.05) & (frequencies < 1.5)] for each in (frequencies, psd)]), 1)
    assert slope[0] == pytest.approx(-2.5, abs=0.1)


def test_it_is_a_periodic_spline():
    road = random_road("C", seed=4, length=50.0)
    x = road.pieces[1:, START]
    z = road(x)
    spline = CubicSpline(x, np.append(z[:-1], z[0]), bc_type="periodic")
    at = np.linspace(0, 50, 3001)[:-1]
    np.testing.assert_allclose(road(at), spline(at), atol=1e-12)
    np.testing.assert_allclose(road.derivative(at), spline(at, 1), atol=1e-10)


def test_a_fade_begins_on_level_ground_and_leaves_the_rest_as_it_is():
    plain, faded = (random_road("E", seed=5, fade=fade) for fade in (0.0, 8.0))
    assert faded(0.0) == faded(-3.0) == 0.0
    assert faded.derivative(0.0) == pytest.approx(0.0, abs=1e-12)
    x = np.linspace(8.1, 199, 500)
    np.testing.assert_allclose(faded(x), plain(x), atol=1e-12)
    inside = np.linspace(0.1, 7.9, 400)
    np.testing.assert_allclose(faded(inside), np.sin(np.pi * inside / 16) ** 2 * plain(inside), atol=2e-4)


def test_a_seed_is_a_road_in_any_process():
    code = "from qddot.runner.inputs.iso8608 import random_road; print(random_road('D', seed=3)(41.7).item().hex())"
    assert command(code=code).stdout.strip() == random_road("D", seed=3)(41.7).item().hex()
    assert random_road("D", seed=4)(41.7) != random_road("D", seed=3)(41.7)


@given(st.floats(0.1, 40.0), places, places, st.lists(st.floats(0, 10), min_size=1, max_size=20))
@settings(deadline=None, max_examples=40)
def test_every_axle_reads_the_road_at_its_own_time(speed, start, place, times):
    road = table([-3, 0, 1, 2, 7], [0.1, 0.0, 0.3, -0.2, 0.0])
    t = np.array(times)
    signals = roads_at(road, {"front": 0.0, "rear": place}, speed, start)
    assert signals["front"].pieces is signals["rear"].pieces
    x = start + place + speed * t
    np.testing.assert_allclose(signals["rear"](t), np.interp(x, [-3, 0, 1, 2, 7], [0.1, 0, 0.3, -0.2, 0]), atol=1e-9)
    np.testing.assert_allclose(signals["rear"](t - place / speed), signals["front"](t), atol=1e-9)
    np.testing.assert_allclose(speed * signals["rear"].breakpoint_times() + start + place, [-3, 0, 1, 2, 7], atol=1e-9)


@st.composite
def speeds(draw):
    steps = draw(st.lists(st.floats(0.2, 5.0), min_size=1, max_size=6))
    t = draw(st.floats(-3, 3)) + np.concatenate([[0.0], np.cumsum(steps)])
    return t, np.array(draw(st.lists(st.floats(-5.0, 15.0), min_size=len(t), max_size=len(t))))


def distance(t, knots, v):
    """The integral of the speed from 0 to t, by the exact areas under straight lines; end values hold outside."""
    grid = np.unique(np.concatenate([knots, [0.0, -10.0, 40.0], t]))
    along = np.concatenate(
        [[0.0], np.cumsum(np.diff(grid) * (np.interp(grid[1:], knots, v) + np.interp(grid[:-1], knots, v)) / 2)]
    )
    return np.interp(t, grid, along) - np.interp(0.0, grid, along)


@given(speeds(), st.floats(-3, 3))
@settings(deadline=None, max_examples=60)
def test_a_speed_profile_covers_its_distance(speed, t0):
    knots, v = speed
    way = Way.of(table(knots, v), (t0, 12.0))
    t = np.linspace(max(t0, way.t[0]), 12.0, 200)
    k = np.clip(np.searchsorted(way.t, t, "right") - 1, 0, len(way.v) - 1)
    x, speed_there = way(t, k)
    np.testing.assert_allclose(x, distance(t, knots, v), atol=1e-9)
    np.testing.assert_allclose(speed_there, np.interp(t, knots, v), atol=1e-9)
    low, high = way.range
    assert low - 1e-9 <= x.min()
    assert x.max() <= high + 1e-9


ROADS = {
    "lines": table([0, 2, 5, 6, 20], [0.0, 0.1, -0.2, 0.0, 0.3]),
    "cubic": table([0, 2, 5, 6, 20], [0.0, 0.1, -0.2, 0.0, 0.1], "cubic"),
    "wave": sine(0.1, 3.0),
    "bump": cosine_bump(0.2, 2.0, 4.0),
    "random": random_road("F", seed=1, length=60.0, shortest=1.0),
}


@example("cubic", (np.array([0.0, 1.0]), np.array([0.0, 1.0])), 19.0)
@given(st.sampled_from(sorted(ROADS)), speeds(), places)
@settings(deadline=None, max_examples=60)
def test_a_road_at_a_varying_speed_is_the_road_at_the_distance(name, speed, place):
    knots, v = speed
    road = ROADS[name]
    signal = roads_at(road, {"z": place}, table(knots, v), 1.0, (0.0, 10.0))["z"]
    t = np.linspace(0, 10, 1501)[:-1]
    x = 1.0 + place + distance(t, knots, v)
    np.testing.assert_allclose(signal(t), road(x), atol=1e-12 if name == "lines" else 2e-6)
    sides = np.sign(x[:, None] - road.breakpoints)
    sides[0] = np.where(sides[0] == 0, sides[1], sides[0])  # a run that begins on a kink passes none there
    crossed = np.flatnonzero(np.diff(sides, axis=0).any(axis=1))
    for i in crossed:  # every kink of the road that is passed is a breakpoint
        assert ((signal.breakpoints >= t[i] - 1e-9) & (signal.breakpoints <= t[i + 1] + 1e-9)).any()


@given(st.sampled_from(["lines", "bump", "random"]), speeds())
@settings(deadline=None, max_examples=30)
def test_the_derivative_channel_is_the_slope_times_the_speed(name, speed):
    knots, v = speed
    road = ROADS[name]
    signal = roads_at(road, {"z": -1.0}, table(knots, v), 0.5, (0.0, 10.0))["z"]
    t = np.linspace(0.003, 9.997, 700)
    x = -0.5 + distance(t, knots, v)
    near = np.abs(x[:, None] - road.breakpoints).min(axis=1) < 1e-3
    expected = road.derivative(x) * np.interp(t, knots, v)
    np.testing.assert_allclose(signal.derivative(t)[~near], expected[~near], atol=2e-3)


def test_a_constant_speed_is_a_speed_profile_of_one_value():
    road = ROADS["random"]
    t = np.linspace(0, 5, 400)[:-1]
    steady = roads_at(road, {"z": -1.0}, 8.0, 2.0)["z"]
    profile = roads_at(road, {"z": -1.0}, table([0, 5], [8.0, 8.0]), 2.0, (0, 5))["z"]
    np.testing.assert_allclose(profile(t), steady(t), atol=1e-12)


def test_a_jump_stays_a_jump():
    signal = roads_at(step(0.1, 4.0), {"z": 0.0}, table([0, 10], [0.0, 10.0]), 0.0, (0, 10))["z"]
    at = np.sqrt(8.0)
    np.testing.assert_allclose(signal([at - 1e-9, at + 1e-9]), [0.0, 0.1])
    assert np.abs(signal.breakpoints - at).min() < 1e-12


def test_the_m113_stands_on_a_road_that_is_not_at_height_0(m113):
    """On a plane of height h and slope s the static state is that of level ground, raised and turned with the plane."""
    h, s = 0.5, 0.02
    plane = table([-10, 10], [h - 10 * s, h + 10 * s])
    level = equilibrium(m113, "as_run_unloaded")
    raised = equilibrium(m113, "as_run_unloaded", drive(m113, constant(h), 5.0))
    np.testing.assert_allclose(raised[:6] - level[:6], h, atol=1e-9)
    assert raised[6] == pytest.approx(level[6], abs=1e-10)
    inclined = equilibrium(m113, "as_run_unloaded", drive(m113, plane, 0.0, parameters="as_run_unloaded"))
    places = np.array(list(m113.positions(m113.parameter_values("as_run_unloaded")).values()))
    np.testing.assert_allclose(inclined[:5] - level[:5], h + s * places, atol=1e-9)
    assert inclined[5] - level[5] == pytest.approx(h, abs=1e-9)
    assert inclined[6] - level[6] == pytest.approx(-s, abs=1e-9)  # pitch is positive nose down


def test_a_run_that_starts_on_a_road_starts_in_its_equilibrium(m113):
    road = table([0, 50], [0.3, 0.3])
    solution = simulate(m113, (0, 1), step=1e-3, inputs=drive(m113, road, 5.0, start=10.0))
    assert np.abs(solution["heave"] - solution["heave"][0]).max() < 1e-10
    assert solution["heave"][0] > -0.1


def test_a_slow_long_wave_carries_the_vehicle(m113):
    """At 1 m/s over waves of 100 m the hull follows the road: its frequency is a fiftieth of the hull's."""
    inputs = drive(m113, sine(0.2, 100.0), 1.0, parameters="as_run_unloaded")
    solution = simulate(m113, (0, 100), step=2e-3, parameters="as_run_unloaded", inputs=inputs, every=50)
    level = equilibrium(m113, "as_run_unloaded")[5]
    road = 0.2 * np.sin(2 * np.pi * solution.t / 100)
    assert np.abs(solution["heave"] - level - road).max() < 0.01


def test_scipy_drives_over_a_random_road_as_we_do(m113):
    """x' = A x + B [u, 1] by DOP853 of SciPy, the road read at start + position + v t, against our rk4."""
    road, v, chosen = random_road("E", seed=6, length=40.0, shortest=0.5, fade=3.0), 6.0, "as_run_unloaded"
    inputs = drive(m113, road, v, parameters=chosen, start=-2.0)
    solution = simulate(m113, (0, 1.5), step=2e-4, parameters=chosen, inputs=inputs, every=50)
    p = m113.parameter_values(chosen)
    n, places = len(m113.tables.inputs), np.array(list(m113.positions(p).values()))
    A, B = linear_matrices(m113, chosen)

    def rhs(t, x):
        return A @ x + B[:, :5] @ road(-2.0 + places + v * t) + B[:, n]

    grid = {"t_eval": solution.t[solution.t <= 1.5], "max_step": 0.02}
    x0 = equilibrium(m113, chosen)
    reference = solve_ivp(rhs, (0, 1.5), x0, method="DOP853", rtol=1e-8, atol=1e-10, **grid)
    for name, k in (("q_1", 0), ("q_5", 4), ("heave", 5), ("pitch", 6)):
        assert np.ptp(solution[name]) > 0.005
        np.testing.assert_allclose(solution[name], reference.y[k], atol=1e-7)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: random_road("I", seed=1), "unknown road class 'I'"),
        (lambda: random_road(-1.0, seed=1), "roughness is -1.0, expected Gd"),
        (lambda: random_road("A", seed=-1), "seed is -1, expected a whole number"),
        (lambda: random_road("A", seed=0.5), "seed is 0.5, expected a whole number"),
        (lambda: random_road("A", seed=1, length=0.0), "length is 0.0, expected a length greater than 0"),
        (lambda: random_road("A", seed=1, longest=0.1), "longest is 0.1, expected a wavelength greater"),
        (lambda: random_road("A", seed=1, fade=300.0), "fade is 300.0, expected a distance from 0"),
        (lambda: random_road("A", seed=1, length=5.0, shortest=10.0), "a road of 5 m has no wave from 10"),
        (lambda: random_road("A", seed=1, waviness=np.nan), "waviness is nan"),
        (lambda: random_road("A", seed=1, waviness=1e300), "waviness is 1e\\+300, expected an exponent from 0 to 10"),
        (lambda: random_road("A", seed=1, length=1e12), "that is more than 10000000 samples"),
        (lambda: roads_at(sine(1.0, 1e-4), {"z": 0.0}, table([0, 9], [1, 40]), 0, (0, 9)), "the road is too fine"),
        (lambda: ramp(1.0, 0.0), "length is 0.0, expected a length greater than 0"),
        (lambda: sine(1.0, -2.0), "wavelength is -2.0, expected a length greater than 0"),
        (lambda: pothole(0.1, 1.0, edge=0.6), "edge is 0.6, expected a length from 0 to half"),
        (lambda: roads_at(ramp(1, 1), {"z": 0.0}, table([0, 1], [1, 2])), "needs the span of the run"),
        (lambda: roads_at(ramp(1, 1), {"z": 0.0}, sine(1, 1), 0, (0, 1)), "a table of straight lines"),
        (lambda: roads_at(ramp(1, 1), {"z": 0.0}, np.inf), "speed is inf"),
        (lambda: drive(load("m113"), ramp(1, 1), 1.0, positions={"z_6": 0}), "unknown input 'z_6'; did you mean"),
        (lambda: drive(load("chain"), ramp(1, 1), 1.0), "no input has a position on the road"),
    ],
)
def test_wrong_roads_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
