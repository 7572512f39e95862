"""Models with internal states: at rest, linearized, exact, alone, in lanes, in studies; beside independent programs."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from sympy import Abs, Rational, symbols

import qddot
from qddot.codegen.generate import generate
from qddot.model import Coordinate, Input, Parameter, State, System
from qddot.runner.equilibrium import EquilibriumError

half = Rational(1, 2)


# The recoil damper, its equations written by hand

GUN = {
    **{"m": 60.0, "k_r": 4e4, "alpha_a": 1.4e4, "alpha_b": 6.95e4, "c_0a": 2100.0, "c_0b": 350.0, "c_1a": 28300.0},
    **{"c_1b": 295.0, "k_0": 4690.0, "k_1": 500.0, "A": 301.0, "beta": 3.63e6, "gamma": 3.63e6, "eta": 190.0},
    **{"u_m": 2.25, "k_p": 40.0, "k_i": 100.0, "k_d": 3.0},
}
IMPULSE, DURATION = 30.0, 0.01


def shot(t):
    return IMPULSE * np.pi / (2 * DURATION) * np.sin(np.pi * t / DURATION) if t < DURATION else 0.0


def by_hand(t, state, p):
    x, x_dot, y, z, u, e = state
    command = min(max(p["k_p"] * x + p["k_i"] * e + p["k_d"] * x_dot, 0.0), p["u_m"])
    alpha, c_0, c_1 = (p[f"{name}a"] + p[f"{name}b"] * u for name in ("alpha_", "c_0", "c_1"))
    y_dot = (alpha * z + c_0 * x_dot + p["k_0"] * (x - y)) / (c_0 + c_1)
    v = x_dot - y_dot
    z_dot = p["A"] * v - p["gamma"] * abs(v) * abs(z) * z - p["beta"] * v * z**2
    x_ddot = (shot(t) - c_1 * y_dot - (p["k_r"] + p["k_1"]) * x) / p["m"]
    return [x_dot, x_ddot, y_dot, z_dot, p["eta"] * (command - u), x]


def reference(times, p=GUN):
    """States (n, 6) by SciPy, restarted where the shot ends."""
    settings = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14, "dense_output": True, "args": (p,)}
    first = solve_ivp(by_hand, (0.0, DURATION), np.zeros(6), **settings)
    then = solve_ivp(by_hand, (DURATION, times[-1]), first.y[:, -1], **settings)
    return np.array([(first if t <= DURATION else then).sol(t) for t in times])


@pytest.fixture(scope="module")
def gun():
    return qddot.load("recoil_damper")


@pytest.fixture(scope="module")
def force():
    return qddot.signal.pulse_train(times=[0.0], duration=DURATION, impulse=IMPULSE)


TIMES = np.linspace(0.0, 0.06, 13)


@pytest.fixture(scope="module")
def expected():
    return reference(TIMES)


def test_the_recoil_damper_has_the_constants_of_the_article(gun):
    assert {row.name: row.default for row in gun.tables.parameters} == GUN
    assert gun.state_names == ("x", "xdot", "y", "z", "u", "e")
    assert gun.coordinate_names == ("x",)


@pytest.mark.parametrize(
    ("method", "options", "accuracy"),
    [
        ("dop853", {"rtol": 1e-12, "atol": 1e-14}, 1e-11),
        ("ode15s", {"rtol": 1e-8, "atol": 1e-11}, 1e-4),
        ("taylor", {"rtol": 1e-12, "atol": 1e-14}, 1e-9),
        ("rk4", {"step": 2e-6, "every": 2500}, 1e-6),
    ],
)
def test_the_recoil_damper_does_what_scipy_computes(gun, force, expected, method, options, accuracy):
    wanted = {} if method == "rk4" else {"output_times": TIMES}
    run = qddot.simulate(gun, (0.0, TIMES[-1]), inputs={"F": force}, method=method, **wanted, **options)
    sizes = np.abs(expected).max(axis=0)
    assert np.abs((run.states[-1] - expected[-1]) / sizes).max() <= accuracy
    assert np.abs((run.states - expected) / sizes).max() <= max(accuracy, 1e-6)  # interpolated, by both
    command = np.clip(40.0 * run["x"] + 100.0 * run["e"] + 3.0 * run["xdot"], 0.0, 2.25)
    np.testing.assert_allclose(run["u_c"], command, rtol=1e-12, atol=1e-15)


def test_lanes_give_what_the_runs_alone_do(gun, force):
    voltages = np.linspace(0.0, 2.25, 9)
    settings = {"inputs": {"F": force}, "method": "tsit5", "rtol": 1e-8, "atol": 1e-10}
    batch = qddot.simulate_batch(gun, (0.0, 0.02), parameters={"u_m": voltages}, output_times=[0.02], **settings)
    for k in (0, 4, 8):
        found = [batch[name][k, -1] for name in gun.state_names]
        alone = qddot.simulate(gun, (0.0, 0.02), parameters={"u_m": voltages[k]}, **settings)
        np.testing.assert_allclose(found, alone.states[-1], rtol=1e-6)
        expected = reference([0.0, 0.02], GUN | {"u_m": voltages[k]})[-1]
        np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_a_study_starts_internal_states_where_it_says(tmp_path, gun):
    (tmp_path / "study.toml").write_text(
        'model = "recoil_damper"\nspan = [0, "20 ms"]\n[integration]\nmethod = "dop853"\n'
        '[initial]\nz = "2 mm"\nu = "500 mV"\n[inputs.F]\nkind = "constant"\nvalue = "0 N"\n'
    )
    run = qddot.read_study(tmp_path / "study.toml").run()
    np.testing.assert_array_equal(run.states[0], [0.0, 0.0, 0.0, 2e-3, 0.5, 0.0])
    assert run["x"][-1] < -1e-6  # the hysteresis pushes


# At rest

x, xdot, z, zdot, m, k, g, alpha, A, beta, T, F = symbols("x xdot z zdot m k g alpha A beta T F")


def hanging(folder, rate, **changes):
    """A mass that hangs from a spring and from what pulls with alpha z."""
    system = System(
        name="hanging",
        title="Hanging mass",
        coordinates=[Coordinate(x, "m", "height")],
        states=[State(z, rate, "m", "internal state")],
        parameters=[
            *(Parameter(m, 2.0, "kg", "mass"), Parameter(k, 50.0, "N/m", "spring"), Parameter(g, 9.81, "m/s^2", "g")),
            *(Parameter(alpha, 20.0, "N/m", "pull"), Parameter(A, 3.0, "1/s", "slope")),
        ],
        inputs=[Input(F, "N", "force")],
        kinetic_energy=half * m * xdot**2,
        potential_energy=half * k * x**2 + m * g * x,
        generalized_forces={x: F - alpha * z},
    )
    return qddot.load(generate(system, folder))


def test_a_filter_rests_where_its_rate_vanishes(tmp_path):
    model = hanging(tmp_path, A * (x - z))
    height = (5.0 - 2.0 * 9.81) / (50.0 + 20.0)
    np.testing.assert_allclose(qddot.equilibrium(model, inputs={"F": 5.0}), [height, 0.0, height], rtol=1e-12)
    run = qddot.simulate(model, (0.0, 3.0), inputs={"F": 5.0}, method="dop853")
    np.testing.assert_allclose(run["z"], height, rtol=1e-9)


def test_an_integral_rests_where_its_error_vanishes(tmp_path):
    model = hanging(tmp_path, A * (x - Rational(1, 10)))
    pull = -(50.0 * 0.1 + 2.0 * 9.81) / 20.0
    np.testing.assert_allclose(qddot.equilibrium(model), [0.1, 0.0, pull], rtol=1e-12)


@pytest.fixture(scope="module")
def hysteretic(tmp_path_factory):
    return hanging(tmp_path_factory.mktemp("hysteretic"), A * xdot - 9 * Abs(xdot) * Abs(z) * z)


@pytest.mark.parametrize("start", [0.0, 0.25])
def test_a_hysteresis_rests_at_the_guess(hysteretic, start):
    found = qddot.equilibrium(hysteretic, guess={"z": start})
    np.testing.assert_allclose(found, [-(2.0 * 9.81 + 20.0 * start) / 50.0, 0.0, start], rtol=1e-12)


def test_where_the_guess_rests_a_model_with_states_may_have_other_static_states(gun):
    np.testing.assert_array_equal(qddot.equilibrium(gun), np.zeros(6))
    with pytest.raises(EquilibriumError, match="not isolated: nothing holds"):
        qddot.equilibrium(gun, guess={"y": 1e-3})
    with pytest.raises(EquilibriumError, match="no static state found"):  # the integral of the travel grows
        qddot.equilibrium(gun, inputs={"F": 20.0})


def test_no_static_state_names_the_state(tmp_path):
    model = hanging(tmp_path, 1000 * A * (1 + (z / 1000) ** 2))
    with pytest.raises(EquilibriumError, match=r"no static state found at t = 0: z keeps a rate of \S+ m per s"):
        qddot.equilibrium(model)


# A wheel that trails behind its kingpin on a tyre that needs a way to build up its force

psi, psidot, F_y, J, a, C, V, sigma, M_z = symbols("psi psidot F_y J a C V sigma M_z")
WHEEL = {J: 12.0, k: 900.0, beta: 15.0, a: 0.06, C: 4.5e4, V: 20.0, sigma: 0.35}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """dF_y/dt = V/sigma (C slip - F_y), with the relaxation length sigma: Pacejka, Tyre and Vehicle Dynamics, ch. 5."""
    system = System(
        name="wheel",
        title="Trailing wheel with a relaxation length",
        coordinates=[Coordinate(psi, "rad", "steering angle")],
        states=[State(F_y, V / sigma * (C * (psi + a * psidot / V) - F_y), "N", "side force of the tyre")],
        parameters=[Parameter(symbol, value, "1", f"parameter {symbol}") for symbol, value in WHEEL.items()],
        inputs=[Input(M_z, "N m", "moment")],
        kinetic_energy=half * J * psidot**2,
        potential_energy=half * k * psi**2,
        dissipation=half * beta * psidot**2,
        generalized_forces={psi: M_z - a * F_y},
    )
    return qddot.load(generate(system, tmp_path_factory.mktemp("wheel")))


def wheel_matrix():
    inertia, stiffness, damping, arm, cornering, speed, length = WHEEL.values()
    return np.array(
        [
            [0.0, 1.0, 0.0],
            [-stiffness / inertia, -damping / inertia, -arm / inertia],
            [speed / length * cornering, arm * cornering / length, -speed / length],
        ]
    )


def test_modes_are_the_roots_of_the_characteristic_polynomial(wheel):
    inertia, stiffness, damping, arm, cornering, speed, length = WHEEL.values()
    # (J s^2 + c s + k)(s + V/sigma) + a C/sigma (V + a s) = 0
    cubic = np.polymul([inertia, damping, stiffness], [1.0, speed / length])
    cubic[-2:] += arm * cornering / length * np.array([arm, speed])
    roots = sorted((root for root in np.roots(cubic) if root.imag >= 0), key=abs)
    found = qddot.modes(wheel)
    np.testing.assert_allclose([mode.eigenvalue for mode in found], roots, rtol=1e-9)
    assert [mode.oscillating for mode in found] == [True, False]
    for mode in found:
        assert set(mode.participation) == {"psi", "F_y"}
        assert sum(mode.participation.values()) == pytest.approx(1.0)
    assert found[1].participation["F_y"] > 0.5


@pytest.mark.parametrize(("arm", "stable"), [(0.34, False), (0.36, True)])
def test_a_free_wheel_shimmies_where_its_trail_is_shorter_than_the_relaxation_length(wheel, arm, stable):
    """By Routh's criterion, for J s^3 + J V/sigma s^2 + a^2 C/sigma s + a C V/sigma: a > sigma = 0.35 m."""
    found = qddot.modes(wheel, {"k": 0.0, "beta": 0.0, "a": arm}, state=np.zeros(3))
    assert all(mode.stable for mode in found) == stable


