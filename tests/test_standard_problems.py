"""The integrators on problems that nobody here invented, and the problems themselves against independent tools."""

from dataclasses import replace

import heyoka as hy
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from benchmarks.problems import NON_STIFF, PROBLEMS, STIFF
from benchmarks.problems.orbits import MOON
from benchmarks.problems.pollution import MADE
from qddot.runner.problem import Status

# Significant correct digits at rtol 1e-6 and 1e-9. The orbits amplify errors: by 1e3 (Pleiades), 1e4 (Arenstorf).
LEAST_DIGITS = {
    "DETEST A5": (3.8, 6.8),
    "DETEST B1": (4.0, 7.0),
    "DETEST B5": (4.5, 7.5),
    "DETEST C4": (5.0, 8.0),
    "DETEST C5": (4.5, 7.5),
    "DETEST D1": (3.5, 6.5),
    "DETEST D5": (3.0, 6.0),
    "DETEST E2": (3.5, 6.5),
    "Pleiades": (2.8, 5.8),
    "Arenstorf orbit": (1.2, 4.5),
}
STIFF_DIGITS = {
    "ROBER": (5.0, 7.0),
    "HIRES": (4.5, 7.0),
    "OREGO": (3.5, 6.5),
    "Van der Pol 1e3": (4.5, 7.0),
    "Van der Pol 1e6": (4.5, 7.0),
    "Pollution": (5.5, 8.0),
    "Transistor amplifier": (5.5, 6.8),
}


def solved(name, method, rtol):
    trajectory = PROBLEMS[name].solve(method, rtol)
    assert trajectory.status == Status.FINISHED
    return PROBLEMS[name].significant_digits(trajectory.states[-1])


@pytest.mark.parametrize("name", LEAST_DIGITS)
@pytest.mark.parametrize("method", ["ode23", "ode45", "tsit5", "dop853", "vern7"])
def test_non_stiff_methods_reach_the_published_end_points(method, name):
    loose, tight = LEAST_DIGITS[name]
    assert solved(name, method, 1e-6) >= loose
    assert solved(name, method, 1e-9) >= tight


@pytest.mark.parametrize("name", STIFF_DIGITS)
@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
def test_stiff_methods_reach_the_published_end_points(method, name):
    """The last of them is a differential-algebraic equation."""
    loose, tight = STIFF_DIGITS[name]
    assert solved(name, method, 1e-6) >= loose
    assert solved(name, method, 1e-9) >= tight


def test_e5_keeps_three_digits_over_nineteen_decades_of_decay():
    """Rounding errors of x_2 = x_3 + x_4 = 1e-10 at t = 1e3 limit every code in double precision at the end, 1e-22."""
    assert solved("E5", "ode15s", 1e-6) >= 2.5
    assert solved("E5", "ode15s", 1e-9) >= 2.5


def test_ring_modulator_survives_its_parasitic_capacities():
    """Both methods follow oscillations at 3e7 rad/s for 1 ms."""
    assert solved("Ring modulator", "rodas5p", 1e-4) >= 1.5


@pytest.mark.parametrize("name", ["DETEST B4", "DETEST C5", "DETEST D3", "Pleiades"])
def test_end_points_agree_with_scipys_dop853(name):
    problem = PROBLEMS[name]
    found = solve_ivp(problem.function(), problem.span, problem.x0, method="DOP853", rtol=3e-14, atol=1e-16)
    assert problem.significant_digits(found.y[:, -1]) >= 10.5


@pytest.mark.parametrize("name", ["ROBER", "HIRES", "Pollution"])
def test_end_points_agree_with_scipys_radau(name):
    problem = PROBLEMS[name]
    settings = {"rtol": 1e-9, "atol": problem.atol(1e-9), "jac": problem.jacobian_function()}
    found = solve_ivp(problem.function(), problem.span, problem.x0, method="Radau", **settings)
    assert problem.significant_digits(found.y[:, -1]) >= 9.0


@pytest.mark.parametrize("name", ["DETEST B2", "DETEST C1", "DETEST C2", "DETEST C3", "DETEST C4"])
def test_end_points_of_linear_problems_are_the_matrix_exponentials(name):
    problem = PROBLEMS[name]
    matrix = np.array([slope(problem, row) for row in np.eye(len(problem.x0))]).T
    assert problem.significant_digits(expm(20.0 * matrix) @ problem.x0) >= 12.0


def test_closed_form_end_points():
    t = 20.0
    closed = {
        "A1": np.exp(-t),
        "A2": 1.0 / np.sqrt(1.0 + t),
        "A3": np.exp(np.sin(t)),
        "A4": 20.0 / (1.0 + 19.0 * np.exp(-t / 4.0)),
    }
    for name, value in closed.items():
        assert PROBLEMS[f"DETEST {name}"].end[0] == pytest.approx(value, rel=1e-12)
    assert PROBLEMS["DETEST E5"].end[1] == pytest.approx((25.0 / 5.0 - 5.0 / 25.0) / 2.0, rel=1e-12)


