"""The solution of M a + G' l = f, G a = gamma in compiled code, against exact arithmetic and what physics says."""

import mpmath
import numpy as np
import pytest
from numba import njit

from qddot.runner.machine.constrained import accelerations, blank, derivatives, equations, report, solved
from qddot.runner.machine.constrained_work import work_size


@njit
def solve_and_report(M, G, right, residuals, q, work, told, reactions):
    accelerations(M, G, right, residuals, q, work)
    report(G, right, work, told, reactions)


@njit
def solve_columns(G, work, forces, drifts, values):
    derivatives(G, work, forces, drifts, values[7:], 0)


def found_for(M, G, f, gamma, residuals=None, q=None):
    """(a, l, multipliers reported, reactions, workspace)."""
    m, n = G.shape
    right, work = np.concatenate([f, gamma]), np.zeros(work_size(n, m))
    residuals = np.zeros(m) if residuals is None else residuals
    told, reactions = np.zeros(m), np.zeros(n)
    q = np.ones(n) if q is None else q
    solve_and_report(np.ascontiguousarray(M), np.ascontiguousarray(G), right, residuals, q, work, told, reactions)
    return right[:n], right[n:], told, reactions, work


def exact(M, G, f, gamma):
    """(a, l) in 60 digits."""
    m, n = G.shape
    with mpmath.workdps(60):
        whole = mpmath.matrix(np.block([[M, G.T], [G, np.zeros((m, m))]]).tolist())
        x = mpmath.lu_solve(whole, mpmath.matrix([*f, *gamma]))
        return np.array([float(value) for value in x[:n]]), np.array([float(value) for value in x[n:]])


def inertia(chance, n, rank=None):
    A = chance.normal(size=(rank or n, n))
    return A.T @ A


@pytest.mark.parametrize("seed", range(12))
def test_regular_systems_in_any_units(seed):
    """Coordinates and constraints are given in units that differ by ten orders of magnitude."""
    chance = np.random.default_rng(seed)
    n = int(chance.integers(1, 9))
    m = int(chance.integers(1, n + 1))
    units, sizes = 10.0 ** chance.uniform(-5, 5, n), 10.0 ** chance.uniform(-5, 5, m)
    M, G = inertia(chance, n), chance.normal(size=(m, n))
    f, gamma = chance.normal(size=n), chance.normal(size=m)
    a, multipliers, told, reactions, _ = found_for(
        units[:, None] * M * units, sizes[:, None] * G * units, units * f, sizes * gamma
    )
    expected_a, expected_l = exact(M, G, f, gamma)
    error = 1e-14 * np.linalg.cond(M) ** 0.5 * np.linalg.cond(G @ np.linalg.solve(M, G.T))
    assert np.allclose(a * units, expected_a, rtol=0, atol=error * np.abs(expected_a).max()), seed
    assert np.allclose(multipliers * sizes, expected_l, rtol=0, atol=error * np.abs(expected_l).max() + error), seed
    assert np.array_equal(told, multipliers)
    assert np.allclose(reactions / units, -G.T @ expected_l, rtol=0, atol=1e3 * error * np.abs(expected_l).max())


def written_out(n, m):
    """`solved` for so many, and what it leaves."""

    @njit(fastmath={"contract", "nsz"}, error_model="numpy")
    def solve(M, G, right, residuals, q, work):
        solved(n, m, M, G, right, residuals, q, work)

    def found(M, G, f, gamma):
        right, work = np.concatenate([f, gamma]), np.zeros(work_size(n, m))
        solve(np.tril(M), np.ascontiguousarray(G), right, np.zeros(m), np.ones(n), work)
        return right, bool(work.any())

    return found


