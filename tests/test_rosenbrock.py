from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from runs import problem, run

from benchmarks.problems import PROBLEMS
from qddot.runner.stiff.tableau_rosenbrock import RODAS5P
from qddot.runner.tableaux.butcher import rooted_trees


@njit
def breathing(t, x, u, c, dx):
    """x' = x cos t + (x^2 - exp(2 sin t)): solution exp(sin t), nonlinear and driven."""
    dx[0] = x[0] * np.cos(t) - (x[0] ** 2 - np.exp(2.0 * np.sin(t)))


@njit
def breathing_jacobian(t, x, u, c, J):
    J[0, 0] = np.cos(t) - 2.0 * x[0]


@njit
def ringing(t, x, u, c, dx):
    """Two oscillators, 1 rad/s and c rad/s, hardly damped."""
    dx[0], dx[1] = x[2], x[3]
    dx[2] = -x[0] - 1e-3 * x[2]
    dx[3] = -(c[0] ** 2) * (x[1] - x[0]) - 1e-3 * c[0] * x[3]


BREATHING = problem(breathing, 6.0, [1.0], breathing_jacobian)


def test_order_of_the_method_is_five_and_of_its_dense_output_four():
    errors, inner = [], []
    for step in (0.1, 0.05):
        options = {"rtol": 0.99, "atol": 1e9, "first_step": step, "max_step": step}
        at_steps = run("rodas5p", BREATHING, **options)
        assert at_steps.statistics.steps == round(6.0 / step)
        errors.append(np.abs(at_steps.states[:, 0] - np.exp(np.sin(at_steps.t))).max())
        times = (np.arange(round(6.0 / step)) + 0.37) * step
        between = run("rodas5p", BREATHING, output_times=times, **options)
        inner.append(np.abs(between.states[:, 0] - np.exp(np.sin(between.t))).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5, rel=0.1)
    assert np.log2(inner[0] / inner[1]) == pytest.approx(5, rel=0.25)  # local error of an output of order 4


def test_tableau_is_l_stable_and_so_is_its_estimate():
    gammas = RODAS5P.beta - RODAS5P.alpha
    at_infinity = np.linalg.solve(RODAS5P.beta, np.ones(8))
    assert 1.0 - RODAS5P.m @ gammas @ at_infinity == pytest.approx(0.0, abs=1e-12)
    assert 1.0 - (RODAS5P.m - RODAS5P.error) @ gammas @ at_infinity == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("y", [0.1, 1.0, 3.0, 10.0, 100.0])
def test_tableau_damps_no_oscillation_up_and_is_exact_to_order_five(y):
    gammas = RODAS5P.beta - RODAS5P.alpha

    def amplification(z):
        return 1.0 + z * (RODAS5P.m @ gammas @ np.linalg.solve(np.eye(8) - z * RODAS5P.beta, np.ones(8)))

    assert abs(amplification(1j * y)) <= 1.0 + 1e-12
    assert abs(amplification(0.05j) - np.exp(0.05j)) < 1e-3 * 0.05**5


@pytest.mark.parametrize("name", ["c", "d", "m", "error", "dense"])
def test_misprinted_coefficient_is_noticed(name):
    wrong = np.array(getattr(RODAS5P, name))
    wrong[(..., 2)] += 1e-6
    given = {field: getattr(RODAS5P, field) for field in ("gamma", "a", "C", "c", "d", "m", "error", "dense")}
    with pytest.raises(ValueError, match="tableau wrong"):
        type(RODAS5P)(name="wrong", order=5, citation="", **{**given, name: wrong})


def test_misprint_in_any_entry_of_the_matrices_is_noticed():
    given = {field: getattr(RODAS5P, field) for field in ("gamma", "a", "C", "c", "d", "m", "error", "dense")}
    for name in ("a", "C"):
        for i, j in zip(*np.tril_indices(8, -1), strict=True):
            wrong = given[name].copy()
            wrong[i, j] += 1e-6
            with pytest.raises(ValueError, match="tableau wrong"):
                type(RODAS5P)(name="wrong", order=5, citation="", **{**given, name: wrong})


def test_there_are_seventeen_conditions_up_to_order_five():
    assert [len(rooted_trees(p)) for p in range(1, 6)] == [1, 1, 2, 4, 9]


def test_error_follows_the_tolerance():
    tolerances = 10.0 ** -np.arange(4, 11)
    errors = []
    for tolerance in tolerances:
        found = run("rodas5p", BREATHING, rtol=tolerance, atol=tolerance)
        errors.append(np.abs(found.states[:, 0] - np.exp(np.sin(found.t))).max())
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.15)
    assert (np.array(errors) < 10 * tolerances).all()


def test_lightly_damped_fast_mode_takes_fewer_steps_than_with_backward_differences():
    stiff = problem(ringing, 20.0, [1.0, 1.0, 0.0, 0.0], c=[200.0])
    one_step, differences = (run(method, stiff, rtol=1e-5, atol=1e-7) for method in ("rodas5p", "ode15s"))
    assert one_step.statistics.steps < 0.5 * differences.statistics.steps
    exact = np.exp(-5e-4 * one_step.t) * np.cos(one_step.t)
    assert np.abs(one_step.states[:, 0] - exact).max() < 2e-3


@pytest.mark.parametrize("name", ["matlab", "standard", "pi"])
def test_every_controller_keeps_the_tolerance(name):
    found = run("rodas5p", BREATHING, rtol=1e-6, atol=1e-6, controller=name)
    assert np.abs(found.states[:, 0] - np.exp(np.sin(found.t))).max() < 2e-5


def test_differences_in_place_of_a_jacobian_kernel_give_the_same_answer():
    exact = PROBLEMS["Van der Pol 1e3"].system()
    runs = [run("rodas5p", each, rtol=1e-6, atol=1e-10) for each in (exact, replace(exact, jacobian=None))]
    np.testing.assert_allclose(runs[0].states[-1], runs[1].states[-1], rtol=1e-4)
