"""Runs that fail say so first, and why; what they leave is marked as partial; waiting for the compiler is told."""

import numpy as np
import pytest
import xarray
from commands import command
from sympy import Rational, Symbol, cos, sign, sin, symbols

import qddot
from qddot.model.system import Coordinate, Input, Output, Parameter, System
from qddot.runner.batch.results import Results
from qddot.runner.jumps import jump
from qddot.runner.metrics.measure import Request, measure
from qddot.runner.problem import Status
from qddot.runner.report.batch_tables import valueless
from qddot.runner.tables import Quantity

x, xdot, v, f = symbols("x xdot v F")
theta, thetadot, phi, phidot = symbols("theta thetadot phi phidot")
half = Rational(1, 2)
PLACE = (Coordinate(x, "m", "place"),)
SYSTEMS = (
    System(
        name="runaway",
        title="Mass that a spring pushes away; an output that is 0/0 at rest",
        coordinates=PLACE,
        parameters=(Parameter(Symbol("m"), 1.0, "kg", "mass"), Parameter(Symbol("k"), -900.0, "N/m", "stiffness")),
        kinetic_energy=half * Symbol("m") * xdot**2,
        potential_energy=half * Symbol("k") * x**2,
        outputs=(Output(Symbol("lead"), x / xdot, "s", "place over rate"),),
    ),
    System(
        name="sticking",
        title="Block on a dry floor",
        coordinates=PLACE,
        parameters=(Parameter(Symbol("m"), 1.0, "kg", "mass"), Parameter(Symbol("mu"), 3.0, "N", "friction")),
        kinetic_energy=half * Symbol("m") * xdot**2,
        inputs=(Input(f, "N", "force"),),
        generalized_forces={x: f - Symbol("mu") * sign(xdot)},
    ),
    System(
        name="swinging",
        title="Spherical pendulum",
        coordinates=(Coordinate(theta, "rad", "angle from below"), Coordinate(phi, "rad", "angle about the vertical")),
        parameters=(Parameter(Symbol("g"), 9.81, "m/s^2", "gravity"),),
        kinetic_energy=half * (thetadot**2 + phidot**2 * sin(theta) ** 2),
        potential_energy=-Symbol("g") * cos(theta),
    ),
)


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("failing")


@pytest.fixture(scope="session")
def models(folder):
    return {system.name: qddot.load(qddot.generate(system, folder)) for system in SYSTEMS}


STUDY = """model = "runaway.py"
title = "A runaway"
span = [0, 10]
initial = { x = "1 m" }

[integration]
method = "rk4"
step = "10 ms"
"""


@pytest.fixture(scope="session")
def ran(models, folder):
    (folder / "runaway.toml").write_text(STUDY)
    return [command("run", "runaway.toml", "--into", "results", "--no-figure", cwd=folder) for _ in range(2)]


def test_a_run_that_diverged_is_reported_as_failed_before_any_table(ran, folder):
    first, _ = ran
    assert first.returncode == 1
    assert "error: runaway diverged at t = " in first.stderr
    assert "A runaway (partial: up to t = " in first.stdout
    with xarray.open_dataset(folder / "results" / "runaway.nc") as data:
        assert data.attrs["status"] == "NON_FINITE"
        assert data.attrs["partial"] == "yes"
        assert data.attrs["failed_state"] in ("x", "xdot")
        # cosh(30 t) passes 1e100 at ln(2e100)/30 = 7.70 s; its rate, 30 times as large, a little before
        assert data.attrs["failed_at"] == pytest.approx(np.log(2e100) / 30, rel=0.02)
        assert "diverged" in data.attrs["message"]


def test_the_figure_of_a_partial_run_says_so(models, folder, tmp_path, capsys):
    from qddot.runner.commands.run import run

    drawn = []

    class Drawing:
        def begin(self, picture, path):
            drawn.append(picture)

        def finish(self):
            pass

    assert run(folder / "runaway.toml", tmp_path, Drawing(), [], None) == 1
    assert drawn[0].title.startswith("A runaway (partial: up to t = ")


def test_compiling_is_told_once_and_warm_runs_are_silent(ran):
    cold, warm = ran
    assert cold.stderr.count("compiling, once for this model and method") == 1
    assert "; compiled once in " in cold.stdout
    assert "compil" not in warm.stderr + warm.stdout


def test_the_wall_time_of_a_run_is_that_of_integrating(ran):
    took = [float(each.stdout.split(" points, ")[1].split(" ms")[0]) for each in ran]
    assert max(took) < 200.0


def test_an_output_that_is_no_number_is_told_and_kept(models, folder):
    (folder / "still.toml").write_text(STUDY.replace('x = "1 m"', 'x = "0 m"').replace("A runaway", "Still"))
    told = command("run", "still.toml", "--into", "results", "--no-figure", cwd=folder)
    assert told.returncode == 0, told.stderr
    assert "note: lead is no finite number at 1001 of 1001 points, first nan at 0 s" in told.stdout
    with xarray.open_dataset(folder / "results" / "still.nc") as data:
        assert np.isnan(data["lead"]).all()
        assert "partial" not in data.attrs


