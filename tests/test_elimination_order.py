"""Coordinates are solved for in an order that fills little in: the cost is the same whatever is declared first."""

from itertools import combinations

import numpy as np
import pytest
import symengine as se
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from sympy import Add, Rational, cos, symbols

import qddot
from qddot.codegen import lagrange
from qddot.codegen.elimination import factorize
from qddot.codegen.generate import generate
from qddot.codegen.lower import lower_rhs
from qddot.codegen.ordering import in_order, ordering
from qddot.codegen.rewrite import Names
from qddot.model import Coordinate, Parameter, System
from qddot.runner.machine.coupled import decoupled, slopes, table_of

HALF = Rational(1, 2)
N = 7
#: Which of N coordinates are coupled: a band, an arrow by its tip and from its shafts, a random structure, all.
STRUCTURES = {
    "band": [(k, j) for k in range(N) for j in range(k) if k - j <= 2],
    "arrow": [(k, j) for k in range(2, N) for j in (0, 1)] + [(1, 0)],
    "sparse": [(3, 0), (5, 0), (6, 1), (4, 2), (5, 3), (6, 4)],
    "dense": [(k, j) for k in range(N) for j in range(k)],
}
systems = st.tuples(st.integers(1, 24), st.floats(0.0, 1.0), st.integers(0, 2**32 - 1))


def model(name, pairs, last=()):
    """Coordinates coupled by a mass matrix that moves, some of them declared last."""
    q, v, m, k = symbols(f"q_1:{N + 1}"), symbols(f"qdot_1:{N + 1}"), *symbols("m k")
    masses = Add(*((3 + cos(q[i])) * v[i] ** 2 for i in range(N))) / 2
    couplings = Add(*(cos(q[i] - q[j]) * v[i] * v[j] / 4 for i, j in pairs))
    declared = sorted(range(N), key=lambda i: i in last)
    return System(
        name=name,
        title=name,
        coordinates=tuple(Coordinate(q[i], "m", f"place {i}") for i in declared),
        parameters=(Parameter(m, 1.2, "kg", "mass"), Parameter(k, 3.0, "N/m", "stiffness")),
        kinetic_energy=m * (masses + couplings),
        potential_energy=HALF * k * Add(*(each**2 for each in q)),
    )


def sparse_pairs(n, density, seed):
    rng = np.random.default_rng(seed)
    return [(k, j) for k in range(n) for j in range(k) if rng.random() < density]


def factors_of_a_dense_matrix(pairs, order):
    """Places of entries beside the diagonal of the factors, found on a matrix of numbers without chance zeros."""
    n = len(order)
    place = {row: k for k, row in enumerate(order)}
    held = np.eye(n, dtype=bool)
    for k, j in pairs:
        held[place[k], place[j]] = held[place[j], place[k]] = True
    for s in range(n):
        behind = np.flatnonzero(held[s, s + 1 :]) + s + 1
        held[np.ix_(behind, behind)] = True
    return tuple(tuple(int(k) for k in np.flatnonzero(held[s]) if k > s) for s in range(n))


@settings(max_examples=100, deadline=None, print_blob=True)
@given(systems)
def test_an_order_takes_all_rows_once_and_no_more_steps_than_the_author_s(drawn):
    pairs = sparse_pairs(*drawn)
    found, given_order = ordering(pairs, drawn[0]), in_order(pairs, range(drawn[0]))
    assert sorted(found.order) == list(range(drawn[0]))
    assert found.rows == factors_of_a_dense_matrix(pairs, found.order)
    assert found.steps <= given_order.steps
    assert found.steps < given_order.steps or found.order == given_order.order
    assert [found.order[place] for place in found.places] == list(range(drawn[0]))


@settings(max_examples=40, deadline=None, print_blob=True)
@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_a_tree_however_it_is_numbered_fills_nothing_in(n, seed):
    """A matrix whose graph is a tree has an order without fill (S. Parter, SIAM Review 3 (1961) 119-130)."""
    rng = np.random.default_rng(seed)
    names = rng.permutation(n)
    pairs = [(int(names[k]), int(names[rng.integers(k)])) for k in range(1, n)]
    assert sum(map(len, ordering(pairs, n).rows)) == n - 1


@pytest.mark.parametrize("first", [True, False], ids=["hub first", "hub last"])
def test_an_arrow_costs_the_same_whatever_is_declared_first(first):
    wheels, hub = 30, 6
    n = wheels + hub
    held = range(hub) if first else range(wheels, n)
    pairs = [(max(k, h), min(k, h)) for h in held for k in range(n) if k != h]
    found = ordering(pairs, n)
    assert found.steps == wheels * hub * (hub + 3) // 2 + sum(k * (k + 3) // 2 for k in range(hub))
    assert len(table_of(" ".join(found.texts))) == 2 * n + 1 + wheels * hub + hub * (hub - 1) // 2


