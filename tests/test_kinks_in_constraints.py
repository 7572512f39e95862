"""Constraints whose curvature jumps, a flat that becomes a ramp, a wheel of two radii: switches as all others are.

Beside the eliminated form by SciPy's DOP853 at 1e-12, run from one switch to the next with the branch written by hand.
"""

import numpy as np
import pytest
from mechanisms import HALF, coordinates, energy, off, parameters
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from sympy import Abs, Max, Piecewise, Symbol, symbols

import qddot
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.lagrange import derive
from qddot.model import Constraint, Quantity, Rolling, System, Table

x, y, xdot, ydot, m, k, g, R, d, h = symbols("x y xdot ydot m k g R d h")
M, K, G, RADIUS, FLAT = 1.5, 40.0, 9.81, 0.2, 0.1
SPAN, TIGHT = 4.0, {"rtol": 1e-10, "atol": 1e-12}


def bead(height, name, **changes):
    """A bead on a wire, y = height(x), and on a spring."""
    given = {
        "title": "Bead on a wire",
        "coordinates": coordinates("m", "x y"),
        "parameters": parameters(m=(M, "kg"), k=(K, "N/m"), g=(G, "m/s^2"), R=(RADIUS, "m"), d=(FLAT, "m")),
        "kinetic_energy": HALF * m * (xdot**2 + ydot**2),
        "potential_energy": HALF * k * x**2 + m * g * y,
        "constraints": [Constraint(Symbol("lam"), y - height, "N", "the wire")],
    }
    return System(name=name, **given | changes)


def by_branches(slope, side, start, span=SPAN):
    """The state at the end and the times of the switches; slope(x, beyond): of the branch where side(x) > 0, or not."""
    t, state, times = 0.0, np.array(start), []
    beyond = side(state) > 0
    while t < span:

        def turn(t, state):
            return side(state)

        turn.terminal, turn.direction = True, -1 if beyond else 1
        run = solve_ivp(
            lambda t, state, beyond=beyond: slope(state, beyond), (t, span), state, "DOP853",
            rtol=1e-12, atol=1e-14, events=turn,
        )  # fmt: skip
        t, state = run.t[-1], run.y[:, -1]
        if run.status == 1:
            times.append(t)
            beyond = not beyond
    return state, times


def along_a_wire(slope_and_bend):
    """The rates of x and its speed on y = height(x)."""

    def rates(state, beyond):
        place, speed = state
        slope, bend = slope_and_bend(place, beyond)
        return [speed, -(K / M * place + G * slope + slope * bend * speed**2) / (1 + slope**2)]

    return rates


