"""Dry friction sticks as a constraint whose force is an output, and slips beyond its limit."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import Rational, symbols

import qddot
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.lagrange import derive
from qddot.model import Coordinate, DryFriction, Input, ModelError, Parameter, Part, System

HALF = Rational(1, 2)
x, xdot, y, ydot, m, k, w, F_k, F_s, F_r, F_g, u = symbols("x xdot y ydot m k w F_k F_s F_r F_g u")
PARAMETERS = [
    Parameter(m, 2.0, "kg", "mass"), Parameter(k, 8.0, "N/m", "stiffness"), Parameter(w, 0.3, "m/s", "belt"),
    Parameter(F_k, 3.0, "N", "friction that slips"), Parameter(F_s, 5.0, "N", "friction that sticks"),
]  # fmt: skip


def on_belt(name, friction, parameters=PARAMETERS):
    return System(
        name, "A mass on a belt", [Coordinate(x, "m", "place")], parameters, HALF * m * xdot**2, HALF * k * x**2,
        generalized_forces={x: -F_r}, quantities=[friction], outputs=[friction],
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("kernels")


@pytest.fixture(scope="module")
def belt(folder):
    made = on_belt("belt", DryFriction(F_r, xdot - w, F_k, "N", "friction of the belt", static=F_s))
    return qddot.load(qddot.generate(made, folder))


def cycle():
    """Of the limit cycle: its period, the time that it slips, and the places where it begins to slip and to stick."""
    rate, amplitude = 2.0, 0.25  # sqrt(k/m), (F_s - F_k)/k
    slip = (2 * np.pi - 2 * np.arctan(amplitude * rate / 0.3)) / rate
    return slip + 2 * amplitude / 0.3, slip, 5.0 / 8.0, 1.0 / 8.0


def on_cycle(t):
    """Place, velocity and friction force on the cycle, from where it begins to slip."""
    period, slip, _, sticks = cycle()
    t = t % period
    if t < slip:
        place = 3 / 8 + 0.25 * np.cos(2 * t) + 0.15 * np.sin(2 * t)
        return place, -0.5 * np.sin(2 * t) + 0.3 * np.cos(2 * t), -3.0
    place = sticks + 0.3 * (t - slip)
    return place, 0.3, -8 * place


METHODS = [("dop853", {"rtol": 1e-9, "atol": 1e-11}), ("tsit5", {"rtol": 1e-9, "atol": 1e-11}),
           ("rodas5p", {"rtol": 1e-8, "atol": 1e-10}), ("rk4", {"step": 1e-3, "switching": "locate"})]  # fmt: skip


@pytest.mark.parametrize(("method", "options"), METHODS)
def test_stick_slip_is_its_piecewise_solution(belt, method, options):
    """From rest on the belt: it sticks until the spring has the static limit, and then is on its cycle."""
    first = 5.0 / 8.0 / 0.3
    run = qddot.simulate(belt, (0, 20), method=method, initial=[0, 0.3], **options)
    tolerance = 1e-5 if method != "rodas5p" else 1e-4
    for t in np.linspace(0.4, 19.7, 23):
        place, speed, force = on_cycle(t - first) if t > first else (0.3 * t, 0.3, -8 * 0.3 * t)
        found = run.at(t)
        assert float(found["x"]) == pytest.approx(place, abs=tolerance)
        assert float(found["xdot"]) == pytest.approx(speed, abs=5 * tolerance)
        assert float(found["F_r"]) == pytest.approx(force, abs=10 * tolerance)
    if method != "rk4":
        assert run.statistics.steps < 500


def test_a_run_that_goes_on_from_rest_knows_that_it_sticks(belt):
    """At rest off its place on a belt that stands, below the limit and above it."""
    stands = {"parameters": {"w": 0.0}, "method": "dop853", "rtol": 1e-9, "atol": 1e-11}
    run = qddot.simulate(belt, (0, 5), initial=[0.6, 0], **stands)
    np.testing.assert_allclose(run.states, np.tile([0.6, 0.0], (len(run.t), 1)), atol=1e-14)
    np.testing.assert_allclose(run["F_r"], -8 * 0.6, rtol=1e-12)
    run = qddot.simulate(belt, (0, 5), initial=[0.7, 0], **stands)
    # slips from 0.7 about 3/8 to 0.05, where the spring holds less than the limit
    assert run["x"][-1] == pytest.approx(0.05, abs=1e-8)
    assert run["F_r"][-1] == pytest.approx(-8 * 0.05, abs=1e-6)


@pytest.fixture(scope="module")
def stacked(folder):
    """A block on a block on the ground, the upper one pushed: three ways to stick."""
    upper = DryFriction(F_r, xdot - ydot, F_k, "N", "friction between the blocks")
    lower = DryFriction(F_g, ydot, F_s, "N", "friction of the ground")
    made = System(
        "stacked", "Two blocks", [Coordinate(x, "m", "upper"), Coordinate(y, "m", "lower")],
        [each for each in PARAMETERS if each.symbol != w], HALF * m * xdot**2 + HALF * m * ydot**2,
        HALF * k * y**2, generalized_forces={x: u - F_r, y: F_r - F_g},
        inputs=[Input(u, "N", "push")], quantities=[upper, lower], outputs=[upper, lower],
    )  # fmt: skip
    return qddot.load(qddot.generate(made, folder))


def test_several_places_of_friction_stick_at_once(stacked):
    """Beside the same with tanh of a narrow width, by SciPy's Radau."""
    parameters = {"F_s": 2.0, "F_k": 3.0}
    push = qddot.signal.sine(7.0, 0.25)
    run = qddot.simulate(
        stacked, (0, 8), method="dop853", initial=np.zeros(4), parameters=parameters, inputs={"u": push},
        rtol=1e-8, atol=1e-10,
    )  # fmt: skip

    def slope(t, s):
        between, ground = 3 * np.tanh((s[2] - s[3]) / 1e-6), 2 * np.tanh(s[3] / 1e-6)
        return [s[2], s[3], (7 * np.sin(0.5 * np.pi * t) - between) / 2, (between - ground - 8 * s[1]) / 2]

    expected = solve_ivp(slope, (0, 8), np.zeros(4), method="Radau", rtol=1e-9, atol=1e-11).y[:, -1]
    np.testing.assert_allclose(run.states[-1], expected, atol=2e-5)
    slips = np.abs(run.states[:, 2] - run.states[:, 3]) > 1e-6
    assert 0 < slips.sum() < len(slips)
    assert (np.abs(run["F_r"]) <= 3 + 1e-9).all()


