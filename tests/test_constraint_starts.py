"""Where a mechanism starts: assembled from part of its state, at rest, linearised; alone, in batches, from a study."""

from pathlib import Path

import numpy as np
import pytest
from mechanisms import off, spherical_pendulum
from sympy import Symbol

import qddot
from qddot.model import Parameter


@pytest.fixture(scope="module")
def four_bar():
    return qddot.load("four_bar")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


def residuals(model, x, parameters=None):
    c = model.constants(model.parameter_values(parameters))
    n = model.tables.coordinates
    whole = model.matrix("constraints")(0.0, np.asarray(x), np.zeros(1), c)
    return np.abs(whole[n:, n:]).max()


@pytest.mark.parametrize(("guess", "coupler"), [((0.6, 1.5), 0.6062236719), ((-0.7, -1.5), -1.0505398844)])
def test_both_assemblies_of_a_four_bar(four_bar, guess, coupler):
    x = qddot.assemble(four_bar, {"theta_1": 0.5, "thetadot_1": 3.0}, guess={"theta_2": guess[0], "theta_3": guess[1]})
    assert x[0] == pytest.approx(0.5, abs=1e-15) and x[3] == pytest.approx(3.0, abs=1e-14)
    assert x[1] == pytest.approx(coupler, abs=1e-8) and residuals(four_bar, x) < 1e-14


def test_what_is_not_given_moves_no_farther_than_it_must(made):
    """A pendulum of which nothing is given swings straight out to its sphere."""
    model = made(spherical_pendulum())
    x = qddot.assemble(model, guess={"x": 0.3, "y": 0.0, "z": -0.4, "xdot": 1.0})
    assert np.allclose(x[:3], [0.42, 0.0, -0.56], atol=1e-12)
    assert np.allclose(x[3:], [1.0 - 0.36, 0.0, 0.48], atol=1e-12)  # what is tangential of the velocity


def test_a_whole_state_is_rounded_onto_the_constraints(made):
    model = made(spherical_pendulum())
    x = qddot.assemble(model, np.array([0.4949747, 0.0, -0.4949747, 0.0, 1.0, 0.0]))
    assert residuals(model, x) < 1e-15 and np.allclose(x[:3], [0.4949747, 0.0, -0.4949747], atol=1e-7)


def test_a_whole_state_on_the_constraints_is_taken_as_it_is(four_bar):
    """To rounding: nothing is sought where there is nothing to be found, and no bit changes."""
    x = qddot.assemble(four_bar, {"theta_1": 0.4, "thetadot_1": 3.0}, guess={"theta_2": 0.6, "theta_3": 1.5})
    for state in (x, np.nextafter(x, 10.0)):
        assert np.array_equal(qddot.assemble(four_bar, state), state)
    moved = x + 1e-9
    assert 0 < np.abs(qddot.assemble(four_bar, moved) - moved).max() < 1e-8


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"theta_1": 0.5, "theta_2": 0.3, "theta_3": 1.0},
            "theta_1 = 0.5, theta_2 = 0.3, theta_3 = 1 contradict the con",
        ),
        ({"theta_1": 0.5, "theta_2": 2.5}, "contradict the constraint.*lam_[xy] .force in the pin"),
        ({"theta_1": 0.5, "thetadot_1": 1.0, "thetadot_2": 5.0}, "whose velocity is off by"),
        ({"theta": 0.5}, "unknown state 'theta'; did you mean 'theta"),
    ],
)
def test_values_that_contradict_each_other(four_bar, given, said):
    with pytest.raises(ValueError, match=f"model four_bar: .*{said}"):
        qddot.assemble(four_bar, given, guess={"theta_2": 0.6, "theta_3": 1.5} if len(given) < 3 else None)


def test_constraints_that_cannot_be_met_are_named(four_bar):
    with pytest.raises(qddot.AssemblyError, match=r"no position fulfils the constraint.*lam_x .* check the parameters"):
        qddot.assemble(four_bar, parameters={"d": 2.0}, guess={"theta_1": 0.1})
    with pytest.raises(ValueError, match="theta_3 = 2 contradict"):
        qddot.simulate(four_bar, (0, 1), step=1e-3, initial={"theta_1": 2.0, "theta_2": 2.0, "theta_3": 2.0})


