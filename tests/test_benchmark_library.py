"""Mechanisms of the library of computational benchmark problems, beside what is known of them: see `benchmark_library`.

The library's time histories were not at hand; its problems and spans were. References are computed apart: the
pendulum's is Jacobi's, that of the four-bars SciPy's over one angle, Bricard's the energy by hand, the governor's
SymPy's equations.
"""

import importlib.util

import numpy as np
import pytest
import sympy
from benchmark_library import HINGES, bricard, four_bars, governor, planar_pendulum
from mechanisms import energy, off
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk
from sympy.physics import mechanics as me

import qddot

TIGHT = {"method": "dop853", "rtol": 1e-11, "atol": 1e-12}
g = 9.81


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


@pytest.mark.slow
def test_the_planar_pendulum_over_2000_s(made):
    """From rest, level: sin(theta/2) = k cd(w t), k = sin(45 deg); a period of 4 K(k)/w = 2.3678 s."""
    model = made(planar_pendulum())
    times = np.linspace(0, 2000, 4001)
    start = qddot.assemble(model, {"x": 1.0, "y": 0.0, "xdot": 0.0, "ydot": 0.0})
    found = qddot.simulate(model, (0, 2000), initial=start, output_times=times, **TIGHT)
    _, cn, dn, _ = ellipj(np.sqrt(g) * times % (4 * ellipk(0.5)), 0.5)
    half = np.sqrt(0.5) * cn / dn
    x, y = 2 * half * np.sqrt(1 - half**2), 2 * half**2 - 1
    assert np.isclose(4 * ellipk(0.5) / np.sqrt(g), 2.36784195)
    assert max(np.abs(found["x"] - x).max(), np.abs(found["y"] - y).max()) < 1e-5
    assert np.abs(energy(model, found)).max() < 1e-7
    assert off(model, found).max() < 1e-13


def falling(count):
    """The angle of all cranks, upright at first, of `count` windows: all bars stay level. Speed of its ends: 1 m/s."""
    inertia, weight = (count + 1) / 3 + count, (count + 1) / 2 + count
    return lambda t, x: (x[1], -weight * g * np.cos(x[0]) / inertia)


def test_two_four_bars_in_a_row_pass_lying_flat(made):
    """Where all links are in line the mechanism may bend in either window, and does not."""
    model, end = made(four_bars(2)), 3.0
    upright = {"a_0": np.pi / 2, "a_1": np.pi / 2, "a_2": np.pi / 2, "b_1": 0.0, "b_2": 0.0, "adot_0": -1.0}
    start = qddot.assemble(model, upright, guess={"adot_1": -1.0, "adot_2": -1.0})
    times = np.linspace(0, end, 61)
    found = qddot.simulate(model, (0, end), initial=start, output_times=times, method="rk4", step=1e-3)
    known = solve_ivp(falling(2), (0, end), [np.pi / 2, -1.0], "DOP853", times, rtol=1e-12, atol=1e-13).y[0]
    assert np.ptp(known) > 3 * np.pi  # flat three times
    assert np.abs([found[f"a_{k}"] - known for k in range(3)]).max() < 1e-9
    assert np.abs([found[f"b_{k}"] for k in (1, 2)]).max() < 1e-12
    assert np.ptp(energy(model, found)) < 1e-8
    assert off(model, found).max() < 1e-12


class BricardByHand:
    """Its one motion by the length of its way in the space of the five angles, in plain NumPy."""

    def __init__(self):
        self.axes = [np.eye(3)["xyz".index(axis)] for axis, _ in HINGES]
        self.ways = [np.array(way, dtype=float) for _, way in HINGES]

    def figure(self, a):
        """Of each rod: its hinge's place and axis, its rotation; and where the last one ends."""
        place, turned, rods = np.zeros(3), np.eye(3), []
        for axis, way, angle in zip(self.axes, self.ways, a, strict=True):
            skew = np.cross(np.eye(3), axis)
            spun = np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
            rods.append((place, turned @ axis, turned @ spun))
            turned = turned @ spun
            place = place + turned @ way
        return rods, place, turned

    def closing(self, a):
        """The derivative (5, 5) of what closes the loop by the angles."""
        rods, end, turned = self.figure(a)
        columns = [np.concatenate([np.cross(u, end - at), np.cross(u, turned[:, 0])[1:]]) for at, u, _ in rods]
        return np.array(columns).T

    def direction(self, a):
        """The change of the angles, of length 1, that keeps the loop closed."""
        return np.linalg.svd(self.closing(a))[2][-1]

    def inertia_and_height(self, a):
        n, (rods, _, _) = self.direction(a), self.figure(a)
        inertia = height = 0.0
        for k, (place, _, turned) in enumerate(rods):
            middle = place + turned @ self.ways[k] / 2
            speed = sum(n[i] * np.cross(u, middle - at) for i, (at, u, _) in enumerate(rods[: k + 1]))
            omega = turned.T @ sum(n[i] * u for i, (_, u, _) in enumerate(rods[: k + 1]))
            inertia += speed @ speed + omega @ (np.where(self.ways[k] != 0, 1 / 600, 1.01 / 12) * omega)
            height += middle[1]
        return inertia, height


