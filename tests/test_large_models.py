"""Equilibrium and modes of large models by sparse matrices: what dense ones, and formulas, say."""

import numpy as np
import pytest
from scipy.sparse import block_array, csc_array, diags_array, eye_array

import qddot
from qddot.codegen.generate import generate
from qddot.model import chain
from qddot.runner import equilibrium as resting
from qddot.runner.sparse import LARGE, Factors, slowest

N = 210


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A chain of more states than are kept dense."""
    made = qddot.load(generate(chain.system(N), tmp_path_factory.mktemp("chain")))
    assert len(made.state_names) > LARGE
    return made


def test_the_slowest_modes_are_those_of_all(model):
    few, everything = qddot.modes(model, most=5), qddot.modes(model)
    assert (len(few), len(everything)) == (5, N)
    for found, right in zip(few, everything, strict=False):
        assert found.eigenvalue == pytest.approx(right.eigenvalue, rel=1e-8)
        assert found.participation == pytest.approx(right.participation, rel=1e-6, abs=1e-9)


def test_a_state_that_is_given_is_where_it_is_linearized(model):
    state = np.zeros(2 * N)
    assert qddot.modes(model, state=state, most=2)[0].eigenvalue == pytest.approx(
        qddot.modes(model, state=state)[0].eigenvalue, rel=1e-8
    )


def test_most_is_taken_by_small_models_too():
    m113 = qddot.load("m113")
    assert qddot.modes(m113, most=2) == qddot.modes(m113)[:2]


@pytest.mark.parametrize("most", [0, -1, 1.5, True, "all"])
def test_a_wrong_number_of_modes_is_refused(most):
    with pytest.raises(ValueError, match="expected a number of modes, 1 or more"):
        qddot.modes(qddot.load("m113"), most=most)


def test_the_static_state_is_that_of_whole_matrices(model, monkeypatch):
    found = qddot.equilibrium(model)
    monkeypatch.setattr(resting, "LARGE", 10**9)
    np.testing.assert_allclose(found, qddot.equilibrium(model), rtol=1e-9, atol=1e-12)


def test_a_large_model_that_nothing_holds_is_told(model):
    with pytest.raises(resting.EquilibriumError, match=r"is not isolated: nothing holds q_\d+"):
        qddot.equilibrium(model, {"k": 0.0})


def test_a_free_body_has_a_mode_of_rest():
    """A singular matrix: the eigenvalues are sought beside zero."""
    n = 300
    K = diags_array([np.r_[1.0, 2.0 * np.ones(n - 2), 1.0], -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1])
    zero = csc_array((n, n))
    J = block_array([[zero, eye_array(n)], [-K, -0.01 * eye_array(n)]]).tocsc()
    values, _, shares = slowest(J, 4)
    omega = 2.0 * np.sin(np.pi * np.arange(4) / (2 * n))  # of a chain with free ends
    right = np.sort(np.abs(np.roots([1.0, 0.01, omega[0] ** 2])))
    assert np.abs(values[0]) == pytest.approx(right[0], abs=1e-7)
    assert shares.shape == (2 * n, len(values))


def test_factors_solve_and_tell_singular_matrices():
    rng = np.random.default_rng(20261127)
    rows = 10.0 ** rng.integers(-6, 6, 50)
    A = rows[:, None] * (3.0 * np.eye(50) + np.diag(rng.normal(size=49), 1) + np.diag(rng.normal(size=49), -1))
    b = rng.normal(size=50)
    factors = Factors(csc_array(A))
    scaled = A / np.abs(A).max(axis=1)[:, None]
    assert factors.condition == pytest.approx(np.linalg.cond(scaled, 1), rel=0.5)
    np.testing.assert_allclose(factors.solve(b), np.linalg.solve(A, b), rtol=1e-10)
    A[7] = 0.0
    assert Factors(csc_array(A)).condition == np.inf
    A[7] = A[8]
    assert Factors(csc_array(A)).condition > 1e15
    A[7, 7] = np.nan
    assert Factors(csc_array(A)).condition == np.inf