def test_rest_and_modes_of_a_pendulum_on_its_sphere(made):
    damping = Symbol("c") * sum(Symbol(f"{q}dot") ** 2 for q in "xyz") / 2
    more = [*spherical_pendulum().parameters, Parameter(Symbol("c"), 0.3, "N s/m", "air")]
    model = made(spherical_pendulum(dissipation=damping, parameters=more, name="damped_pendulum"))
    x = qddot.equilibrium(model, guess={"x": 0.1, "y": -0.2, "z": -0.5})
    assert np.allclose(x, [0.0, 0.0, -0.7, 0.0, 0.0, 0.0], atol=1e-9)
    found = qddot.modes(model, state=x)
    assert [mode.natural_frequency for mode in found] == pytest.approx([np.sqrt(9.81 / 0.7)] * 2, rel=1e-9)
    assert [mode.damping_ratio for mode in found] == pytest.approx(
        [0.3 / (2 * 1.5) / np.sqrt(9.81 / 0.7)] * 2, rel=1e-8
    )
    assert found[0].participation["z"] == pytest.approx(0.0, abs=1e-9)


def test_modes_of_the_four_bar_are_those_of_its_one_degree(four_bar):
    """The frequency by the curvature of the potential over the mass, both by differences along the constraints."""
    x = qddot.equilibrium(four_bar, guess={"theta_1": -1.5, "theta_2": 0.9, "theta_3": 1.9})
    found = qddot.modes(four_bar, state=x)
    assert len(found) == 1

    def energies(shift, speed):
        near = qddot.assemble(four_bar, {"theta_1": x[0] + shift, "thetadot_1": speed}, guess=x)
        values, c = np.zeros(4), four_bar.constants(four_bar.parameter_values())
        four_bar.kernel("energy")(0.0, near, np.zeros(1), c, values)
        return values

    h = 1e-3
    curvature = (energies(h, 0)[1] - 2 * energies(0, 0)[1] + energies(-h, 0)[1]) / h**2
    omega = found[0].eigenvalue
    assert -(omega**2).real == pytest.approx(curvature / (2 * energies(0, 1.0)[0]), rel=1e-4)


def test_batches_start_assembled_and_end_as_single_runs(four_bar):
    starts = np.array([0.3, 0.4, 0.5])
    near = {"theta_2": 0.6, "theta_3": 1.5}
    batch = qddot.simulate_batch(
        four_bar, (0, 0.5), method="rk4", step=1e-3, initial={"theta_1": starts}, guess=near, output_times=6,
        names=["theta_2", "lam_x"],
    )  # fmt: skip
    assert not batch.in_lanes and "has constraints, on which each run is kept by itself" in batch.reason
    for run, start in enumerate(starts):
        alone = qddot.simulate(four_bar, (0, 0.5), step=1e-3, initial={"theta_1": start}, guess=near)
        for name in ("theta_2", "lam_x"):
            assert batch[name][run, -1] == pytest.approx(alone[name][-1], rel=1e-12)
    with pytest.raises(qddot.AssemblyError, match="run 0: "):
        qddot.simulate_batch(four_bar, (0, 0.5), step=1e-3, initial={"theta_1": starts, "theta_2": 9.0, "theta_3": 9.0})


def test_a_study_assembles(tmp_path):
    study = qddot.read_study("studies/four_bar.toml")
    found = study.run()
    assert found["theta_1"][0] == pytest.approx(np.deg2rad(20)) and found["theta_2"][0] > 0.3
    assert off(study.model, found, study.arguments["parameters"]).max() < 1e-12
    other = study.changed({"assemble.theta_2": "-40 deg", "assemble.theta_3": "-90 deg"}).run(span=(0, 0.1))
    assert other["theta_2"][0] < 0
    text = Path("studies/four_bar.toml").read_text()
    (tmp_path / "wrong.toml").write_text(text.replace('model = "four_bar"', 'model = "cart_pole"'))
    with pytest.raises(qddot.StudyError, match="unknown parameter"):
        qddot.read_study(tmp_path / "wrong.toml").run()