@pytest.mark.slow
def test_bricards_mechanism_has_one_equation_too_many_all_the_way(made):
    """Of one degree of freedom, so that the energy by hand says all: how fast it goes wherever it is."""
    by_hand, model = BricardByHand(), made(bricard())
    times = np.linspace(0, 10, 401)
    start = qddot.assemble(model, np.zeros(10))
    found = qddot.simulate(model, (0, 10), initial=start, output_times=times, method="ode45", rtol=1e-9, atol=1e-10)
    a, v = (np.array([found[f"{name}_{k}"] for k in range(1, 6)]).T for name in ("a", "adot"))
    assert np.ptp(a, axis=0).max() > 1.0
    for angles, rates in zip(a[::10], v[::10], strict=True):
        sizes, way = np.linalg.svd(by_hand.closing(angles))[1:]
        assert sizes[-1] < 1e-8 < 1e-3 * sizes[-2]
        speed = abs(way[-1] @ rates)
        np.testing.assert_allclose(speed, np.linalg.norm(rates), atol=1e-10)  # it moves the one way that it can
        inertia, height = by_hand.inertia_and_height(angles)
        np.testing.assert_allclose(
            0.5 * inertia * speed**2 + g * height, g * by_hand.inertia_and_height(a[0])[1], atol=1e-5
        )
    assert np.ptp(energy(model, found)) < 1e-5
    assert off(model, found).max() < 1e-10


def governor_by_sympy():
    """The same by SymPy's LagrangesMethod, from rods as rigid bodies in its reference frames."""
    phi, b_1, b_2, s = q = me.dynamicsymbols("phi b_1 b_2 s")
    N, origin = me.ReferenceFrame("N"), me.Point("origin")
    origin.set_vel(N, 0)
    shaft = N.orientnew("S", "Axis", (phi, N.z))
    slider, bodies, side, section = origin.locatenew("slider", s * N.z), [], 0.05, 0.01**2
    dissipation = potential = 0
    for sign, b in ((1, b_1), (-1, b_2)):
        rod = shaft.orientnew("R", "Axis", (sign * b, shaft.y))
        pin = origin.locatenew("pin", sign * side * shaft.x + N.z)
        middle, ball = (pin.locatenew("at", sign * share * rod.x) for share in (0.5, 1.0))
        slim = me.inertia(rod, 0.3 * section / 6, 0.3 * (1 + section) / 12, 0.3 * (1 + section) / 12)
        bodies += [me.RigidBody("rod", middle, rod, 0.3, (slim, middle)), me.Particle("ball", ball, 5.0)]
        length = (middle.pos_from(slider) - sign * side * shaft.x).magnitude()
        potential += 4e5 * (length - 0.5) ** 2
        dissipation += 2e4 * length.diff(sympy.Symbol("t")) ** 2
    bodies += [me.RigidBody("slider", slider, shaft, 3.0, (me.inertia(shaft, 0, 0, 3 * 0.01 / 6), slider))]
    kinetic = 0.3 * section / 12 * phi.diff() ** 2
    for body in bodies:
        point = body.masscenter if isinstance(body, me.RigidBody) else body.point
        point.set_vel(N, point.pos_from(origin).dt(N))
        kinetic += body.kinetic_energy(N)
        potential += body.mass * g * point.pos_from(origin).dot(N.z)
    forces = [(N, 0 * N.z)]
    rates = [each.diff() for each in q]
    method = me.LagrangesMethod(kinetic - potential, q, forcelist=forces, frame=N)
    method.form_lagranges_equations()
    plain = sympy.symbols("q:8")
    swap = dict(zip(rates, plain[4:], strict=True)) | dict(zip(q, plain[:4], strict=True))
    dampers = sympy.Matrix([dissipation.diff(rate) for rate in rates])
    M, right = (each.subs(swap) for each in (method.mass_matrix, method.forcing - dampers))
    both = sympy.lambdify([plain], [M, right], cse=True)

    def f(t, x):
        mass, force = both(x)
        return np.concatenate([x[4:], np.linalg.solve(mass, np.ravel(force))])

    return f


def test_the_stiff_flyball_governor_beside_sympys_lagrange(tmp_path):
    """The equations at random states, those of the problem among them: 2 pi rad/s, rods 30 degrees below the level."""
    path = qddot.generate(governor(), tmp_path)
    spec = importlib.util.spec_from_file_location("governor", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    p = np.array([float(each.default) for each in governor().parameters])
    c = np.zeros(len(p) + 64)  # room for all that is computed once
    module.constants.py_func(p, c)
    known, chance = governor_by_sympy(), np.random.default_rng(5)
    start = np.array([0.0, np.pi / 6, np.pi / 6, 0.5, 2 * np.pi, 0.0, 0.0, 0.0])
    for _ in range(20):
        x = start + chance.uniform(-0.2, 0.2, 8)
        dx = np.zeros(8)
        module.rhs.py_func(0.0, x, np.zeros(1), c, dx)
        expected = known(0.0, x)
        np.testing.assert_allclose(dx, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