def test_show_goes_on_without_a_static_state(models, folder):
    told = command("show", "sticking.py", cwd=folder)
    assert told.returncode == 0, told.stderr
    assert "friction" in told.stdout
    assert "No modes with default parameters: model sticking: the static state is not isolated" in told.stdout
    told = command("show", "swinging.py", cwd=folder)
    assert told.returncode == 0, told.stderr
    assert "the mass matrix is singular (rank 1 of 2): no inertia resists phi" in told.stdout


@pytest.mark.parametrize("method", ["ode45", "ode15s"])
def test_a_solution_that_sticks_is_told_with_the_quantity(models, method):
    with pytest.raises(
        qddot.IntegrationError, match=r"the rate of xdot jumps by 6 m/s per s where xdot passes .* m/s, "
    ):
        qddot.simulate(
            models["sticking"], (0, 10), method=method, initial={"xdot": 1.0}, inputs={"F": 1.0}, max_steps=2000,
            switching="ignore",
        )  # fmt: skip


def test_a_run_into_a_singular_mass_matrix_says_so(models):
    with pytest.raises(
        qddot.IntegrationError, match=r"the mass matrix is singular \(rank 1 of 2\): .* resists phi; start"
    ):
        qddot.simulate(models["swinging"], (0, 1), step=1e-2, initial={"phidot": 1.0})


def test_a_smooth_right_hand_side_jumps_nowhere():
    def slope(state):
        return np.array(
            [state[1], -9.81 * np.sin(state[0]) - 0.1 * state[1] * abs(state[1]) + 1e4 * max(state[0], 0.0)]
        )

    rng = np.random.default_rng(5)
    states = rng.normal(size=(200, 2)) * [2.0, 5.0]
    assert all(jump(slope, state, 1.5 * np.abs(state)) is None for state in states)


@pytest.mark.parametrize("distance", [0.0, 1e-3, 1e-8])
def test_a_jump_is_found_with_the_state_that_passes_it(distance):
    def slope(state):
        return np.array([state[1], 1.0 - 3.0 * np.sign(state[1]) - state[0]])

    assert jump(slope, np.array([0.5, distance]), np.ones(2)) == pytest.approx((1, 1, 6.0))
    assert jump(slope, np.array([0.5, 0.6]), np.ones(2)) is None


def test_one_run_without_a_static_state_fails_alone(models):
    batch = qddot.simulate_batch(
        models["runaway"], (0, 0.1), step=1e-2, parameters={"k": [4.0, 0.0, 9.0]}, output_times=3, threads=1
    )
    assert batch.status.tolist() == [Status.FINISHED, Status.NOT_STARTED, Status.FINISHED]
    assert "nothing holds x" in batch.not_started[1]
    assert np.isnan(batch.final[1]).all()
    assert (batch.final[[0, 2]] == 0.0).all()
    with pytest.raises(qddot.EquilibriumError, match=r"run 0: .*nothing holds x"):
        qddot.simulate_batch(models["runaway"], (0, 0.1), step=1e-2, parameters={"k": [0.0, 0.0]})


SWEEP = """
[sweep]
axes = [{ key = "parameters.k", values = ["4 N/m", "0 N/m", "9 N/m"] }, { key = "span", values = [[0, 1]] }]

[metrics.lag]
kind = "max"
of = "lead"
[metrics.far]
kind = "max"
of = "x"
"""


def test_a_sample_that_is_no_number_gives_a_metric_that_is_none():
    times = np.linspace(0.0, 1.0, 11)
    asked = measure("far", Request("max", of="x", after=0.5), [Quantity("x", "m", "")], times)
    values = np.linspace(0.0, 3.0, 11)[:, None]
    assert asked(values) == pytest.approx(3.0)
    values[2] = np.nan  # before the window
    assert asked(values) == pytest.approx(3.0)
    values[7] = np.nan
    assert np.isnan(asked(values))


def test_a_batch_tells_of_metrics_without_a_value(models, folder):
    text = STUDY.replace('initial = { x = "1 m" }\n', "").replace("[0, 10]", "[0, 1]")
    (folder / "sweep.toml").write_text(text + SWEEP.replace(', { key = "span", values = [[0, 1]] }', ""))
    results = Results(qddot.run_batch(folder / "sweep.toml", folder / "sweep.zarr"))
    assert results.status.tolist() == [1, 100, 1]
    assert "nothing holds x" in results.failures()[0][1]
    assert results.column("far")[[0, 2]].tolist() == [0.0, 0.0]
    assert np.isnan(results.column("lag")).all()
    assert valueless(results) == ["lag has no value in 2 finished runs, first in run 0: a sample is no finite number"]
