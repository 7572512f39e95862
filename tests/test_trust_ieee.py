"""Divisions by zero and other numbers that are none: every caller of a kernel says what they mean."""

from pathlib import Path

import numpy as np
import pytest
from numba import njit, types
from scipy.integrate import solve_ivp
from sympy import Abs, Rational, Symbol, cos, sin, sqrt, symbols

import qddot
from qddot.model.system import Coordinate, Output, Parameter, System
from qddot.runner import abi

SAMPLE = Path("tests/sample_models/oscillator.py")
x, xdot, y, ydot, r, rdot = symbols("x xdot y ydot r rdot")
theta, thetadot, phi, phidot, psi, psidot = symbols("theta thetadot phi phidot psi psidot")
m, k, c, length, g = symbols("m k c l g")
half = Rational(1, 2)


def parameters(**values):
    return tuple(Parameter(Symbol(name), value, "1", name) for name, value in values.items())


def lengths(*names):
    return tuple(Coordinate(name, "m", f"place {name}") for name in names)


SYSTEMS = (
    System(
        name="falling",
        title="Mass pulled to a centre",
        coordinates=lengths(r),
        parameters=parameters(m=1.0, k=1.0),
        kinetic_energy=half * m * rdot**2,
        potential_energy=-k * m / r,
    ),
    System(
        name="sticky",
        title="Drag that grows with the root of the speed; an output that is 0/0 at rest",
        coordinates=lengths(x),
        parameters=parameters(m=1.0, k=1.0, c=0.1),
        kinetic_energy=half * m * xdot**2,
        potential_energy=half * k * x**2,
        dissipation=c * Abs(xdot) ** Rational(3, 2),
        outputs=(Output(Symbol("lead"), x / xdot, "s", "place over rate"),),
    ),
    System(
        name="rubber",
        title="Mass that hangs on a spring in a plane",
        coordinates=lengths(x, y),
        parameters=parameters(m=2.0, k=50.0, l=1.0, g=10.0),
        kinetic_energy=half * m * (xdot**2 + ydot**2),
        potential_energy=half * k * (sqrt(x**2 + y**2) - length) ** 2 + m * g * y,
    ),
    System(
        name="top",
        title="Symmetric top on its tip",
        coordinates=tuple(
            Coordinate(angle, "rad", meaning)
            for angle, meaning in ((phi, "precession"), (theta, "nutation"), (psi, "spin"))
        ),
        parameters=parameters(m=1.0, g=10.0, l=0.1, k=0.02, c=0.01),
        kinetic_energy=half * k * (thetadot**2 + phidot**2 * sin(theta) ** 2)
        + half * c * (psidot + phidot * cos(theta)) ** 2,
        potential_energy=m * g * length * cos(theta),
    ),
    System(
        name="drifting",
        title="Free mass",
        coordinates=lengths(x),
        parameters=parameters(m=1.0),
        kinetic_energy=half * m * xdot**2,
    ),
)


@pytest.fixture(scope="session")
def models(tmp_path_factory):
    folder = tmp_path_factory.mktemp("singular")
    return {system.name: qddot.load(qddot.generate(system, folder)) for system in SYSTEMS}


def test_a_module_whose_kernels_raise_at_a_division_by_zero_is_to_be_generated_again(tmp_path):
    path = tmp_path / "old.py"
    path.write_text(SAMPLE.read_text().replace(', error_model="numpy"', ""))
    with pytest.raises(qddot.LoadError, match=r"old\.py: kernel 'constants' raises at a division by zero.*again"):
        qddot.load(path)


NO_STATIC_STATE = {
    "falling": r"the acceleration of r is not finite at rest at r = 0 m, where the search starts; start it elsewhere",
    "rubber": r"the acceleration of x, y is not finite at rest at x = 0 m, y = 0 m, where the search starts",
    "top": r"where the search starts: the mass matrix is singular \(rank 2 of 3\): no inertia resists phi, psi; start",
    "drifting": r"the static state is not isolated: nothing holds x; give the initial state",
}


@pytest.mark.parametrize("ask", [qddot.equilibrium, qddot.modes, lambda model: qddot.simulate(model, (0, 1), step=0.1)])
@pytest.mark.parametrize("name", NO_STATIC_STATE)
def test_a_model_without_a_static_state_is_told_why(models, name, ask):
    with pytest.raises(qddot.EquilibriumError, match=NO_STATIC_STATE[name]):
        ask(models[name])


@pytest.mark.parametrize("guess", [{"y": -2.0}, [0.1, -2.0, 0.0, 0.0]])
def test_the_search_for_a_static_state_starts_where_it_is_told_to(models, guess):
    sag = -(1.0 + 2.0 * 10.0 / 50.0)
    found = qddot.equilibrium(models["rubber"], guess=guess)
    np.testing.assert_allclose(found, [0.0, sag, 0.0, 0.0], atol=1e-9)
    upright = qddot.equilibrium(models["rubber"], guess={"y": 0.7})
    np.testing.assert_allclose(upright, [0.0, 0.6, 0.0, 0.0], atol=1e-9)