def test_what_is_smooth_creeps(folder):
    """The regularised force is a model like any other, near to what sticks; in every method."""
    made = on_belt("smooth", DryFriction(F_r, xdot - w, F_k, "N", "friction", smooth="1 mm/s"), PARAMETERS[:-1])
    smooth = qddot.load(qddot.generate(made, folder))
    assert not smooth.tables.modes
    run = qddot.simulate(smooth, (0, 1), method="rodas5p", initial=[0, 0.3], rtol=1e-8, atol=1e-10)
    assert run["x"][-1] == pytest.approx(0.3, abs=1e-3)
    assert run["F_r"][-1] == pytest.approx(-2.4, abs=5e-2)


def test_pages_show_it_as_a_sign():
    made = on_belt("shown", DryFriction(F_r, xdot - w, F_k, "N", "friction", static=F_s))
    page = text(describe(derive(made), "test.py"))
    assert "sgn" in page
    assert "mode" not in page


def test_it_is_a_quantity_of_a_part_as_well():
    part = Part(
        "skid", [Coordinate(x, "m", "place")], [Parameter(m, 1.0, "kg", "mass"), Parameter(F_k, 1.0, "N", "limit"),
        Parameter(F_s, 2.0, "N", "static limit")], HALF * m * xdot**2,
        quantities=[DryFriction(F_r, xdot, F_k, "N", "friction", static=F_s)], generalized_forces={x: -F_r},
    )  # fmt: skip
    both = (part("1") + part("2")).system("skids", "Two skids")
    assert len(derive(both).modes.bounds) == 2


def test_misuse_is_told():
    with pytest.raises(ModelError, match="friction F_r has both static and smooth"):
        DryFriction(F_r, xdot, F_k, "N", "friction", static=F_s, smooth="1 mm/s")
    with pytest.raises(ModelError, match="friction F_r: smooth '1 kg' is in kg, expected"):
        DryFriction(F_r, xdot, F_k, "N", "friction", smooth="1 kg")
    with pytest.raises(ModelError, match="friction F_r: smooth is 0, expected a velocity above zero"):
        DryFriction(F_r, xdot, F_k, "N", "friction", smooth=0)
