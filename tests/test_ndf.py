from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import command
from numba import njit
from published_ode15s import ode15s
from runs import exploding, problem, rooted, run
from scipy.integrate import solve_ivp

from benchmarks.problems import PROBLEMS
from qddot.runner.frame.events import Event, StateCrossing
from qddot.runner.inputs.shapes import pulse_train
from qddot.runner.inputs.signal import stack
from qddot.runner.methods import METHODS
from qddot.runner.problem import Status
from qddot.runner.stiff.ndf_formulas import GAMMA, POWERS, U

#: The paper's eq. (12): one axle of 120 kg on its stiffness, with the suspension's, falling under its weight.
OMEGA2, GRAVITY = (2.15e6 + 6.5e4) / 120.0, 9.81


@njit
def oscillator(t, x, u, c, dx):
    """c: square of the circular frequency, damping, load; driven by the input."""
    dx[0] = x[1]
    dx[1] = u[0] - c[0] * x[0] - c[1] * x[1] - c[2]


@njit
def oscillator_jacobian(t, x, u, c, J):
    J[0, 0], J[0, 1], J[1, 0], J[1, 1] = 0.0, 1.0, -c[0], -c[1]


@njit
def smooth(t, x, u, c, dx):
    """Solution sin t, cos t; nonlinear, mildly stiff."""
    dx[0] = -2.0 * (x[0] - np.sin(t)) + np.cos(t) + (x[1] - np.cos(t)) ** 2
    dx[1] = -5.0 * (x[1] - np.cos(t)) - np.sin(t)


@njit
def ragged(t, x, u, c, dx):
    """A slope that is noise on the scale of rounding: no iteration finds its way."""
    dx[0] = 1e15 * (2.0 + np.sin(1e15 * x[0]))


@njit
def constrained(t, x, u, c, dx):
    """x_1' = -x_1 + x_2, and x_2 from x_2^3 + x_2 = u + x_1."""
    dx[0] = -x[0] + x[1]
    dx[1] = x[1] ** 3 + x[1] - u[0] - x[0]


@njit
def index_two(t, x, u, c, dx):
    """x_1' = x_2, and x_1 = sin t: the algebraic equation does not contain the algebraic state."""
    dx[0] = x[1]
    dx[1] = x[0] - np.sin(t)


@njit
def rootless(t, x, u, c, dx):
    """The algebraic equation exp(x_2) + 1 = 0 has no root."""
    dx[0] = -x[0]
    dx[1] = np.exp(x[1]) + 1.0


AXLE = problem(oscillator, 1.0, [0, 0], oscillator_jacobian, c=[OMEGA2, 0.0, GRAVITY])
SMOOTH = problem(smooth, 10.0, [0, 1])
SINGULAR = np.diag([1.0, 0.0])


def axle_solution(t):
    return -GRAVITY / OMEGA2 * (1.0 - np.cos(np.sqrt(OMEGA2) * t))


def test_axle_of_the_paper_takes_449_points_with_the_published_control():
    found = run("ode15s", AXLE)
    assert found.status is Status.FINISHED
    assert (len(found.t), found.statistics.steps) == (449, 448)
    assert np.abs(found.states[:, 0] - axle_solution(found.t)).max() == pytest.approx(3.9e-5, rel=0.01)


CASES = {
    "axle": (AXLE, lambda t, y: np.array([y[1], -OMEGA2 * y[0] - GRAVITY]), 1e-3, 1e-6),
    "van_der_pol": (
        PROBLEMS["Van der Pol 1e3"].system(),
        lambda t, y: np.array([y[1], 1e3 * (1 - y[0] ** 2) * y[1] - y[0]]),
        1e-4,
        1e-8,
    ),
}