def test_arenstorf_orbit_is_closed_by_heyokas_taylor_method():
    """An integrator of another kind, exact to machine precision in each step."""
    x, y, v, w = hy.make_vars("x", "y", "v", "w")
    d1 = (1.0 - MOON) * ((x + MOON) ** 2 + y**2) ** -1.5
    d2 = MOON * ((x - 1.0 + MOON) ** 2 + y**2) ** -1.5
    orbit = PROBLEMS["Arenstorf orbit"]
    equations = [
        (x, v),
        (y, w),
        (v, x + 2.0 * w - d1 * (x + MOON) - d2 * (x - 1.0 + MOON)),
        (w, y - 2.0 * v - (d1 + d2) * y),
    ]
    taylor = hy.taylor_adaptive(equations, list(orbit.x0))
    taylor.propagate_until(9.0)
    between = orbit.solve("dop853", 1e-12, output_times=[9.0]).states[1]
    assert between == pytest.approx(taylor.state, abs=1e-8)
    taylor.propagate_until(orbit.span[1])
    assert orbit.significant_digits(taylor.state) >= 9.0


def test_e5_conserves_what_its_third_equation_says():
    """What the end point was computed for: x_2 = x_3 + x_4, and x_2' = -1.13e9 x_2^2 once x_1 and x_4 are gone."""
    problem = PROBLEMS["E5"]
    assert problem.end[1] == problem.end[2] + problem.end[3]
    found = problem.solve("ode15s", 1e-9, output_times=[0.0, 1e12, 1e13])
    middle = found.states[1, 1:3].mean()
    assert 1.0 / (1.0 / middle + 1.13e9 * 9e12) == pytest.approx(problem.end[1], rel=1e-3)


@pytest.mark.parametrize("problem", [p for p in STIFF if p.jacobian], ids=lambda problem: problem.name)
def test_jacobians_are_the_derivatives_of_the_right_hand_sides(problem):
    """By complex steps, exact to rounding, at the start, the end and between; in plain Python, not compiled."""
    n, u, c = len(problem.x0), np.zeros(1), np.array(problem.constants)
    for part in (0.0, 0.3, 1.0):
        x = (1.0 - part) * np.array(problem.x0) + part * np.array(problem.end)
        t = part * problem.span[1]
        J, expected = np.empty((n, n)), np.empty((n, n))
        problem.jacobian.py_func(t, x, u, c, J)
        for j in range(n):
            dx = np.empty(n, dtype=complex)
            problem.rhs.py_func(t, x + 1e-60j * np.eye(n)[j], u, c, dx)
            expected[:, j] = dx.imag / 1e-60
        np.testing.assert_allclose(J, expected, rtol=1e-10, atol=1e-13 * np.abs(expected).max())


def test_every_problem_is_complete_and_no_two_share_a_name():
    assert len(PROBLEMS) == len(NON_STIFF) + len(STIFF) == 25 + 2 + 9
    for problem in PROBLEMS.values():
        n = len(problem.x0)
        assert len(problem.end) == n
        assert problem.atol(1e-6).shape == (n,)
        assert problem.citation
        assert problem.mass_matrix is None or problem.mass_matrix.shape == (n, n)
        assert np.isfinite(slope(problem, np.array(problem.x0))).all()


def test_pollution_conserves_nitrogen_and_sulphur():
    """A typing error in the table of reactions would not."""
    nitrogen = {1: 1, 2: 1, 13: 1, 15: 1, 19: 1, 20: 2}  # NO2, NO, PAN, HNO3, NO3, N2O5
    sulphur = {17: 1, 18: 1}  # SO2, SO4
    for atoms in (nitrogen, sulphur):
        assert not (MADE @ [atoms.get(species, 0) for species in range(1, 21)]).any()


def slope(problem, x):
    dx = np.empty(len(x))
    problem.rhs.py_func(0.0, x, np.zeros(1), np.array(problem.constants), dx)
    return dx


def test_ode15s_goes_on_where_loose_tolerances_leave_algebraic_states_far_off():
    """Newton's method was too slow from there, however short the step: one of sixty tolerances beside 1e-2 failed."""
    amplifier = PROBLEMS["Transistor amplifier"]
    for rtol in 10.0 ** -np.linspace(2.0, 3.0, 201):
        found = amplifier.solve("ode15s", float(rtol))
        assert found.status == Status.FINISHED, rtol
        assert amplifier.significant_digits(found.states[-1]) > -np.log10(rtol) - 1.0


@pytest.mark.parametrize("scale", [1.0, 1e-2, 1e-4])
@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7])
def test_ode15s_passes_zero_crossings_of_algebraic_states(rtol, scale):
    """With absolute tolerances far below the relative one an algebraic state that crosses zero once stopped the run."""
    problem = replace(PROBLEMS["Transistor amplifier"], scale=scale)
    trajectory = problem.solve("ode15s", rtol)
    assert trajectory.status == Status.FINISHED
    error = np.abs(trajectory.states[-1] - problem.end) / np.maximum(np.abs(problem.end), scale)
    assert error.max() < 5 * rtol