@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 2), (4, 4), (7, 6), (12, 8), (15, 6)])
def test_elimination_written_out_in_any_units(n, m):
    """15 and 6 are more than is written out."""
    chance = np.random.default_rng(10 * n + m)
    solve = written_out(n, m)
    for _ in range(20):
        units, sizes = 10.0 ** chance.uniform(-5, 5, n), 10.0 ** chance.uniform(-5, 5, m)
        M, G = inertia(chance, n) + np.eye(n), chance.normal(size=(m, n))
        f, gamma = chance.normal(size=n), chance.normal(size=m)
        right, careful = solve(units[:, None] * M * units, sizes[:, None] * G * units, units * f, sizes * gamma)
        expected_a, expected_l = exact(M, G, f, gamma)
        assert not careful or n + m > 20 or np.linalg.cond(G) > 30
        error = 1e-14 * np.linalg.cond(M) * np.linalg.cond(G @ np.linalg.solve(M, G.T))
        assert np.allclose(right[:n] * units, expected_a, rtol=0, atol=error * np.abs(expected_a).max())
        assert np.allclose(right[n:] * sizes, expected_l, rtol=0, atol=error * np.abs(expected_l).max() + error)


def test_elimination_written_out_leaves_to_others_what_is_not_sound():
    """Masses that are singular alone, constraints that depend on each other or nearly, and motion without inertia."""
    solve, chance = written_out(3, 2), np.random.default_rng(3)
    f, gamma, G = chance.normal(size=3), chance.normal(size=2), chance.normal(size=(2, 3))
    M = inertia(chance, 3) + np.eye(3)
    assert not solve(M, G, f, gamma)[1]
    near = np.array([G[0], G[0] + 1e-4 * G[1]])
    same = np.array([G[0], 2 * G[0]])
    for masses, gradients, drifts in (
        (np.diag([1.0, 2.0, 0.0]), G, gamma),
        (M, near, gamma),
        (M, same, np.array([1.0, 2.0])),
        (np.diag([1.0, 0.0, 0.0]), same, gamma),
    ):
        right, careful = solve(masses, gradients, f, drifts)
        a, multipliers, *_ = found_for(masses, gradients, f, drifts)
        assert careful and np.array_equal(right, [*a, *multipliers], equal_nan=True)
    assert np.isnan(right).all()


