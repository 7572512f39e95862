"""Embedded pairs: coefficients against SciPy's, order of the step, of its estimate and of dense output."""

from dataclasses import replace

import numpy as np
import pytest
from adaptive_runs import ADAPTIVE, circle, run, slope
from scipy.integrate import DOP853, RK23, RK45

from qddot.runner.methods import find_method
from qddot.runner.tableaux.pages.ode45 import METHOD as DORMAND_PRINCE_54

#: Order of the solution between steps; of Verner's interpolant see its page.
DENSE = {"ode23": 3, "ode45": 4, "tsit5": 4, "dop853": 7, "vern7": 7}
#: Steps short enough for the asymptotic order and long enough for the error to exceed rounding.
STEPS = {"ode23": (80, 160), "ode45": (40, 80), "tsit5": (40, 80), "dop853": (9, 18), "vern7": (10, 20)}
LOOSE = {"rtol": 0.5, "atol": 1e12}


def circle_at(t):
    return np.stack([np.cos(t), np.sin(t)], axis=-1)


@pytest.mark.parametrize(("name", "scheme"), [("ode23", RK23), ("ode45", RK45), ("dop853", DOP853)])
def test_coefficients_are_those_of_scipy(name, scheme):
    pair = find_method(name).pair
    s = scheme.n_stages
    np.testing.assert_allclose(pair.tableau.A[:s, : scheme.A.shape[1]][:, :s], scheme.A[:s, :s], atol=1e-15)
    np.testing.assert_allclose(pair.tableau.b[:s], scheme.B, atol=1e-15)
    np.testing.assert_allclose(pair.tableau.c[:s], scheme.C[:s], atol=1e-15)


def test_error_weights_are_those_of_scipy():
    np.testing.assert_allclose(find_method("ode23").pair.error_weights[0], -RK23.E, atol=1e-15)
    np.testing.assert_allclose(find_method("ode45").pair.error_weights[0], -RK45.E, atol=1e-15)
    fifth, third = find_method("dop853").pair.error_weights
    np.testing.assert_allclose(fifth, DOP853.E5[:-1], atol=1e-14)
    np.testing.assert_allclose(third, DOP853.E3[:-1], atol=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"second_hat": [0.5, 0.5, 0, 0, 0, 0, 0], "second_order": 3}, "order 3"),
        ({"dense": find_method("dop853").pair.dense}, "other stages"),
        ({"tableau": replace(DORMAND_PRINCE_54.tableau, b_hat=None)}, "missing"),
    ],
)
def test_a_pair_whose_parts_do_not_fit_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(DORMAND_PRINCE_54, **change)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_order_of_the_step(method):
    span = 2.0
    counts = np.unique(np.geomspace(*STEPS[method], 5).round())
    errors = []
    for count in counts:
        h = span / count
        trajectory = run(circle, (0, span), (1, 0), method, first_step=h, max_step=h, refine=1, **LOOSE)
        assert trajectory.statistics.steps == count
        errors.append(np.abs(trajectory.states[-1] - circle_at(span)).max())
    order = find_method(method).order
    assert slope(errors, span / counts) == pytest.approx(order, rel=0.1)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_order_of_dense_output(method):
    """The error between the ends of one step from the exact state is O(h^(order + 1))."""
    steps = 2.0 / np.geomspace(*STEPS[method], 5)
    theta = np.array([0.21, 0.46, 0.77])
    errors = []
    for h in steps:
        trajectory = run(circle, (0, h), (1, 0), method, first_step=h, max_step=h, output_times=theta * h, **LOOSE)
        assert trajectory.statistics.steps == 1
        np.testing.assert_array_equal(trajectory.t[1:-1], theta * h)
        errors.append(np.abs(trajectory.states[1:-1] - circle_at(theta * h)).max())
    assert slope(errors, steps) == pytest.approx(DENSE[method] + 1, rel=0.1)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_dense_output_changes_no_step(method):
    times = np.linspace(0, 7, 113)
    alone = run(circle, (0, 7), (1, 0), method, rtol=1e-7, atol=1e-9, refine=1)
    dense = run(circle, (0, 7), (1, 0), method, rtol=1e-7, atol=1e-9, output_times=times)
    np.testing.assert_array_equal(dense.t, times)
    assert dense.statistics.steps == alone.statistics.steps
    np.testing.assert_array_equal(dense.states[-1], alone.states[-1])
    assert np.abs(dense.states - circle_at(times)).max() < 30 * np.abs(alone.states - circle_at(alone.t)).max()


@pytest.mark.parametrize("method", ADAPTIVE)
def test_wanted_times_that_are_step_ends_are_the_steps(method):
    alone = run(circle, (0, 7), (1, 0), method, refine=1)
    again = run(circle, (0, 7), (1, 0), method, output_times=alone.t)
    np.testing.assert_array_equal(again.t, alone.t)
    np.testing.assert_array_equal(again.states, alone.states)