def test_exact_propagation_of_a_linear_model_with_states(wheel):
    assert wheel.tables.linear
    times = np.linspace(0.0, 2.0, 41)
    start = np.array([0.02, -0.1, 300.0])
    run = qddot.simulate(wheel, (0.0, 2.0), initial=start, method="exact", output_times=times, inputs={"M_z": 40.0})
    system = np.zeros((4, 4))
    system[:3, :3], system[1, 3] = wheel_matrix(), 40.0 / WHEEL[J]
    expected = np.array([(expm(system * t) @ [*start, 1.0])[:3] for t in times])
    assert np.abs((run.states - expected) / np.abs(expected).max(axis=0)).max() <= 1e-11


def test_exact_batches_take_internal_states(wheel):
    moments = np.linspace(-50.0, 50.0, 9)
    batch = qddot.simulate_batch(
        wheel,
        (0.0, 0.5),
        method="exact",
        initial=np.zeros(3),
        inputs=[{"M_z": each} for each in moments],
        output_times=[0.5],
    )
    system = np.zeros((4, 4))
    system[:3, :3], system[1, 3] = wheel_matrix(), 1.0 / WHEEL[J]
    unit = (expm(system * 0.5) @ [0.0, 0.0, 0.0, 1.0])[2]
    np.testing.assert_allclose(batch["F_y"][:, -1], unit * moments, rtol=1e-10, atol=1e-12)
