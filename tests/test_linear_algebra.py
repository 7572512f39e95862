import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numba import njit

from qddot.runner.machine import linear_algebra
from qddot.runner.machine.linear_algebra import LARGEST_OWN, find_lapack

#: For Python to call.
factorize, solve = (njit(function.py_func) for function in (linear_algebra.factorize, linear_algebra.solve))


def solved(A, b):
    """x of A x = b, and what `factorize` returned; matrices go in by columns."""
    W, pivots, x = A.T.copy(order="C"), np.zeros(len(b), dtype=np.int64), b.copy()
    lapack = find_lapack(len(b))
    failed = factorize(lapack, W, pivots)
    if failed < 0:
        solve(lapack, W, pivots, x)
    return x, failed


#: Zero or of a size that a solution can answer without overflow.
entries = st.floats(-1e3, 1e3).map(lambda x: x if abs(x) > 1e-100 else 0.0)


@settings(max_examples=200, deadline=None)
@given(
    st.integers(1, 12).flatmap(
        lambda n: st.tuples(arrays(float, (n, n), elements=entries), arrays(float, n, elements=entries))
    )
)
def test_solution_is_as_accurate_as_partial_pivoting_promises(case):
    A, b = case
    x, failed = solved(A, b)
    if failed >= 0:  # Nothing is left to divide by: numpy agrees up to rounding.
        assert np.linalg.svd(A, compute_uv=False)[-1] <= 1e-10 * max(1.0, np.abs(A).max())
    elif np.linalg.cond(A) < 1e12:
        backward_error = np.abs(A @ x - b) / (np.abs(A).max() * len(b) * np.abs(x).max() + np.abs(b).max() + 1e-300)
        assert backward_error.max() < 1e-11
        np.testing.assert_allclose(
            x, np.linalg.solve(A, b), rtol=0, atol=1e-15 * np.linalg.cond(A) * (np.abs(x).max() + 1)
        )


@pytest.mark.parametrize("n", [1, 2, 14, LARGEST_OWN, LARGEST_OWN + 1, 150])
def test_own_loops_and_lapack_agree_with_numpy(n):
    rng = np.random.default_rng(n)
    A, b = rng.normal(size=(n, n)), rng.normal(size=n)
    x, failed = solved(A, b)
    assert failed == -1
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-9)


@pytest.mark.parametrize("n", [3, LARGEST_OWN + 1])
@pytest.mark.parametrize("spoil", [0.0, np.nan, np.inf])
def test_singular_and_non_finite_matrices_are_reported(n, spoil):
    A = np.eye(n)
    A[1, 1] = spoil
    assert solved(A, np.ones(n))[1] == 1


def test_zero_on_the_diagonal_is_exchanged():
    x, failed = solved(np.array([[0.0, 2.0], [4.0, 0.0]]), np.array([6.0, 8.0]))
    assert failed == -1
    np.testing.assert_array_equal(x, [2.0, 3.0])
