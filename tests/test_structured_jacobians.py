"""Stiff methods on large structures: factors of a band, or of sparse rows, give what those of the whole matrix give."""

from collections import namedtuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from runs import problem as problem_of
from runs import run

from qddot.runner.machine import linear_algebra
from qddot.runner.machine.linear_algebra import find_lapack
from qddot.runner.machine.memory import address
from qddot.runner.matrices import Pattern, PlacedKernel
from qddot.runner.stiff import space
from qddot.runner.stiff.band import Band, band_of
from qddot.runner.stiff.matrix import structure_of
from qddot.runner.stiff.sparse import (
    Sparse,
    factorize_shifted_sparse,
    fewest_multiplications,
    multiply_sparse,
    solve_sparse,
    sparse_of,
)

SEED = 20261127
METHOD_NAMES = ("ode15s", "rodas5p")
#: For Python to call.
factorize_band, solve_band = (
    njit(function.py_func) for function in (linear_algebra.factorize_band, linear_algebra.solve_band)
)


@njit
def rhs(t, x, u, c, dx):
    """x' = A x + (cos t, ..., cos t), with the entries of A, then their rows and columns, in c."""
    entries = len(c) // 3
    dx[:] = np.cos(t)
    for k in range(entries):
        dx[int(c[entries + k])] += c[k] * x[int(c[2 * entries + k])]


@njit
def jacobian(t, x, u, c, values):
    values[:] = c[: len(values)]


@njit
def no_jacobian(t, x, u, c, values):
    values[:] = np.nan


def ladder(rng, n, reach):
    """A stable matrix (n, n) whose entries reach so far from the diagonal, its states shuffled."""
    A = np.triu(np.tril(rng.normal(size=(n, n)), reach), -reach) * (rng.random((n, n)) < 0.7)
    A -= np.diag(1.0 + np.abs(A).sum(axis=1) * (1.0 + 100.0 * rng.random(n)))
    shuffled = rng.permutation(n)
    return A[np.ix_(shuffled, shuffled)]


def problem(A, kernel=jacobian, mass=None):
    rows, columns = np.nonzero(A)
    c = np.concatenate([A[rows, columns], rows, columns])
    pattern = Pattern(A.shape, rows, columns)
    start = np.linspace(-1.0, 1.0, len(A))
    return problem_of(rhs, 2.0, start, PlacedKernel(kernel, pattern), mass, c)


def places(posed):
    """The arguments of what finds a structure."""
    pattern = posed.jacobian.pattern
    return pattern.shape[0], pattern.rows, pattern.columns


STRUCTURES = {"whole": lambda posed: None, "band": lambda posed: band_of(*places(posed))}
STRUCTURES["sparse"] = lambda posed: sparse_of(*places(posed))


def ends(A, kernel, name, monkeypatch, structure):
    """The last state and the counts of a run; of a problem of its own, since what one works in is used again."""
    monkeypatch.setattr(space, "structure_of", STRUCTURES[structure])
    found = run(name, problem(A, kernel), rtol=1e-5)
    return found.states[-1], found.statistics


@pytest.mark.parametrize("structure", ["band", "sparse"])
@pytest.mark.parametrize("kernel", [jacobian, no_jacobian], ids=["kernel", "differences"])
@pytest.mark.parametrize("name", METHOD_NAMES)
def test_a_structure_gives_what_the_whole_matrix_gives(name, kernel, structure, monkeypatch):
    rng = np.random.default_rng(SEED)
    for n, reach in ((33, 1), (60, 3), (60, 0), (90, 7)):
        A = ladder(rng, n, reach)
        (whole, counts), (found, same) = (ends(A, kernel, name, monkeypatch, each) for each in ("whole", structure))
        np.testing.assert_allclose(found, whole, rtol=1e-9, atol=1e-12, err_msg=f"{n} {reach} {SEED}")
        for count in ("steps", "factorizations", "jacobians", "evaluations"):
            assert getattr(same, count) == getattr(counts, count)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(33, 80), st.integers(0, 6), st.integers(0, 6))
def test_factors_of_a_band_solve_as_numpy_does(seed, n, lower, upper):
    rng = np.random.default_rng(seed)
    A = np.triu(np.tril(rng.normal(size=(n, n)), upper), -lower)
    A[np.diag_indices(n)] += rng.choice([0.0, 3.0], n)  # rows are exchanged where it is weak
    b, W, pivots = rng.normal(size=n), np.zeros((n, 2 * lower + upper + 1)), np.zeros(n, dtype=np.int64)
    found = Band(np.arange(n), lower, upper)
    rows, columns = np.nonzero(A)
    W.ravel()[found.places(Pattern(A.shape, rows, columns))] = A[rows, columns]
    lapack, x = find_lapack(n, banded=True), b.copy()
    condition = np.linalg.cond(A)
    if factorize_band(lapack, W, lower, upper, pivots) < 0 and condition < 1e10:
        solve_band(lapack, W, lower, upper, pivots, x)
        np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=0, atol=1e-14 * condition * np.abs(x).max())