@pytest.mark.parametrize("bdf", [False, True])
@pytest.mark.parametrize("case", CASES)
def test_steps_and_counts_are_those_of_a_second_implementation(case, bdf):
    subject, f, rtol, atol = CASES[case]

    def jacobian(t, y):
        J = np.empty((2, 2))
        subject.jacobian(t, y, np.zeros(1), subject.constants, J)
        return J

    ours = run("ode15s", subject, rtol=rtol, atol=atol, bdf=bdf)
    theirs = ode15s(f, jacobian, 0.0, subject.t1, subject.initial_state, rtol, atol, bdf=bdf)
    np.testing.assert_allclose(ours.t, theirs.t, rtol=1e-8)
    np.testing.assert_allclose(ours.states, theirs.states, rtol=1e-5, atol=1e-9)
    counts = (theirs.failed, theirs.evaluations, theirs.jacobians, theirs.factorizations, theirs.solves)
    s = ours.statistics
    assert (s.failed_attempts, s.evaluations, s.jacobians, s.factorizations, s.linear_solves) == counts


def test_first_steps_with_a_mass_matrix_are_those_of_a_second_implementation():
    mass = np.array([[2.0, 0.0], [1.0, 3.0]])
    subject = replace(AXLE, mass_matrix=mass)
    J = np.array([[0.0, 1.0], [-OMEGA2, 0.0]])
    theirs = ode15s(
        lambda t, y: np.array([y[1], -OMEGA2 * y[0] - GRAVITY]),
        lambda t, y: J,
        0.0,
        1.0,
        np.zeros(2),
        1e-3,
        1e-6,
        mass=mass,
    )
    np.testing.assert_allclose(run("ode15s", subject).t, theirs.t, rtol=1e-7)


@njit
def robertson_with_conservation(t, x, u, c, dx):
    dx[0] = -0.04 * x[0] + 1e4 * x[1] * x[2]
    dx[1] = -dx[0] - 3e7 * x[1] ** 2
    dx[2] = x[0] + x[1] + x[2] - 1.0


@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
def test_conservation_of_mass_in_place_of_a_differential_equation_gives_the_same_answer(method):
    """Hairer, Wanner, Solving ODEs II, section IV.10, gives the state of Robertson's problem at t = 40."""
    dae = problem(robertson_with_conservation, 40.0, [1, 0, 0], mass=np.diag([1.0, 1.0, 0.0]))
    found = run(method, dae, rtol=1e-7, atol=1e-11)
    np.testing.assert_allclose(
        found.states[-1], [0.7158270687193941, 9.185534764557338e-6, 0.2841637457458413], rtol=4e-6
    )


@pytest.mark.parametrize("bdf", [False, True])
@pytest.mark.parametrize("k", [1, 2, 3, 4, 5])
def test_error_falls_with_the_number_of_steps_as_the_highest_order_allows(k, bdf):
    tolerances = (1e-6, 1e-7) if k < 3 else (1e-9, 1e-11)
    runs = [run("ode15s", SMOOTH, rtol=tol, atol=tol, max_order=k, bdf=bdf) for tol in tolerances]
    errors = [np.abs(found.states[:, 0] - np.sin(found.t)).max() for found in runs]
    order = np.log(errors[0] / errors[1]) / np.log(runs[1].statistics.steps / runs[0].statistics.steps)
    assert order == pytest.approx(k, rel=0.1)


def test_coefficients_are_those_of_the_paper():
    np.testing.assert_allclose(U @ U, np.eye(5))
    np.testing.assert_allclose(GAMMA, [1, 3 / 2, 11 / 6, 25 / 12, 137 / 60])
    # The interpolant's basis vanishes at the end of the step; at its start the first is -1, the others vanish.
    np.testing.assert_allclose(POWERS.sum(axis=1), [1, 0, 0, 0, 0], atol=1e-15)