def ramp(place, beyond):
    return ((place - FLAT) / RADIUS, 1 / RADIUS) if beyond else (0.0, 0.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


@pytest.fixture(scope="module")
def wire(made):
    """A flat that becomes a parabola, its height a quantity."""
    return made(bead(h, "wire", quantities=[Quantity(h, Max(x - d, 0) ** 2 / (2 * R), "m", "height of the wire")]))


@pytest.fixture(scope="module")
def expected():
    state, times = by_branches(along_a_wire(ramp), lambda state: state[0] - FLAT, [0.0, 1.2])
    assert len(times) == 8
    return state


METHODS = [
    ("tsit5", TIGHT, 1e-7), ("dop853", TIGHT, 1e-9), ("vern7", TIGHT, 1e-8), ("ode45", TIGHT, 1e-7),
    ("taylor", TIGHT, 1e-9), ("rodas5p", TIGHT, 1e-7), ("ode15s", TIGHT, 1e-6),
    ("rk4", {"step": 1e-3, "switching": "locate"}, 1e-9),
]  # fmt: skip


@pytest.mark.parametrize(("method", "options", "tolerance"), METHODS)
def test_a_bead_on_a_wire_beside_its_eliminated_form(wire, expected, method, options, tolerance):
    start = qddot.assemble(wire, {"x": 0.0, "xdot": 1.2})
    run = qddot.simulate(wire, (0, SPAN), initial=start, method=method, **options)
    np.testing.assert_allclose([run["x"][-1], run["xdot"][-1]], expected, rtol=0, atol=tolerance)
    assert off(wire, run).max() < 1e-12
    assert np.ptp(energy(wire, run)) < 10 * tolerance
    bend = np.where(run["x"] > FLAT, run["xdot"] ** 2 / RADIUS, 0.0)  # the wire carries the weight, and bends the way
    slope = np.maximum(run["x"] - FLAT, 0.0) / RADIUS
    force = M * (G + bend + slope * -K / M * run["x"]) / (1 + slope**2)
    away = np.abs(run["x"] - FLAT) > 1e-9
    np.testing.assert_allclose(-run["lam"][away], force[away], atol=1e-6)


def test_switches_of_constraints_are_worth_their_search(wire, expected):
    start = qddot.assemble(wire, {"x": 0.0, "xdot": 1.2})
    located, ignored = (
        qddot.simulate(wire, (0, SPAN), initial=start, method="dop853", rtol=1e-8, atol=1e-10, switching=way)
        for way in ("locate", "ignore")
    )
    errors = [abs(run["x"][-1] - expected[0]) for run in (located, ignored)]
    assert errors[0] < 1e-8
    assert located.statistics.evaluations < ignored.statistics.evaluations


def test_pages_show_the_condition_as_it_was_written():
    page = text(describe(derive(bead(Max(x - d, 0) ** 2 / (2 * R), "shown")), "test.py"))
    assert "mode" not in page and "x − d" in page


def test_a_bead_on_a_wire_through_points(made):
    """A cubic table: its third derivative jumps, the wire's force does not."""
    points = np.array([-0.6, -0.3, -0.1, 0.2, 0.4, 0.7]), np.array([0.1, 0.0, 0.05, -0.02, 0.1, 0.2])
    wire = Table("wire", "m", *points, interpolation="cubic", outside="extend", argument="m")
    model = made(bead(wire(x), "points", parameters=parameters(m=(M, "kg"), k=(K, "N/m"), g=(G, "m/s^2"))))
    spline = CubicSpline(*points)
    rates = along_a_wire(lambda place, _: (spline(place, 1), spline(place, 2)))
    end = solve_ivp(
        lambda t, state: rates(state, None), (0, SPAN), [0.0, 1.2], "DOP853", rtol=1e-12, atol=1e-13, max_step=0.01
    ).y[:, -1]
    start = qddot.assemble(model, {"x": 0.0, "xdot": 1.2})
    run = qddot.simulate(model, (0, SPAN), initial=start, method="dop853", rtol=1e-12, atol=1e-13)
    assert run["x"].min() > -0.6 and run["x"].max() < 0.7
    np.testing.assert_allclose([run["x"][-1], run["xdot"][-1]], end, atol=1e-8)
    assert off(model, run).max() < 1e-12


# A wheel that rolls on one radius one way and on another the other way: a spiral, and a bent one

phi, phidot, J, r, c = symbols("phi phidot J r c")
RADII = {
    "spiral": (Max(phi, 0), lambda at, beyond: (0.3 + 0.1 * at * beyond, 0.1 * beyond)),
    "bent": (Abs(phi), lambda at, beyond: (0.3 + 0.1 * abs(at), 0.1 if beyond else -0.1)),
    "pieces": (
        Piecewise((phi, phi > 0), (phi / 2, True)),
        lambda at, beyond: (0.3 + 0.1 * at * (1.0 if beyond else 0.5), 0.1 if beyond else 0.05),
    ),
}


@pytest.mark.parametrize("kind", RADII)
def test_a_wheel_of_two_radii_rolls(made, kind):
    growing, radius = RADII[kind]
    system = System(
        name=kind,
        title="Wheel whose radius changes as it turns",
        coordinates=[*coordinates("m", "x"), *coordinates("rad", "phi")],
        parameters=parameters(m=(2.0, "kg"), J=(0.1, "kg m^2"), k=(30.0, "N/m"), r=(0.3, "m"), c=(0.1, "m")),
        kinetic_energy=HALF * m * xdot**2 + HALF * J * phidot**2,
        potential_energy=HALF * k * x**2,
        constraints=[Rolling(Symbol("mu"), xdot - (r + c * growing) * phidot, "N", "no slip")],
    )
    model = made(system)

    def rates(state, beyond):
        angle, place, speed = state
        rho, slope = radius(angle, beyond)
        return [
            speed, rho * speed, -(2.0 * rho * slope * speed**2 + 30.0 * place * rho) / (2.0 * rho**2 + 0.1)
        ]  # fmt: skip

    end, times = by_branches(rates, lambda state: state[0], [-0.5, -0.2, 3.0])
    assert len(times) in (4, 5)
    start = qddot.assemble(model, {"phi": -0.5, "x": -0.2, "phidot": 3.0})
    for method, tolerance in (("dop853", 1e-8), ("rodas5p", 1e-6)):
        run = qddot.simulate(model, (0, SPAN), initial=start, method=method, **TIGHT)
        found = [run["phi"][-1], run["x"][-1], run["phidot"][-1]]
        np.testing.assert_allclose(found, end, rtol=0, atol=tolerance)
        assert np.ptp(energy(model, run)) < 10 * tolerance
        assert off(model, run).max() < 1e-12
