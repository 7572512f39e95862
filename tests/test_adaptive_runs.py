"""How a run ends, what it saves, limits, slices, and that nothing is compiled twice."""

import json
from pathlib import Path

import numpy as np
import pytest
from adaptive_runs import ADAPTIVE, circle, run
from commands import command
from numba import njit
from runs import exploding, problem, rooted

from benchmarks.problems.orbits import ARENSTORF_START, arenstorf
from qddot.runner.methods import find_method
from qddot.runner.options import Options
from qddot.runner.problem import Status


@njit
def growing(t, x, u, c, dx):
    dx[0] = 1.0
    dx[1] = 50.0 * x[1]


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_singularity_ends_the_run_where_it_is(method):
    trajectory = run(exploding, (0, 2), (1, 1), method)
    assert trajectory.status in (Status.STEP_UNDERFLOW, Status.NON_FINITE)
    assert trajectory.failed_at == pytest.approx(1.0, abs=2e-2)
    assert trajectory.failed_state == 1
    assert trajectory.t[-1] == trajectory.failed_at
    assert np.isfinite(trajectory.states).all()


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_state_that_is_no_number_ends_the_run(method):
    trajectory = run(rooted, (0, 2), (1, 0), method, rtol=1e-6)
    assert trajectory.status == Status.NON_FINITE
    assert trajectory.failed_at == pytest.approx(1.0, abs=1e-3)
    assert trajectory.failed_state == 1


def test_a_slope_that_is_no_number_at_the_start():
    trajectory = run(rooted, (0, 2), (-1, 0))
    assert trajectory.status == Status.NON_FINITE
    assert (trajectory.failed_at, trajectory.failed_state) == (0.0, 1)
    np.testing.assert_array_equal(trajectory.t, [0.0])


def test_divergence_has_a_limit():
    trajectory = run(growing, (0, 10), (0, 1), divergence_limit=1e6, refine=1)
    assert trajectory.status == Status.NON_FINITE
    assert trajectory.failed_state == 1
    assert trajectory.failed_at == pytest.approx(np.log(1e6) / 50, rel=1e-2)
    assert np.abs(trajectory.states).max() <= 1e6


@pytest.mark.parametrize("most", [1, 7])
def test_max_steps(most):
    trajectory = run(circle, (0, 100), (1, 0), max_steps=most, refine=1)
    assert trajectory.status == Status.TOO_MANY_STEPS
    assert trajectory.statistics.steps == most
    assert len(trajectory.t) == most + 1


def test_as_many_steps_as_are_needed_are_enough():
    needed = run(circle, (0, 10), (1, 0)).statistics.steps
    assert run(circle, (0, 10), (1, 0), max_steps=needed).status == Status.FINISHED
    assert run(circle, (0, 10), (1, 0), max_steps=needed - 1).status == Status.TOO_MANY_STEPS


def test_first_step_and_max_step_are_taken():
    trajectory = run(circle, (0, 5), (1, 0), first_step=0.011, max_step=0.02, refine=1)
    steps = np.diff(trajectory.t)
    assert steps[0] == pytest.approx(0.011)
    assert steps.max() <= 0.02 * 1.1


def test_a_time_limit_keeps_what_was_computed():
    trajectory = run(circle, (0, 1e9), (1, 0), "ode23", rtol=1e-9, atol=1e-9, time_limit=0.2, output_times=[0.5])
    assert trajectory.status == Status.TIME_LIMIT
    assert trajectory.statistics.wall_time < 2.0
    assert trajectory.t[1] == 0.5
    assert trajectory.t[-1] > 1.0
    np.testing.assert_allclose(trajectory.states[1], (np.cos(0.5), np.sin(0.5)), atol=1e-8)
    assert np.hypot(*trajectory.states[-1]) == pytest.approx(1, abs=1e-2)


def test_an_interrupt_keeps_what_was_computed():
    def interrupt(fraction):
        raise KeyboardInterrupt

    trajectory = run(circle, (0, 1e6), (1, 0), rtol=1e-9, atol=1e-9, progress=interrupt, output_times=[0.5])
    assert trajectory.status == Status.INTERRUPTED
    assert trajectory.t[-1] > 0.5


def test_progress_rises_to_one():
    fractions = []
    run(circle, (0, 2e4), (1, 0), rtol=1e-9, atol=1e-9, progress=fractions.append, output_times=[1.0])
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def test_slices_and_growth_leave_no_trace():
    """More points than there is room for at first, in several slices; the end of each slice is no seam."""
    long = run(circle, (0, 4000), (1, 0), rtol=1e-6, atol=1e-6, refine=2)
    assert len(long.t) == 2 * long.statistics.steps + 1 > 50_000
    assert (np.diff(long.t) > 0).all()
    assert np.abs(np.hypot(*long.states.T) - 1).max() < 0.1
    short = run(circle, (0, 4000), (1, 0), rtol=1e-6, atol=1e-6, output_times=long.t[::2])
    np.testing.assert_array_equal(short.states, long.states[::2])


def test_the_ends_are_saved_whatever_is_wanted():
    trajectory = run(circle, (0, 1), (1, 0), output_times=[0.25])
    np.testing.assert_array_equal(trajectory.t, [0, 0.25, 1])
    with pytest.raises(ValueError, match=r"output time 1\.5 is outside"):
        run(circle, (0, 1), (1, 0), output_times=[0.25, 1.5])


def test_a_span_that_does_not_rise_is_refused():
    for span in ((1, 0), (1, 1)):
        with pytest.raises(ValueError, match="expected a start before the end"):
            run(circle, span, (1, 0))


def test_a_method_without_a_pair_cannot_adapt():
    method = find_method("ode45")
    with pytest.raises(ValueError, match="no embedded pair"):
        method.integrate(problem(circle, 1, (1, 0)), find_method("rk4"), Options())


@pytest.mark.parametrize("n", [1, 15, 16, 17, 40])
def test_any_number_of_states(n):
    """Uncoupled decays of many rates, over the edges of the workspace's blocks."""
    trajectory = run(decays, (0, 1), np.ones(n), "dop853", rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(trajectory.states[-1], np.exp(-0.1 * np.arange(1, n + 1)), rtol=1e-8)


@njit
def decays(t, x, u, c, dx):
    for i in range(len(x)):
        dx[i] = -0.1 * (i + 1) * x[i]


def test_runs_are_repeatable_to_the_bit():
    first = run(arenstorf, (0, 3), ARENSTORF_START, "dop853", rtol=1e-9)
    again = run(arenstorf, (0, 3), ARENSTORF_START, "dop853", rtol=1e-9)
    np.testing.assert_array_equal(first.states, again.states)


def test_a_second_process_compiles_nothing():
    """The loop of all adaptive methods comes from the cache that this process filled."""
    run(circle, (0, 1), (1, 0))
    script = (
        f"import json, sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); from adaptive_runs import circle, run;"
        "from qddot.runner.explicit.adaptive import _compiled_loop as loop;"
        "[run(circle, (0, 1), (1, 0), method) for method in ('ode45', 'dop853')];"
        "stats = loop().function.stats;"
        "print(json.dumps([sum(stats.cache_hits.values()), sum(stats.cache_misses.values())]))"
    )
    result = command(code=script)
    assert json.loads(result.stdout) == [1, 0], result.stderr
