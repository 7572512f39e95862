"""Step control: the factors as published, and the same in lanes as for a run alone."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from numba import njit
from numba.core.dispatcher import Dispatcher

from qddot.runner.frame import step_control
from qddot.runner.frame.step_control import Factors, control_for
from qddot.runner.machine.compiled import ARITHMETIC
from qddot.runner.methods import find_method

#: The compiled functions, which are parts of loops, as Python can call them.
CONTROL = SimpleNamespace(
    **{
        name: njit(**ARITHMETIC)(each.py_func)
        for name, each in vars(step_control).items()
        if isinstance(each, Dispatcher) and each.py_func.__module__ == step_control.__name__
    }
)
after_failure, after_success, of_two_estimates = CONTROL.after_failure, CONTROL.after_success, CONTROL.of_two_estimates
ERRORS = some.floats(1e-12, 1e12)


def factors(name: str, order: int) -> Factors:
    control = control_for(name, order, 1e-6, 1e100)
    return Factors(int(control["kind"]), *(float(control[field]) for field in Factors._fields[1:]))


@settings(deadline=None)
@given(ERRORS, ERRORS)
def test_factors_of_hairers_dopri5(error, last):
    """HNW II.4 and DOPRI5: fac = err^(1/5 - 0.75 beta) / last^beta, the step h / min(5, max(1/10, fac / 0.9))."""
    pi, beta = factors("pi", 5), 0.04
    published = 1 / min(5, max(1 / 10, error ** (0.2 - 0.75 * beta) / max(last, 1e-4) ** beta / 0.9))
    assert after_success(pi, error, last, False) == pytest.approx(published, rel=1e-13)
    published = 1 / min(5, error ** (0.2 - 0.75 * beta) / 0.9)
    assert after_failure(pi, error, 1) == pytest.approx(published, rel=1e-13)


@settings(deadline=None)
@given(ERRORS)
def test_factors_of_matlabs_ode45(error):
    """ode45: absh / (1.25 err^(1/5)), at most 5 times; after a failure at least 0.1 times, then half."""
    matlab = factors("matlab", find_method("ode45").pair.error_order)
    assert after_success(matlab, error, 1.0, False) == pytest.approx(min(5, 0.8 * error**-0.2), rel=1e-13)
    assert after_success(matlab, error, 1.0, True) == 1.0
    assert after_failure(matlab, error, 1) == pytest.approx(max(0.1, 0.8 * error**-0.2), rel=1e-13)
    assert after_failure(matlab, error, 2) == 0.5


@pytest.mark.parametrize("name", ["standard", "pi"])
def test_a_step_that_failed_does_not_grow_and_an_error_of_zero_gives_the_longest(name):
    dop853 = factors(name, find_method("dop853").pair.error_order)
    assert after_success(dop853, 1e-9, 1e-9, True) == 1.0
    assert after_success(dop853, 0.0, 0.0, False) == 6.0
    assert after_failure(dop853, math.inf, 1) == pytest.approx(1 / 3)


@settings(deadline=None)
@given(ERRORS, ERRORS)
def test_the_two_estimates_of_dop853(error, second):
    assert of_two_estimates(error, second) == pytest.approx(error**2 / math.hypot(error, 0.1 * second), rel=1e-14)


def test_two_estimates_of_nothing_or_of_no_number():
    assert of_two_estimates(0.0, 0.0) == 0.0
    assert of_two_estimates(math.inf, 1.0) == math.inf


def test_first_steps():
    """HNW II.4: d0 = 1, d1 = 2, d2 = 3 at order 5 (the step of a method of order 4 with an estimate of order 5)."""
    trial = CONTROL.trial_step(1.0, 2.0)
    assert trial == 0.01 / 2.0
    assert CONTROL.settled_step(trial, 3.0, 5.0) == pytest.approx(min(100 * trial, (0.01 / 3) ** 0.2))
    assert CONTROL.trial_step(1e-6, 2.0) == 1e-6
    assert CONTROL.matlab_first_step(0.0, 1e-3, 5.0, 7.0) == 7.0
    assert CONTROL.matlab_first_step(10.0, 1e-3, 5.0, 70.0) == pytest.approx(0.8 / (10.0 * 1e-3**0.8))


@pytest.mark.parametrize("name", ["matlab", "standard", "pi"])
def test_tolerances_of_one_run(name):
    largest = name == "matlab"
    expected = max(1e-3 * 5.0, 1e-2) if largest else 1e-3 * 5.0 + 1e-2
    assert CONTROL.tolerance(1e-3, 1e-2, 5.0, largest) == expected
    assert CONTROL.scaled(-3e-2, expected, 5.0, 1e3) == pytest.approx(3e-2 / expected)
    assert CONTROL.scaled(np.nan, expected, 5.0, 1e3) == math.inf
    assert CONTROL.scaled(1e-2, expected, 5.0, 4.0) == math.inf