def test_costs_no_more_than_scipys_bdf_for_the_same_accuracy():
    hires = PROBLEMS["HIRES"]
    subject = hires.system()
    ours = run("ode15s", subject, rtol=1e-6, atol=1e-10)
    theirs = solve_ivp(hires.function(), hires.span, subject.initial_state, "BDF", rtol=1e-6, atol=1e-10)
    assert hires.significant_digits(ours.states[-1]) > hires.significant_digits(theirs.y[:, -1]) - 0.5
    assert ours.statistics.evaluations < 1.2 * (theirs.nfev + 8 * theirs.njev)
    assert ours.statistics.factorizations < 1.2 * theirs.nlu


@pytest.mark.parametrize(("name", "end"), [("ROBER", 40.0), ("Van der Pol 1e3", 2000.0)])
def test_differences_in_place_of_a_jacobian_kernel_give_the_same_answer(name, end):
    exact = replace(PROBLEMS[name].system(), t1=end)
    runs = [run("ode15s", each, rtol=1e-6, atol=1e-10) for each in (exact, replace(exact, jacobian=None))]
    np.testing.assert_allclose(runs[0].states[-1], runs[1].states[-1], rtol=1e-4)
    assert runs[1].statistics.steps == pytest.approx(runs[0].statistics.steps, rel=0.1)