def test_what_is_written_out_costs_the_same_whatever_is_declared_first():
    first, last = (lower_rhs(lagrange.derive(model("arrow", STRUCTURES["arrow"], held))) for held in ((), (0, 1)))
    assert first.operations == last.operations


@settings(max_examples=60, deadline=None, print_blob=True)
@given(systems)
def test_steps_are_those_of_the_elimination_written_out(drawn):
    n, _, _ = drawn
    mass = {pair: se.Symbol("m_{}_{}".format(*pair)) for pair in [*sparse_pairs(*drawn), *((k, k) for k in range(n))]}
    found = ordering(mass, n)
    lower = factorize(mass, found, Names(()).fresh).lower
    counts = [sum(column == j for _, column in lower) for j in range(n)]
    assert found.steps == sum(count * (count + 3) // 2 for count in counts)


@njit
def solution(M, factors, f, forces, values):
    decoupled(M, factors, f)
    slopes(M, factors, forces, values, 1)


@settings(max_examples=100, deadline=None, print_blob=True)
@given(systems, st.booleans())
def test_random_sparse_matrices_are_solved_in_any_order(drawn, shuffled):
    n, _, seed = drawn
    pairs, rng = sparse_pairs(*drawn), np.random.default_rng(seed)
    M = np.diag(rng.uniform(0.5, 2.0, n))
    for k, j in pairs:
        M[k, j] = M[j, k] = rng.normal()
    M += np.diag(np.abs(M).sum(axis=1))
    found = in_order(pairs, rng.permutation(n).tolist()) if shuffled else ordering(pairs, n)
    rows, factors = list(found.order), np.array(table_of(" ".join(found.texts)))
    f, forces, values = rng.normal(size=n), rng.normal(size=(n, 3)), np.zeros(1 + 3 * n)
    a, below = f[rows], np.triu(M[np.ix_(rows, rows)])
    solution(below, factors, a, forces[rows].copy(), values)
    allowed = 1e-14 * np.linalg.cond(M)
    expected, columns = np.linalg.solve(M, f), np.linalg.solve(M, forces)
    assert a == pytest.approx(expected[rows], rel=allowed, abs=allowed * np.abs(expected).max())
    assert values[1:].reshape(n, 3) == pytest.approx(columns, rel=allowed, abs=allowed * np.abs(columns).max())
    assert values[0] == 0.0


def kernels(system, folder, limit):
    """What a model gives at a state, solved in its text or by a loop; limit: the most steps that are written out."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lagrange, "_LONGEST_ELIMINATION", limit)
        patch.setattr(lagrange, "_SPARSE", 0)
        made = qddot.load(generate(system, folder))
    at = {f"q_{k + 1}": 0.3 * k - 0.7 for k in range(N)} | {f"qdot_{k + 1}": 0.9 - 0.4 * k for k in range(N)}
    x = np.array([at[name] for name in made.state_names])
    c, u, dx = made.constants(made.parameter_values()), np.zeros(1), np.empty(2 * N)
    made.kernel("rhs")(0.0, x, u, c, dx)
    J = made.matrix("jacobian")(0.0, x, u, c)
    order = np.argsort([int(name.split("_")[1]) + N * ("dot" in name) for name in made.state_names])
    return dx[order], J[np.ix_(order, order)], "decoupled(" in (folder / f"{system.name}.py").read_text("utf-8")


@pytest.mark.parametrize("name", STRUCTURES)
def test_every_structure_gives_what_its_solution_written_out_gives(name, tmp_path):
    """And so does the loop where the author declares the coordinates that hold most of the others last."""
    one, J, by_loop = kernels(model(name, STRUCTURES[name]), tmp_path / "written", 10**6)
    assert not by_loop
    for folder, last in (("loop", ()), ("last", (0, 1))):
        other, K, by_loop = kernels(model(name, STRUCTURES[name], last), tmp_path / folder, 0)
        assert by_loop
        assert other == pytest.approx(one, rel=1e-12, abs=1e-12 * np.abs(one).max())
        assert pytest.approx(J, rel=1e-11, abs=1e-11 * np.abs(J).max()) == K


def test_a_module_tells_the_order_in_which_it_is_solved(tmp_path, monkeypatch):
    """The arrow from its shafts to its tip, the last of them, which holds no more than the tip then, before it."""
    monkeypatch.setattr(lagrange, "_LONGEST_ELIMINATION", 0)
    monkeypatch.setattr(lagrange, "_SPARSE", 0)
    text = generate(model("arrow", STRUCTURES["arrow"]), tmp_path).read_text("utf-8")
    assert 'FACTORS = """\n2:5-6 3:5-6 4:5-6 5:5-6 6:5-6 0:6 1:\n"""' in text


def test_all_pairs_leave_the_author_s_order():
    assert ordering(combinations(range(9), 2), 9).order == tuple(range(9))
