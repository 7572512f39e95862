"""Constraints held by Baumgarte's terms: what they do to a residual, and runs in lanes."""

import numpy as np
import pytest
from mechanisms import off, spherical_pendulum
from sympy import Symbol

import qddot
from qddot.model import Parameter


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    more = [Parameter(Symbol(name), value, "1/s", name) for name, value in (("alpha", 5.0), ("beta", 5.0))]
    parameters = [*spherical_pendulum().parameters, *more]
    held = spherical_pendulum(name="held", parameters=parameters, baumgarte=(Symbol("alpha"), Symbol("beta")))
    return qddot.load(qddot.generate(held, tmp_path_factory.mktemp("kernels")))


def start(model, angle=0.9):
    given = {"x": 0.7 * np.sin(angle), "y": 0.0, "xdot": 0.0, "ydot": 1.2}
    return qddot.assemble(model, given, guess={"z": -0.5})


def test_a_residual_dies_as_the_terms_say(model):
    """f'' + 2 alpha f' + beta^2 f = 0 of the accelerations at any state, on the constraint or off it."""
    x = start(model) + 1e-2 * np.arange(6)
    c, dx = model.constants(model.parameter_values({"alpha": 3.0, "beta": 4.0})), np.zeros(6)
    model.kernel("rhs")(0.0, x, np.zeros(1), c, dx)
    q, v, a = x[:3], x[3:], dx[3:]
    f, rate, second = q @ q - 0.49, 2 * q @ v, 2 * (v @ v + q @ a)
    assert second + 2 * 3.0 * rate + 16.0 * f == pytest.approx(0.0, abs=1e-12) and abs(f) > 1e-3


def test_the_state_drifts_within_what_the_terms_allow(model):
    x = start(model)
    free = {"alpha": 0.0, "beta": 0.0}
    drifting, held = (
        off(model, qddot.simulate(model, (0, 40), step=0.01, parameters=p, initial=x, every=10)) for p in (free, None)
    )
    assert 1e-13 < held[0] < 1e-6 < drifting[0]


def test_runs_go_in_lanes_and_are_those_of_a_run_alone(model):
    angles = [0.5, 0.9, 1.3]
    states = np.array([start(model, angle) for angle in angles])
    batch = qddot.simulate_batch(model, (0, 2), method="rk4", step=0.005, initial=states, output_times=5)
    assert batch.in_lanes
    for run, x in enumerate(states):
        alone = qddot.simulate(model, (0, 2), method="rk4", step=0.005, initial=x)
        assert batch["z"][run, -1] == pytest.approx(alone["z"][-1], rel=1e-11)