@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
class TestBoth:
    """What holds for every stiff method."""

    def test_requested_times_do_not_change_the_steps(self, method):
        times = np.linspace(0.3, 9.7, 400)
        free = run(method, SMOOTH, rtol=1e-6, atol=1e-8)
        asked = run(method, SMOOTH, rtol=1e-6, atol=1e-8, output_times=times)
        np.testing.assert_array_equal(asked.t, [0.0, *times, 10.0])
        assert asked.statistics.steps == free.statistics.steps
        np.testing.assert_array_equal(asked.states[-1], free.states[-1])
        np.testing.assert_allclose(asked.states[:, 0], np.sin(asked.t), atol=3e-6)

    def test_refinement_puts_points_between_the_steps(self, method):
        free, refined = run(method, SMOOTH, rtol=1e-6), run(method, SMOOTH, rtol=1e-6, refine=4)
        np.testing.assert_array_equal(refined.t[::4], free.t)
        np.testing.assert_allclose(refined.states[:, 0], np.sin(refined.t), atol=3e-5)

    def test_buffers_grow_without_losing_points(self, method):
        refined = run(method, SMOOTH, refine=1000)
        assert len(refined.t) == 1000 * refined.statistics.steps + 1 > 5000
        assert (np.diff(refined.t) > 0).all()

    def test_short_pulse_after_a_long_rest_is_found(self, method):
        pulse = pulse_train(times=[1.0], duration=0.1, peak=50.0)
        trap = problem(oscillator, 10.0, [0, 0], oscillator_jacobian, c=[25.0, 0.0, 0.0], inputs=stack([pulse], [0]))
        found = run(method, trap, rtol=1e-3)
        assert {1.0, 1.1} <= set(found.t)
        assert np.abs(found.states[found.t <= 1.0]).max() == 0.0
        # Convolution of the pulse with sin(5 t)/5.
        s = np.linspace(1.0, 1.1, 2001)
        exact = [np.trapezoid(pulse(s) * np.sin(5.0 * (t - s)) / 5.0, s) for t in found.t]
        late = found.t > 1.1
        assert np.abs(found.states[late, 0] - np.array(exact)[late]).max() < 0.03 * np.abs(exact).max()

    def test_inputs_that_jump_are_seen_from_within_the_step(self, method):
        step = pulse_train("trapezoid", times=[1.0], duration=2.0, peak=1.0, rise=0.0)
        found = run(method, problem(oscillator, 5.0, [0, 0], c=[0.0, 0.0, 0.0], inputs=stack([step], [0])), rtol=1e-8)
        np.testing.assert_allclose(found.states[-1], [2.0 + 2.0 * 2.0, 2.0], rtol=1e-6)

    def test_events_are_located_and_end_the_run_where_they_are_terminal(self, method):
        crossing = StateCrossing(state=0, level=0.5, direction=-1, name="down")
        found = run(method, SMOOTH, rtol=1e-8, atol=1e-10, events=(crossing,))
        np.testing.assert_allclose(found.extras["events"].times("down"), [5 / 6 * np.pi, 17 / 6 * np.pi], rtol=1e-7)
        ended = run(method, SMOOTH, rtol=1e-8, atol=1e-10, events=(replace(crossing, terminal=True),))
        assert ended.status is Status.TERMINATED
        assert ended.t[-1] == pytest.approx(5 / 6 * np.pi, rel=1e-7)
        assert ended.states[-1, 0] == pytest.approx(0.5, abs=1e-9)

    def test_event_functions_see_time_and_inputs(self, method):
        @njit
        def late(t, x, u, c):
            return t - 2.5

        found = run(method, SMOOTH, events=(Event(late, name="late"),))
        assert found.extras["events"].times("late") == pytest.approx([2.5], rel=1e-12)

    def test_blow_up_is_reported_with_time_and_state(self, method):
        found = run(method, problem(exploding, 2.0, [1, 1]), rtol=1e-6, divergence_limit=1e12)
        assert found.status in (Status.NON_FINITE, Status.STEP_UNDERFLOW)
        assert found.failed_state == 1
        assert found.failed_at == pytest.approx(1.0, abs=1e-3)
        assert np.isfinite(found.states).all()

    def test_slope_that_is_no_number_is_reported(self, method):
        found = run(method, problem(rooted, 2.0, [1, 0]))
        assert found.status is Status.NON_FINITE
        assert found.failed_state == 1
        assert found.failed_at == pytest.approx(1.0, abs=1e-6)

    def test_initial_state_without_a_slope_is_reported_at_the_start(self, method):
        found = run(method, problem(rooted, 2.0, [-1, 0]))
        assert (found.status, found.failed_at, found.failed_state) == (Status.NON_FINITE, 0.0, 1)

    def test_steps_are_limited(self, method):
        found = run(method, SMOOTH, max_steps=5)
        assert (found.status, found.statistics.steps, len(found.t)) == (Status.TOO_MANY_STEPS, 5, 6)
        longest = np.diff(run(method, SMOOTH, max_step=0.05).t).max()
        assert longest <= 0.05 * 1.1 * (1 + 1e-12)  # the last step may be stretched

    def test_progress_and_time_limit_act_between_slices(self, method):
        seen = []
        found = run(method, replace(SMOOTH, t1=1e9), max_step=0.1, time_limit=0.3, progress=seen.append)
        assert found.status is Status.TIME_LIMIT
        assert seen == sorted(seen)
        assert 0 < seen[-1] < 1

    def test_inconsistent_algebraic_state_is_corrected(self, method):
        found = run(method, problem(constrained, 5.0, [1, 7], mass=SINGULAR), rtol=1e-6)
        first, algebraic = found.states[0]
        assert first == 1.0
        assert algebraic**3 + algebraic - 1.0 == pytest.approx(0.0, abs=1e-6)
        np.testing.assert_allclose(found.states[:, 1] ** 3 + found.states[:, 1], found.states[:, 0], atol=1e-5)

    def test_algebraic_state_jumps_with_its_input(self, method):
        jump = pulse_train("trapezoid", times=[1.0], duration=1.0, peak=9.0, rise=0.0)
        subject = problem(constrained, 3.0, [0, 0], mass=SINGULAR, inputs=stack([jump], [0]))
        found = run(method, subject, rtol=1e-6)
        before, during = found.t < 1.0, (found.t > 1.0) & (found.t < 2.0)
        assert np.abs(found.states[before, 1]).max() == 0.0
        balance = found.states[during, 1] ** 3 + found.states[during, 1] - found.states[during, 0]
        np.testing.assert_allclose(balance, 9.0, rtol=1e-4)

    def test_higher_index_and_missing_roots_are_refused(self, method):
        with pytest.raises(ValueError, match="index is higher than 1"):
            run(method, problem(index_two, 1.0, [0, 1], mass=SINGULAR))
        with pytest.raises(ValueError, match=r"does not satisfy the algebraic equations at t = 0\.0"):
            run(method, problem(rootless, 1.0, [0, 1], mass=SINGULAR))

    def test_regular_mass_matrix_is_the_same_as_its_inverse(self, method):
        mass = np.array([[2.0, 1.0], [1.0, 3.0]])
        scaled = replace(SMOOTH, mass_matrix=mass)
        inverse = np.linalg.inv(mass)

        def f(t, x):
            dx = np.empty(2)
            smooth(t, x, np.zeros(1), np.zeros(0), dx)
            return inverse @ dx

        exact = solve_ivp(f, (0, 10), [0, 1], "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        np.testing.assert_allclose(run(method, scaled, rtol=1e-8, atol=1e-10).states[-1], exact, atol=1e-6)

    @pytest.mark.parametrize(
        ("change", "options", "message"),
        [
            ({"mass_matrix": np.eye(3)}, {}, r"mass_matrix has shape \(3, 3\), expected \(2, 2\)"),
            ({"mass_matrix": np.array([[1, 0], [0, np.nan]])}, {}, r"mass_matrix\[1, 1\] is nan"),
            ({}, {"atol": [1e-6, 1e-6, 1e-6]}, "atol has 3 entries"),
            ({}, {"output_times": [11.0]}, "output time 11.0 is outside the span from 0.0 to 10.0"),
            ({"t1": 0.0}, {}, "expected a start before the end"),
        ],
    )
    def test_what_makes_no_sense_is_refused_by_name(self, method, change, options, message):
        with pytest.raises(ValueError, match=message):
            run(method, replace(SMOOTH, **change), **options)

    def test_large_systems_go_through_lapack(self, method):
        n, line = 60, diffusing(60)
        found = run(method, line, rtol=1e-6, atol=1e-9)
        decay = 4 * (n + 1.0) ** 2 * np.sin(np.pi / (2 * (n + 1))) ** 2
        np.testing.assert_allclose(found.states[-1], line.initial_state * np.exp(-0.1 * decay), rtol=1e-4)

    def test_second_process_takes_the_loop_from_the_cache_for_small_and_large_systems(self, method):
        run(method, AXLE)
        module = METHODS[method].integrate.__module__
        code = (
            f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
            f"import {module} as module; from test_ndf import AXLE, diffusing, run\n"
            "from qddot.runner.stiff.driver import compiled_loop\n"
            f"run({method!r}, AXLE)\n"
            f"run({method!r}, diffusing(60))\n"
            "stats = compiled_loop(module.run_slice, module.CONTROL).function.stats\n"
            "print(len(stats.cache_hits), sum(stats.cache_misses.values()))\n"
        )
        done = command(code=code)
        assert done.stdout.split() == ["1", "0"], done.stderr


@njit
def diffusion(t, x, u, c, dx):
    n = len(x)
    for i in range(n):
        left = x[i - 1] if i > 0 else 0.0
        right = x[i + 1] if i < n - 1 else 0.0
        dx[i] = c[0] * (left - 2.0 * x[i] + right)


def diffusing(n):
    """The slowest mode of n cells."""
    return problem(diffusion, 0.1, np.sin(np.pi * np.arange(1, n + 1) / (n + 1)), c=[(n + 1.0) ** 2])


def test_newton_failure_is_reported_as_such():
    found = run("ode15s", replace(problem(ragged, 2.0, [0.3]), t0=1.0))
    assert (found.status, found.failed_state) == (Status.NEWTON_FAILURE, 0)
    assert found.failed_at == pytest.approx(1.0, abs=1e-6)