@pytest.mark.parametrize("spoil", [0.0, np.nan, np.inf])
def test_a_band_without_a_pivot_is_reported(spoil):
    W, pivots = np.ones((40, 1)), np.zeros(40, dtype=np.int64)
    W[7] = spoil
    assert factorize_band(find_lapack(40, banded=True), W, 0, 0, pivots) >= 0


def test_the_order_of_the_states_does_not_matter():
    """Cuthill and McKee find the chain again, however its states are shuffled."""
    rng = np.random.default_rng(SEED)
    found = band_of(*places(problem(ladder(rng, 200, 1))))
    assert found is not None
    assert (found.lower, found.upper) == (1, 1)
    assert sorted(found.order) == list(range(200))


def test_small_wide_and_weighted_systems_stay_whole():
    rng = np.random.default_rng(SEED)
    assert structure_of(problem(ladder(rng, 32, 1))) is None
    assert structure_of(problem(ladder(rng, 60, 20))) is None
    assert structure_of(problem(ladder(rng, 60, 1), mass=np.eye(60))) is None


def test_what_costs_least_is_chosen():
    """A chain is a band, a hub with spokes and a tree are sparse, what holds nearly all of itself is whole."""
    rng = np.random.default_rng(SEED)
    chain, full = ladder(rng, 200, 2), rng.normal(size=(60, 60))
    spokes, tree = np.eye(200), np.eye(200)
    spokes[:3] = spokes[:, :3] = 1.0
    for k in range(1, 200):
        tree[k, rng.integers(k)] = 1.0
    found = [structure_of(problem(A)) for A in (chain, spokes, tree, full)]
    assert [type(each) for each in found] == [Band, Sparse, Sparse, type(None)]
    assert len(found[1].columns) == np.count_nonzero(spokes)  # the hub comes last, and nothing fills in
    assert len(found[2].columns) == np.count_nonzero(tree + tree.T)


Place = namedtuple("Place", "n cells jacobian factors begins columns diagonals place_of scratch")


def placed(A):
    """What compiled functions read of a sparse matrix, and the arrays that it lies in."""
    rows, columns = np.nonzero(A)
    found = sparse_of(len(A), rows, columns)
    arrays = found.arrays()
    arrays["jacobian"][found.places(Pattern(A.shape, rows, columns))] = A[rows, columns]
    addresses = {name: address(array) for name, array in arrays.items()}
    return Place(n=len(A), cells=len(found.columns), **addresses), arrays


@njit
def solution(place, a, b, x, product):
    failed = factorize_shifted_sparse(place, a, b)
    solve_sparse(place, x)
    multiply_sparse(place, x, product)
    return failed


@settings(max_examples=60, deadline=None, print_blob=True)
@given(st.integers(0, 2**32 - 1), st.integers(2, 60), st.floats(0.0, 0.3), st.sampled_from([0.0, 1e-3, 1.0, 1e4]))
def test_factors_of_what_fills_in_solve_as_numpy_does(seed, n, density, b):
    rng = np.random.default_rng(seed)
    J = np.where(rng.random((n, n)) < density, rng.normal(size=(n, n)), 0.0)
    place, arrays = placed(J)
    x, product, right = np.zeros(n), np.zeros(n), rng.normal(size=n)
    x[:] = right
    failed = solution(place, 1.0, b, x, product)
    A = np.eye(n) - b * J
    if not failed:
        np.testing.assert_allclose(x, np.linalg.solve(A, right), rtol=0, atol=1e-4 * np.abs(x).max())
        np.testing.assert_allclose(product, J @ x, rtol=0, atol=1e-12 * (1 + np.abs(J) @ np.abs(x)).max())
    assert not failed or b > 1e-3
    assert fewest_multiplications(n, *np.nonzero(J)) <= sparse_of(n, *np.nonzero(J)).multiplications
    assert arrays["factors"].size == place.cells


@pytest.mark.parametrize("spoil", [0.0, np.nan, np.inf])
def test_sparse_rows_whose_pivots_do_not_serve_are_reported(spoil):
    """What is on the diagonal is no pivot, or so small that nothing is left of what it is taken from: 1 - 1e17."""
    single, lost = np.eye(40) + np.diag(np.ones(39), 1), np.eye(40)
    single[17, 17] = spoil
    lost[:2, :2] = [[1e-17, 1.0], [1.0, 1e-17]]
    for J in (single, lost):
        place, arrays = placed(J)
        x = np.ones(len(arrays["place_of"]))
        assert solution(place, 0.0, -1.0, x, x.copy())


@pytest.mark.parametrize("name", METHOD_NAMES)
def test_a_state_whose_row_is_not_finite_is_named(name):
    """The index is the state's own, not its place in the band."""
    A = ladder(np.random.default_rng(SEED), 50, 1)
    A[17, 17] = np.nan
    assert run(name, problem(A), rtol=1e-4).failed_state == 17