def test_a_constraint_without_a_gradient_is_left_out_where_elimination_is_written_out():
    """As a contact that does not rest, or one at a place where it says nothing."""
    solve, chance = written_out(3, 2), np.random.default_rng(4)
    M, f, G = inertia(chance, 3) + np.eye(3), chance.normal(size=3), chance.normal(size=(2, 3))
    for place in (0, 1):
        gradients, gamma = G.copy(), chance.normal(size=2)
        gradients[place] = 0.0
        right, careful = solve(M, gradients, f, gamma)
        a, multipliers, *_ = found_for(M, gradients, f, gamma)
        assert not careful and right[3 + place] == multipliers[place] == 0.0
        assert np.allclose(right, [*a, *multipliers], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_a_mass_matrix_that_is_singular_alone(seed):
    chance = np.random.default_rng(seed)
    M, G = inertia(chance, 5, rank=3), chance.normal(size=(2, 5))
    f, gamma = chance.normal(size=5), chance.normal(size=2)
    a, multipliers, *_ = found_for(M, G, f, gamma)
    expected_a, expected_l = exact(M, G, f, gamma)
    assert np.allclose(a, expected_a, rtol=1e-10) and np.allclose(multipliers, expected_l, rtol=1e-9)


def test_a_quaternion_at_unity_whose_mass_matrix_has_a_zero_on_its_diagonal():
    M, G = 4 * np.diag([0.0, 1.0, 2.0, 3.0]), np.array([[2.0, 0.0, 0.0, 0.0]])
    a, multipliers, *_ = found_for(M, G, np.array([0.5, 1.0, 2.0, 3.0]), np.array([-0.2]))
    assert np.allclose(a, [-0.1, 0.25, 0.25, 0.25]) and np.isclose(multipliers[0], 0.25)


@pytest.mark.parametrize("seed", range(6))
def test_redundant_constraints_leave_accelerations_and_reactions_unique(seed):
    """Rows 0 and 3 say the same, row 4 is a sum of rows 1 and 2; what is determined does not depend on units."""
    chance = np.random.default_rng(seed)
    M, few = inertia(chance, 7), chance.normal(size=(4, 7))
    f, gamma = chance.normal(size=7), chance.normal(size=4)
    mix = np.zeros((6, 4))
    mix[[0, 1, 2, 5], range(4)] = 1.0
    mix[3, 0], mix[4, 1], mix[4, 2] = -2.0, 1.0, 3.0
    units = 10.0 ** chance.uniform(-4, 4, 6)
    a, _, told, reactions, _ = found_for(M, (units[:, None] * mix) @ few, f, units * (mix @ gamma))
    expected_a, expected_l = exact(M, few, f, gamma)
    assert np.allclose(a, expected_a, rtol=1e-8, atol=1e-9)
    assert np.allclose(reactions, -few.T @ expected_l, rtol=1e-8, atol=1e-8)
    assert np.isnan(told[:5]).all() and np.isclose(told[5] * units[5], expected_l[3], rtol=1e-8)


def test_a_constraint_whose_gradient_vanishes_is_left_out():
    """As of (x^2 + y^2)^2 = 0: at the origin it says nothing."""
    a, _, told, *_ = found_for(
        np.eye(2), np.array([[0.0, 0.0], [1.0, 1.0]]), np.array([1.0, 3.0]), np.array([0.0, 0.0])
    )
    assert np.allclose(a, [-1.0, 1.0]) and np.isnan(told[0]) and np.isclose(told[1], 2.0)


def test_off_the_constraints_those_that_are_the_same_on_them_stay_the_same():
    """Two rows differ by what a state off by 1e-6 makes of them, and their drifts by as much."""
    G = np.array([[1.0, 0.0], [1.0, 1e-6]])
    gamma, f = np.array([0.0, 3e-6]), np.array([1.0, 1.0])
    a, *_ = found_for(np.eye(2), G, f, gamma, residuals=np.array([1e-6, 1e-6]))
    assert np.allclose(a, [0.0, 1.0], atol=1e-5)
    a, *_ = found_for(np.eye(2), G, f, gamma)
    assert np.allclose(a, [0.0, 3.0])


def test_a_motion_without_inertia_gives_no_number():
    a, multipliers, *_ = found_for(np.diag([1.0, 0.0]), np.array([[1.0, 0.0]]), np.ones(2), np.zeros(1))
    assert np.isnan(a).all() and np.isnan(multipliers).all()


def test_columns_of_derivatives():
    chance = np.random.default_rng(1)
    n, m = 5, 3
    M, G, right = inertia(chance, n), chance.normal(size=(m, n)), chance.normal(size=n + m)
    *_, work = found_for(M, G, right[:n], right[n:])
    forces, drifts = chance.normal(size=(n, 4)), chance.normal(size=(m, 4))
    values = np.ones(7 + 4 * n)
    solve_columns(G, work, forces, drifts, values)
    slopes = values[7:].reshape(n, 4)
    for column in range(4):
        expected, _ = exact(M, G, forces[:, column], drifts[:, column])
        assert np.allclose(slopes[:, column], expected, rtol=1e-9, atol=1e-10)
    assert (values[:7] == 1.0).all()


def test_arrays_on_the_stack():
    """They are zeros each time, and a function that has them allocates nothing."""

    @njit
    def sums(count):
        total = 0.0
        for _ in range(count):
            M, G, right, residuals, q, work = equations(3, 2)
            columns = blank(2, 6)
            for array in (M, G, columns):
                total += array.sum()
                array[0, 0] = 1.0
            total += right.sum() + residuals.sum() + q.sum() + work.sum()
            right[4], residuals[1], q[2], work[-1] = 1.0, 1.0, 1.0, 1.0
        return total, M.shape, G.shape, right.shape, residuals.shape, q.shape, len(work), columns.shape

    found = sums(3)
    assert found == (0.0, (3, 3), (2, 3), (5,), (2,), (3,), work_size(3, 2), (2, 6))
