"""Models of many coupled coordinates: solved at run time, they give what an elimination written out gives."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from numba import njit

import qddot
from qddot.codegen import constrained_drafts, lagrange
from qddot.codegen.generate import generate
from qddot.codegen.ordering import ordering
from qddot.model.pendulum import system
from qddot.model.system import ModelError
from qddot.runner.machine.coupled import decoupled, table_of

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


def test_a_mass_matrix_that_is_singular_gives_no_finite_acceleration():
    M, f = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([1.0, 2.0])
    decoupled_once = njit(lambda M, factors, f: decoupled(M, factors, f))
    decoupled_once(M, np.array(table_of("0:1 1:")), f)
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


def test_small_models_are_written_out_and_large_ones_are_not():
    assert not lagrange.derive(system(4)).solved_at_run_time
    assert ordering(combinations(range(12), 2), 12).steps < lagrange._LONGEST_ELIMINATION
    assert ordering(combinations(range(13), 2), 13).steps > lagrange._LONGEST_ELIMINATION
    assert ordering(pairwise(range(1000)), 1000).steps < lagrange._SPARSE * 1000


def test_too_many_coupled_coordinates_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(lagrange, "_LONGEST_ELIMINATION", 0)
    monkeypatch.setattr(lagrange, "_SPARSE", 0)
    monkeypatch.setattr(constrained_drafts, "MOST", 4)
    with pytest.raises(ModelError, match=r"5 coordinates, all coupled with each other, are too many: 4 together"):
        generate(system(LINKS), tmp_path)
    assert not list(tmp_path.iterdir())
