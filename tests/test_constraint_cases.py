"""Mechanisms held together by constraints, each beside an independent program or a published number."""

import numpy as np
import pytest
from mechanisms import off, parallel_cranks, rolling_disc, satellite, slider_crank, spherical_pendulum
from scipy.integrate import solve_ivp

import qddot
from benchmarks.cases.mechanism import SQUEEZER_START, squeezer


@pytest.fixture(params=["dop853", "taylor"])
def tight(request):
    """Each by a Runge-Kutta method and by series, whose multipliers are found order by order."""
    return {"method": request.param, "rtol": 1e-11, "atol": 1e-12}


def reference(f, span, x0):
    """The state at the end, by SciPy at 1e-12."""
    return solve_ivp(f, span, x0, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


def one_degree(mass, potential, force=lambda q, v: 0.0):
    """q'' of one degree of freedom from T = mass(q) v^2 / 2 and a potential, by complex steps."""

    def f(t, x):
        q, v = x
        slope, pull = (function(q + 1e-20j).imag / 1e-20 for function in (mass, potential))
        return v, (force(q, v) - 0.5 * slope * v**2 - pull) / mass(q).real

    return f


def four_bar_of_one_angle(l_1=0.3, l_2=0.8, l_3=0.6, d=0.9, m=(1.0, 2.0, 1.5), g=9.81):
    """Angles of coupler and rocker, and their slopes, as analytic functions of the crank's angle."""

    def angles(q):
        x, y = d - l_1 * np.cos(q), -l_1 * np.sin(q)
        square = x * x + y * y
        size = np.sqrt(square)
        toward = np.arctan(y / x)  # x > 0
        q_2 = toward + np.arccos((square + l_2**2 - l_3**2) / (2 * l_2 * size))
        q_3 = toward + np.pi - np.arccos((square + l_3**2 - l_2**2) / (2 * l_3 * size))
        return q_2, q_3

    def slopes(q):
        q_2, q_3 = angles(q)
        return l_1 * np.sin(q_3 - q) / (l_2 * np.sin(q_2 - q_3)), l_1 * np.sin(q_2 - q) / (l_3 * np.sin(q_2 - q_3))

    def mass(q):
        (q_2, _), (k_2, k_3) = angles(q), slopes(q)
        middle = l_1**2 + l_1 * l_2 * k_2 * np.cos(q - q_2) + l_2**2 * k_2**2 / 4
        return m[0] * l_1**2 / 3 + m[1] * (middle + l_2**2 * k_2**2 / 12) + m[2] * l_3**2 * k_3**2 / 3

    def potential(q):
        q_2, q_3 = angles(q)
        heights = l_1 / 2 * np.sin(q), l_1 * np.sin(q) + l_2 / 2 * np.sin(q_2), l_3 / 2 * np.sin(q_3)
        return g * sum(each * height for each, height in zip(m, heights, strict=True))

    return angles, one_degree(mass, potential)


def test_four_bar_beside_its_eliminated_form(tight):
    model = qddot.load("four_bar")
    angles, f = four_bar_of_one_angle()
    start = qddot.assemble(model, {"theta_1": 0.4, "thetadot_1": 9.0}, guess={"theta_2": 0.6, "theta_3": 1.5})
    assert np.allclose(start[1:3], np.real(angles(0.4 + 0j)), atol=1e-14)
    found = qddot.simulate(model, (0, 5), initial=start, **tight)
    q, v = reference(f, (0, 5), [0.4, 9.0])
    assert np.isclose(found["theta_1"][-1], q, rtol=1e-8) and np.isclose(found["thetadot_1"][-1], v, rtol=1e-8)
    assert q > 15.0  # several turns
    assert off(model, found).max() < 1e-12


def test_slider_crank_through_its_dead_points(made, tight):
    model = made(slider_crank())
    r, rod, m_1, m_2, m_3, c, M = 0.1, 0.3, 1.0, 0.8, 0.6, 20.0, 2.0

    def shape(a):
        b = -np.arcsin(r * np.sin(a) / rod)
        k = -r * np.cos(a) / (rod * np.cos(b))
        return b, k, -r * np.sin(a) - rod * np.sin(b) * k

    def mass(a):
        b, k, s = shape(a)
        middle = r**2 + r * rod * k * np.cos(a - b) + rod**2 * k**2 / 4
        return m_1 * r**2 / 3 + m_2 * (middle + rod**2 * k**2 / 12) + m_3 * s**2

    f = one_degree(mass, lambda a: 0 * a, lambda a, v: M - c * shape(a)[2] ** 2 * v)
    start = qddot.assemble(model, {"alpha": 0.3, "alphadot": 1.0}, guess={"x": 0.4})
    found = qddot.simulate(model, (0, 2), initial=start, **tight)
    a, v = reference(f, (0, 2), [0.3, 1.0])
    assert np.isclose(found["alpha"][-1], a, rtol=1e-8) and np.isclose(found["alphadot"][-1], v, rtol=1e-8)
    assert a > 4 * np.pi
    # what the slider's pin does to it: its inertia and damping
    x, force = found["xdot"], found["lam_x"]
    assert np.isclose(found["reaction_x"][-1], force[-1]) and (off(model, found) < 1e-12).all() and len(x) > 20


def test_spherical_pendulum_in_cartesian_coordinates_over_100_s(made, tight):
    model = made(spherical_pendulum())
    g, L = 9.81, 0.7

    def f(t, s):
        theta, _, w, turn = s
        return w, turn, np.sin(theta) * np.cos(theta) * turn**2 - g / L * np.sin(theta), -2 * w * turn / np.tan(theta)

    theta, turn = 0.9, 2.0
    start = {"x": L * np.sin(theta), "y": 0.0, "ydot": L * np.sin(theta) * turn, "xdot": 0.0}
    start = qddot.assemble(model, start, guess={"z": -1.0})
    found = qddot.simulate(model, (0, 100), initial=start, output_times=np.linspace(0, 100, 1001), **tight)
    end = reference(f, (0, 100), [theta, 0.0, 0.0, turn])
    place = L * np.array([np.sin(end[0]) * np.cos(end[1]), np.sin(end[0]) * np.sin(end[1]), -np.cos(end[0])])
    assert np.allclose([found[name][-1] for name in "xyz"], place, atol=2e-8)
    assert off(model, found).max() < 1e-13
    rough = qddot.simulate(
        model, (0, 100), initial=start, method="ode45", rtol=1e-3, atol=1e-5, output_times=np.linspace(0, 100, 1001)
    )
    assert off(model, rough).max() < 1e-13


def test_rolling_disc_steady_and_falling(made, tight):
    """Beside the equations of motion that SymPy's documentation derives by Kane's method (rolling disc)."""
    model = made(rolling_disc())
    g, R = 9.81, 0.25

    def f(t, s):
        lean, _, u_1, u_2, u_3 = s
        tangent = np.tan(lean)
        return (
            u_1,
            u_3 / np.cos(lean),
            (4 * g * np.sin(lean) + 6 * R * u_2 * u_3 - R * u_3**2 * tangent) / (5 * R),
            -2 * u_1 * u_3 / 3,
            (-2 * u_2 + u_3 * tangent) * u_1,
        )

    def started(lean, leaning, turning, spinning):
        given = {"theta": lean, "psi": 0.0, "phi": 0.0, "x": 0.0, "y": 0.0}
        given |= {"thetadot": leaning, "psidot": turning, "phidot": spinning}
        return qddot.assemble(model, given, guess={"z": R})

    def speeds(lean, leaning, turning, spinning):
        return [lean, 0.0, leaning, turning * np.sin(lean) + spinning, turning * np.cos(lean)]

    lean, turning = 0.4, 2.0
    u_3 = turning * np.cos(lean)
    u_2 = (R * u_3**2 * np.tan(lean) - 4 * g * np.sin(lean)) / (6 * R * u_3)
    steady = (lean, 0.0, turning, u_2 - turning * np.sin(lean))
    found = qddot.simulate(model, (0, 10), initial=started(*steady), **tight)
    assert np.abs(found["theta"] - lean).max() < 1e-8 and np.abs(found["psidot"] - turning).max() < 1e-7

    falling = (0.05, 0.1, 0.5, 12.0)
    found = qddot.simulate(model, (0, 3), initial=started(*falling), **tight)
    end = reference(f, (0, 3), speeds(*falling))
    lean, turn, spin = found["theta"][-1], found["psidot"][-1], found["phidot"][-1]
    assert np.allclose([lean, found["psi"][-1], found["thetadot"][-1]], end[:3], rtol=1e-7, atol=1e-8)
    assert np.allclose([turn * np.sin(lean) + spin, turn * np.cos(lean)], end[3:], rtol=1e-7, atol=1e-8)
    assert off(model, found).max() < 1e-12


def test_satellite_by_a_quaternion_over_1000_s(made, tight):
    model = made(satellite())
    I_x, I_y, I_z = 1.0, 2.0, 2.6

    def euler(t, w):
        return (I_y - I_z) / I_x * w[1] * w[2], (I_z - I_x) / I_y * w[2] * w[0], (I_x - I_y) / I_z * w[0] * w[1]

    w = np.array([0.1, 0.5, 0.05])
    start = qddot.assemble(
        model, {"q_0": 1.0, "q_1": 0, "q_2": 0, "q_3": 0, **{f"qdot_{k}": w[k - 1] / 2 for k in (1, 2, 3)}}
    )
    found = qddot.simulate(model, (0, 1000), initial=start, output_times=np.linspace(0, 1000, 2001), **tight)
    assert off(model, found).max() < 1e-14
    for k, name in enumerate("xyz"):
        assert np.abs(found[f"H_{name}"] - (I_x, I_y, I_z)[k] * w[k]).max() < 1e-7
    end = reference(euler, (0, 1000), w)
    assert np.allclose([found[f"w_{name}"][-1] for name in "xyz"], end, atol=1e-7)


def test_the_squeezing_mechanism_ends_where_it_was_published_to(made, tight):
    """E. Hairer, G. Wanner, Solving ODEs II, section VII.7; test set for IVP solvers, Andrews' squeezing mechanism."""
    model = made(squeezer())
    start = qddot.assemble(model, SQUEEZER_START)
    found = qddot.simulate(model, (0, 0.03), initial=start, **tight)
    end = {
        "beta": 0.1581077119629904e2,
        "theta": -0.1575637105984298e2,
        "gamma": 0.4082224013073101e-1,
        "phi": -0.5347301163226948,
        "delta": 0.5244099658805304,
        "omega": 0.5347301163226948,
        "epsilon": 0.1048080741042263e1,
        "betadot": 0.1139920302151208e4,
        "thetadot": -0.1424379294994111e4,
    }
    for name, value in end.items():
        assert np.isclose(found[name][-1], value, rtol=1e-8), name
    stiff = qddot.simulate(model, (0, 0.03), initial=start, method="rodas5p", rtol=1e-9, atol=1e-10)
    assert np.isclose(stiff["beta"][-1], end["beta"], rtol=1e-6) and off(model, stiff).max() < 1e-10


@pytest.mark.parametrize("method", ["ode45", "ode15s", "taylor"])
def test_redundant_constraints_all_the_way(made, method):
    """Three parallel cranks move as one pendulum; what single pins carry is undetermined, what comes of all is not."""
    model = made(parallel_cranks())
    a, m, g = 0.4, 2.0, 9.81
    start = qddot.assemble(model, {"theta_1": 0.3, "thetadot_1": 1.0}, guess={"theta_2": 0.2, "theta_3": 0.2})
    assert np.allclose(start, [0.3, 0.3, 0.3, 1.0, 1.0, 1.0])
    found = qddot.simulate(model, (0, 10), initial=start, method=method, rtol=1e-8, atol=1e-9)
    end = reference(lambda t, x: (x[1], -2.5 * m * g * a * np.cos(x[0]) / (2 * m * a**2)), (0, 10), [0.3, 1.0])
    assert np.isclose(found["theta_1"][-1], end[0], atol=1e-5)
    assert off(model, found).max() < 1e-10  # of velocities, by constraints left out
    assert np.isnan([found[f"lam_{k}{way}"][1:-1] for k in (2, 3) for way in "xy"]).all()
    alpha = -2.5 * g * np.cos(found["theta_1"]) / (2 * a)
    pull = m * a**2 / 3 * alpha + m * g * a / 2 * np.cos(found["theta_1"])  # what crank 2 needs beside its weight
    assert np.allclose(found["reaction_theta_2"], pull, atol=1e-6)
