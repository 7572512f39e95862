"""A model with a state beside its coordinates and their velocities: every method, batches, equilibrium and modes."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import qddot
from qddot.runner.load import load
from qddot.runner.modes import modes

M, K_1, K_2, B = 2.0, 50.0, 120.0, 4.0
A = np.array([[0, 1, 0], [-(K_1 + K_2) / M, 0, K_2 / M], [K_2 / B, 0, -K_2 / B]])
FORCE, END, START = 10.0, 0.7, np.array([0.05, -0.3, 0.02])


@pytest.fixture(scope="module")
def model():
    return load(Path(__file__).parent / "sample_models" / "maxwell.py")


def expected(start, force=FORCE, after=END):
    rest = np.array([force / K_1, 0.0, force / K_1])
    return rest + expm(A * after) @ (start - rest)


@pytest.mark.parametrize(
    ("method", "options", "tolerance"),
    [
        ("rk4", {"step": 1e-3}, 1e-9),
        ("dop853", {"rtol": 1e-10, "atol": 1e-12}, 1e-9),
        ("rodas5p", {"rtol": 1e-9, "atol": 1e-11}, 1e-8),
        ("ode15s", {"rtol": 1e-9, "atol": 1e-11}, 1e-6),
        ("exact", {}, 1e-13),
    ],
)
def test_a_run_follows_the_matrix_exponential(model, method, options, tolerance):
    run = qddot.simulate(model, (0, END), method=method, inputs={"F": FORCE}, initial=START, **options)
    np.testing.assert_allclose(run.states[-1], expected(START), rtol=0, atol=tolerance)
    assert run["s"][-1] == run.states[-1, 2]
    assert run["force"][-1] == pytest.approx(K_2 * (run["q"][-1] - run["s"][-1]), rel=1e-12, abs=1e-12)


def test_a_run_backward_comes_to_where_it_began(model):
    end = expected(START, after=0.2)
    run = qddot.simulate(model, (0.2, 0), method="exact", inputs={"F": FORCE}, initial=end)
    np.testing.assert_allclose(run.states[-1], START, rtol=0, atol=1e-11)  # what decays forward grows backward, to 400


def test_at_rest_the_internal_state_rests_too(model):
    found = qddot.equilibrium(model, inputs={"F": FORCE})
    np.testing.assert_allclose(found, [FORCE / K_1, 0.0, FORCE / K_1], rtol=1e-12)
    np.testing.assert_array_equal(qddot.equilibrium(model, inputs={"F": FORCE}, guess={"s": 3.0}), found)
    with pytest.raises(ValueError, match="unknown coordinate 'qdot'"):
        qddot.equilibrium(model, guess={"qdot": 1.0})
    with_nothing_to_move_it = qddot.equilibrium(model, {"k_2": 0.0}, {"F": FORCE}, guess={"s": 0.3})
    np.testing.assert_allclose(with_nothing_to_move_it, [FORCE / K_1, 0.0, 0.3], rtol=1e-12)


def test_modes_are_the_eigenvalues_and_name_the_internal_state(model):
    found = modes(model)
    values = [each.eigenvalue for each in found] + [each.eigenvalue.conjugate() for each in found if each.oscillating]
    np.testing.assert_allclose(np.sort_complex(values), np.sort_complex(np.linalg.eigvals(A)), rtol=1e-12)
    for each in found:
        assert sum(each.participation.values()) == pytest.approx(1.0)
    relaxation = next(each for each in found if not each.oscillating)
    assert relaxation.participation.keys() == {"q", "s"}
    assert relaxation.participation["s"] > relaxation.participation["q"]


@pytest.mark.parametrize(("method", "options"), [("rk4", {"step": 1e-3}), ("exact", {})])
def test_a_batch_starts_from_the_equilibria_and_gives_the_runs(model, method, options):
    stiffness = np.linspace(30.0, 90.0, 9)
    batch = qddot.simulate_batch(
        model,
        (0, END),
        method=method,
        parameters={"k_1": stiffness},
        inputs={"F": FORCE},
        output_times=[END],
        **options,
    )
    for k, run in zip(stiffness, range(len(stiffness)), strict=True):
        np.testing.assert_allclose(batch["s"][run, -1], FORCE / k, rtol=1e-11)


def test_the_balance_of_power_holds(model):
    """d(T + Pi)/dt = power in - power dissipated, which the damper takes through the internal state."""
    c = model.constants(model.parameter_values())
    u, dx, E, up, down, h = np.array([FORCE]), np.zeros(3), np.zeros(4), np.zeros(4), np.zeros(4), 1e-6
    model.kernel("rhs")(0.0, START, u, c, dx)
    model.kernel("energy")(0.0, START, u, c, E)
    model.kernel("energy")(0.0, START + h * dx, u, c, up)
    model.kernel("energy")(0.0, START - h * dx, u, c, down)
    assert (up[:2].sum() - down[:2].sum()) / (2 * h) == pytest.approx(E[3] - E[2], rel=1e-7)
