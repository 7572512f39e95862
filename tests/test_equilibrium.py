import numpy as np
import pytest

from qddot.runner.equilibrium import EquilibriumError, equilibrium
from qddot.runner.inputs.shapes import sine
from qddot.runner.load import load
from qddot.runner.modes import modes
from qddot.runner.simulate import simulate


@pytest.fixture(scope="module")
def oscillator():
    return load("tests/sample_models/oscillator.py")


def test_spring_carries_weight_force_and_support(oscillator):
    x = equilibrium(oscillator, inputs={"F": 7.0, "z_1": 0.2})
    np.testing.assert_allclose(x, [0.2 + (7.0 - 2.0 * 9.81) / 50.0, 0.0], rtol=1e-14)


def test_input_rates_are_zero_at_rest(oscillator):
    support = sine(0.1, 2.0)
    x = equilibrium(oscillator, "weightless", {"z_1": support}, t0=0.03)
    np.testing.assert_allclose(x, [support(0.03), 0.0], rtol=1e-14)


def test_run_from_equilibrium_stays_there(oscillator):
    run = simulate(oscillator, (0, 10), step=1e-2)
    np.testing.assert_allclose(run["q_1"], -2.0 * 9.81 / 50.0, rtol=1e-13)


def test_no_equilibrium_names_the_coordinate(oscillator):
    with pytest.raises(EquilibriumError, match=r"no static state found at t = 0: q_1 keeps an acceleration of -9\.81"):
        equilibrium(oscillator, {"k_1": 0.0})


def test_equilibrium_that_is_not_isolated_names_what_is_free(oscillator):
    with pytest.raises(EquilibriumError, match="not isolated: nothing holds q_1"):
        equilibrium(oscillator, {"k_1": 0.0, "g": 0.0})


def test_m113_rests_with_its_weight_on_its_wheels():
    model = load("m113")
    x = equilibrium(model, "as_run_unloaded")
    dx, c = np.zeros(14), model.constants(model.parameter_values("as_run_unloaded"))
    model.kernel("rhs")(0.0, x, np.zeros(len(model.tables.inputs)), c, dx)
    assert np.abs(dx).max() < 1e-10
    assert (x[:6] < 0).all()


def test_pendulum_is_found_hanging_from_a_nearby_guess():
    model = load("pendulum")
    n = len(model.coordinate_names)
    x = equilibrium(model, guess=np.full(2 * n, 0.3))
    dx, c = np.zeros(2 * n), model.constants(model.parameter_values())
    model.kernel("rhs")(0.0, x, np.zeros(max(1, len(model.tables.inputs))), c, dx)
    assert np.abs(dx).max() < 1e-10


def test_cart_without_a_spring_has_no_isolated_equilibrium():
    with pytest.raises(EquilibriumError, match="nothing holds"):
        equilibrium(load("cart_pole"))


def test_mode_of_the_oscillator_is_the_textbooks(oscillator):
    (mode,) = modes(oscillator)
    damping = 1.5 / (2 * np.sqrt(50.0 * 2.0))
    assert mode.oscillating
    assert mode.stable
    assert mode.natural_frequency == pytest.approx(5.0, rel=1e-12)
    assert mode.damping_ratio == pytest.approx(damping, rel=1e-12)
    assert mode.damped_period == pytest.approx(2 * np.pi / (5.0 * np.sqrt(1 - damping**2)), rel=1e-12)
    assert mode.participation == {"q_1": pytest.approx(1.0)}


def test_overdamped_oscillator_has_two_real_modes(oscillator):
    pair = modes(oscillator, {"b_1": 100.0})
    assert [mode.oscillating for mode in pair] == [False, False]
    np.testing.assert_allclose([mode.eigenvalue.real for mode in pair], np.sort(np.roots([2, 100, 50]))[::-1])


@pytest.mark.parametrize(
    ("parameters", "periods"), [("as_run_unloaded", (1.848, 1.081)), ("as_run_loaded", (2.012, 1.115))]
)
def test_periods_of_the_m113_hull_are_those_of_the_paper(parameters, periods):
    slowest = modes(load("m113"), parameters)[:2]
    assert [round(mode.damped_period, 3) for mode in slowest] == list(periods)
    assert all(sum(mode.participation.values()) == pytest.approx(1.0) for mode in slowest)
    hull = [mode.participation["q_6"] + mode.participation["q_7"] for mode in slowest]
    assert min(hull) > 0.9
