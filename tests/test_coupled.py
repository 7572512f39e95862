"""Models of many coupled coordinates: solved at run time, they give what an elimination written out gives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

import qddot
from qddot.codegen import constrained_drafts, lagrange
from qddot.codegen.elimination import factorize, steps
from qddot.codegen.generate import generate
from qddot.codegen.rewrite import Names
from qddot.model.pendulum import system
from qddot.model.system import ModelError
from qddot.runner.machine.coupled import decoupled, slopes

LINKS = 5


def generated(folder, limit):
    """A pendulum with so many steps of an elimination written out at most."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lagrange, "_LONGEST_ELIMINATION", limit)
        patch.setattr(lagrange, "_SPARSE", 0)
        return qddot.load(generate(system(LINKS), folder))


@pytest.fixture(scope="module")
def pendulums(tmp_path_factory):
    """One written out, one solved at run time."""
    folder = tmp_path_factory.mktemp("pendulums")
    return generated(folder / "unrolled", 10**6), generated(folder / "solved", 0)


@njit
def solution(M, f, forces, values):
    decoupled(M, f)
    slopes(M, forces, values, 1)


@settings(max_examples=60, deadline=None, print_blob=True)
@given(st.integers(1, 24), st.floats(0.0, 1.0), st.integers(0, 2**31))
def test_random_sparse_matrices_are_solved(n, density, seed):
    rng = np.random.default_rng(seed)
    L = np.tril(np.where(rng.random((n, n)) < density, rng.normal(size=(n, n)), 0.0), -1) + np.eye(n)
    M = L @ np.diag(rng.uniform(0.5, 2.0, n)) @ L.T
    f, forces = rng.normal(size=n), rng.normal(size=(n, 3))
    expected, columns = np.linalg.solve(M, f), np.linalg.solve(M, forces)
    a, values, below = f.copy(), np.zeros(1 + 3 * n), np.triu(M)
    solution(below, a, forces.copy(), values)
    allowed = 1e-14 * np.linalg.cond(M)
    assert a == pytest.approx(expected, rel=allowed, abs=allowed * np.abs(expected).max())
    assert values[1:].reshape(n, 3) == pytest.approx(columns, rel=allowed, abs=allowed * np.abs(columns).max())
    assert values[0] == 0.0


def test_a_mass_matrix_that_is_singular_gives_no_finite_acceleration():
    M, f = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([1.0, 2.0])
    decoupled_once = njit(lambda M, f: decoupled(M, f))
    decoupled_once(M, f)
    assert not np.isfinite(f).all()


def test_both_forms_give_the_same_slopes(pendulums):
    rng = np.random.default_rng(4)
    for _ in range(5):
        x = rng.uniform(-2.0, 2.0, 2 * LINKS)
        found = []
        for model in pendulums:
            c, u, dx = model.constants(model.parameter_values()), np.zeros(1), np.empty(2 * LINKS)
            model.kernel("rhs")(0.0, x, u, c, dx)
            found.append((dx, model.matrix("jacobian")(0.0, x, u, c), model.matrix("mass")(0.0, x, u, c)))
        for one, other in zip(*found, strict=True):
            assert other == pytest.approx(one, rel=1e-11, abs=1e-11 * np.abs(one).max())


def test_the_form_solved_at_run_time_has_the_same_series_and_says_what_it_calls(pendulums):
    unrolled, solved = pendulums
    assert unrolled.tables.recurrence
    assert len(solved.tables.recurrence.split("\n")) == len(unrolled.tables.recurrence.split("\n"))
    text = solved.module.__loader__.get_data(solved.module.__file__).decode()
    assert "from qddot.runner.machine.coupled import blank, coupled, decoupled, slopes\n" in text
    assert "lower_2_1" not in text


@pytest.mark.parametrize("method", ["dop853", "ode15s", "taylor"])
def test_both_forms_run_alike(pendulums, method):
    initial = np.r_[np.linspace(0.5, 0.9, LINKS), np.zeros(LINKS)]
    one, other = (
        qddot.simulate(model, (0.0, 1.0), method=method, initial=initial, rtol=1e-10, atol=1e-12)
        for model in pendulums
    )  # fmt: skip
    assert other.states[-1] == pytest.approx(one.states[-1], abs=1e-7)


def test_both_forms_run_in_lanes(pendulums):
    initial = np.random.default_rng(2).uniform(-0.5, 0.5, (9, 2 * LINKS))
    one, other = (
        qddot.simulate_batch(model, (0.0, 0.5), method="dop853", initial=initial, rtol=1e-9, atol=1e-11)
        for model in pendulums
    )
    assert one.in_lanes
    assert other.in_lanes
    assert other.final == pytest.approx(one.final, abs=1e-6)


@settings(max_examples=60, deadline=None, print_blob=True)
@given(st.integers(1, 12), st.sets(st.tuples(st.integers(0, 11), st.integers(0, 11)), max_size=30))
def test_steps_are_those_of_the_elimination(n, pairs):
    import symengine as se

    places = {(max(pair), min(pair)) for pair in pairs if max(pair) < n and len(set(pair)) == 2}
    mass = {place: se.Symbol(f"m_{place[0]}_{place[1]}") for place in [*places, *((k, k) for k in range(n))]}
    lower = factorize(mass, n, Names(()).fresh).lower
    counts = [sum(column == j for _, column in lower) for j in range(n)]
    assert steps(mass, n) == sum(count * (count + 3) // 2 for count in counts)


def test_small_models_are_written_out_and_large_ones_are_not():
    assert not lagrange.derive(system(4)).solved_at_run_time
    assert steps([(k, j) for k in range(12) for j in range(k + 1)], 12) < lagrange._LONGEST_ELIMINATION
    assert steps([(k, j) for k in range(13) for j in range(k + 1)], 13) > lagrange._LONGEST_ELIMINATION
    assert steps([(k, k - 1) for k in range(1, 1000)], 1000) < lagrange._SPARSE * 1000


def test_too_many_coupled_coordinates_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(lagrange, "_LONGEST_ELIMINATION", 0)
    monkeypatch.setattr(lagrange, "_SPARSE", 0)
    monkeypatch.setattr(constrained_drafts, "MOST", 4)
    with pytest.raises(ModelError, match=r"5 coordinates, all coupled with each other, are too many: 4 together"):
        generate(system(LINKS), tmp_path)
    assert not list(tmp_path.iterdir())