def test_a_run_starts_at_the_static_state_near_the_guess(models):
    run = qddot.prepare(models["rubber"], (0, 1), step=0.1, guess={"y": -2.0})
    np.testing.assert_allclose(run.problem.initial_state, [0.0, -1.4, 0.0, 0.0], atol=1e-9)


def test_each_run_of_a_batch_starts_at_the_static_state_near_its_guess(models):
    batch = qddot.simulate_batch(models["rubber"], (0, 1e-3), step=1e-3, guess={"y": [-2.0, 0.7]})
    np.testing.assert_allclose(batch.final, [[0.0, -1.4, 0.0, 0.0], [0.0, 0.6, 0.0, 0.0]], atol=1e-9)
    one = qddot.simulate_batch(models["rubber"], (0, 1e-3), step=1e-3, guess=[0.1, -2.0, 0.0, 0.0])
    np.testing.assert_allclose(one.final, [[0.0, -1.4, 0.0, 0.0]], atol=1e-9)
    with pytest.raises(ValueError, match="unknown coordinate 'ydot'"):
        qddot.simulate_batch(models["rubber"], (0, 1e-3), step=1e-3, guess={"ydot": 1.0})
    with pytest.raises(ValueError, match="initial and guess are both given"):
        qddot.simulate_batch(models["rubber"], (0, 1e-3), step=1e-3, initial={"y": 1.0}, guess={"y": 1.0})


@pytest.mark.parametrize(
    ("guess", "message"),
    [
        ({"z": 1.0}, "model rubber: guess: unknown coordinate 'z'"),
        ({"ydot": 1.0}, "model rubber: guess: unknown coordinate 'ydot'"),
        ({"y": np.nan}, "model rubber: guess of y is nan, expected a finite number"),
        ([1.0, 2.0], r"model rubber: guess has shape \(2,\), expected \(4,\)"),
    ],
)
def test_a_guess_that_is_none_is_refused(models, guess, message):
    with pytest.raises(ValueError, match=message):
        qddot.equilibrium(models["rubber"], guess=guess)


def test_a_guess_beside_an_initial_state_is_refused(models):
    with pytest.raises(ValueError, match="initial and guess are both given"):
        qddot.simulate(models["rubber"], (0, 1), step=0.1, initial={"y": 1.0}, guess={"y": 1.0})


def test_a_state_without_a_linear_neighbourhood_has_no_modes(models):
    assert qddot.equilibrium(models["sticky"]).tolist() == [0.0, 0.0]
    with pytest.raises(qddot.ModesError, match="derivative of the rate of xdot by xdot is -inf at this state"):
        qddot.modes(models["sticky"])


@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
def test_stiff_methods_start_where_the_exact_jacobian_is_infinite(models, method):
    def slope(t, state):
        return [state[1], -state[0] - 0.15 * np.sign(state[1]) * np.sqrt(abs(state[1]))]

    reference = solve_ivp(slope, (0, 1), [1.0, 0.0], rtol=1e-10, atol=1e-12)
    run = qddot.simulate(models["sticky"], (0, 1), method=method, initial={"x": 1.0}, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(run.states[-1], reference.y[:, -1], rtol=2e-5)


def test_an_output_that_is_no_number_is_one_in_the_solution(models):
    run = qddot.simulate(models["sticky"], (0, 1), method="ode15s", initial={"x": 0.0}, output_times=[0.5])
    assert np.isnan(run["lead"]).all()
    assert (run["x"] == 0.0).all()


def test_an_event_of_an_output_that_is_no_number_does_not_happen(models):
    crossing = qddot.crossing(models["sticky"], "lead", 0.5)
    run = qddot.simulate(models["sticky"], (0, 1), method="ode15s", initial={"x": 0.0}, events=[crossing])
    assert run.success
    assert len(run.events.t) == 0


@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
def test_a_division_by_zero_ends_a_stiff_run_with_time_and_state(models, method):
    with pytest.raises(qddot.IntegrationError, match=r"at t = 0 s.*rdot left first"):
        qddot.simulate(models["falling"], (0, 1), method=method, initial={"r": 0.0})


@njit
def inverse(t, x, u, c, dx):
    """Compiled by Python's rules: a division by zero raises."""
    dx[0] = -1.0 / x[0]


@njit(types.float64(abi.SCALAR, abi.VECTOR, abi.VECTOR, abi.VECTOR))
def reciprocal(t, x, u, c):
    """Compiled by Python's rules: a division by zero raises."""
    return 1.0 / x[0]


@pytest.mark.parametrize("settings", [{"method": "euler", "step": 0.5}, {"method": "ode15s"}])
def test_a_division_by_zero_in_a_function_of_the_users_own_ends_the_run(settings):
    with pytest.raises(qddot.IntegrationError, match="inverse diverged at t = 0 s") as caught:
        qddot.solve(inverse, (0, 1), [0.0], **settings)
    assert caught.value.solution.states[-1].tolist() == [0.0]


def test_a_division_by_zero_in_an_event_of_the_users_own_ends_the_run(models):
    with pytest.raises(qddot.IntegrationError, match="sticky diverged at t = 0 s"):
        qddot.simulate(models["sticky"], (0, 1), method="ode15s", events=[qddot.Event(reciprocal)])
