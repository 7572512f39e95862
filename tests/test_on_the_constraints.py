"""Saved points, points between steps and points of events lie on the constraints to rounding, in every family."""

import numpy as np
import pytest
from mechanisms import HALF, parameters, slider_crank, spherical_pendulum
from sympy import Symbol, cos, sin, symbols

import qddot
from qddot.model import Coordinate, System
from qddot.runner.machine.memory import address
from qddot.runner.stiff.space import space_for

LENGTH, GRAVITY = 0.7, 9.81


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


@pytest.fixture(scope="module")
def pendulum(made):
    return made(spherical_pendulum())


def scaled(points):
    """The residuals of positions and of velocities by rod and speed, at points (n, 6)."""
    place, speed = points[:, :3], points[:, 3:]
    size = np.linalg.norm(speed, axis=1).max()
    on_rod = np.abs((place**2).sum(axis=1) / LENGTH**2 - 1.0)
    along = np.abs((place * speed).sum(axis=1)) / (LENGTH * size)
    return max(on_rod.max(), along.max())


def states(model, solution):
    return np.array([solution[name] for name in model.state_names]).T


WAYS = [
    ("euler", {"step": 1e-3}), ("rk4", {"step": 5e-3}), ("ode23", {"rtol": 1e-5}), ("ode45", {"rtol": 1e-3}),
    ("tsit5", {"rtol": 1e-6}), ("vern7", {"rtol": 1e-8}), ("dop853", {"rtol": 1e-10}), ("rodas5p", {"rtol": 1e-6}),
    ("ode15s", {"rtol": 1e-6}),
]  # fmt: skip


@pytest.mark.parametrize(("method", "options"), WAYS)
def test_residuals_are_rounding_over_100_s(pendulum, method, options):
    """However rough the tolerance is, and with it the run."""
    start = qddot.assemble(pendulum, {"x": 0.5, "y": 0.0, "ydot": 1.2, "xdot": 0.3}, guess={"z": -0.5})
    watched = [qddot.crossing(pendulum, "x", 0.1, called="passing")]
    times = np.linspace(0.0, 100.0, 2001)
    run = qddot.simulate(
        pendulum, (0.0, 100.0), initial=start, method=method, events=watched, output_times=times, **options
    )
    assert len(run.t) == 2001
    assert scaled(states(pendulum, run)) < 1e-10
    assert len(run.events.t) > 50
    assert scaled(run.events.states) < 1e-10


@pytest.mark.parametrize("method", ["dop853", "ode45", "ode15s", "rodas5p", "rk4"])
def test_points_between_the_steps_are_on_the_constraints(pendulum, method):
    start = qddot.assemble(pendulum, {"x": 0.5, "y": 0.0, "ydot": 1.2, "xdot": 0.3}, guess={"z": -0.5})
    options = {"step": 5e-3} if method == "rk4" else {"rtol": 1e-6}
    run = qddot.simulate(pendulum, (0.0, 5.0), initial=start, method=method, **options)
    between = run.at(np.random.default_rng(2).uniform(0.0, 5.0, 300))
    assert scaled(np.array([between[name] for name in pendulum.state_names]).T) < 1e-10


def test_ode15s_projects_before_its_error_test(made):
    """Its differences stay those of what it saved: on constraints it takes about the steps of the eliminated form."""
    model = made(slider_crank())
    eliminated = made(crank_alone())
    assert eliminated.tables.constraints == ()
    steps = []
    for each in (model, eliminated):
        start = {"alpha": 0.3, "alphadot": 1.0}
        if each is model:
            start = qddot.assemble(model, start, guess={"x": 0.4})
        run = qddot.simulate(each, (0.0, 2.0), initial=start, method="ode15s", rtol=1e-7, atol=1e-9)
        steps.append((run.statistics.steps, run["alpha"][-1]))
    (on_constraints, angle), (alone, expected) = steps
    assert abs(angle - expected) < 1e-4
    assert on_constraints < 1.3 * alone


def crank_alone():
    """The slider-crank of `mechanisms` by the angle of its crank."""
    alpha, adot, r, l_, m_1, m_2, m_3, c, M = symbols("alpha alphadot r l m_1 m_2 m_3 c M")
    across = r * sin(alpha) / l_  # the sine of the rod's angle, below
    lean = (1 - across**2) ** HALF
    turn = -r * cos(alpha) * adot / (l_ * lean)
    slide = -r * sin(alpha) * adot + l_ * across * turn
    right = -r * sin(alpha) * adot + l_ / 2 * across * turn
    up = r * cos(alpha) * adot + l_ / 2 * lean * turn
    return System(
        name="crank_alone",
        title="Slider-crank by one angle",
        coordinates=[Coordinate(alpha, "rad", "angle of the crank")],
        parameters=parameters(
            r=(0.1, "m"), l=(0.3, "m"), m_1=(1.0, "kg"), m_2=(0.8, "kg"), m_3=(0.6, "kg"), c=(20.0, "N s/m"),
            M=(2.0, "N m"),
        ),
        kinetic_energy=m_1 * r**2 * adot**2 / 6 + HALF * m_2 * (right**2 + up**2) + m_2 * l_**2 * turn**2 / 24
        + HALF * m_3 * slide**2,
        dissipation=HALF * c * slide**2,
        generalized_forces={Symbol("alpha"): M},
    )  # fmt: skip


@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
def test_all_that_a_stiff_run_points_to_is_kept(pendulum, method):
    """The constraints have places and values of their own, beside those of the Jacobian."""
    start = qddot.assemble(pendulum, {"x": 0.5, "y": 0.0}, guess={"z": -0.5})
    run = qddot.prepare(pendulum, (0.0, 1.0), initial=start, method=method)
    space, arrays = space_for(run.problem, run.options, 40)
    for name in ("places", "values"):
        assert space[name] == address(arrays[name])
        assert len(arrays[f"held {name}"]) != len(arrays[name])
