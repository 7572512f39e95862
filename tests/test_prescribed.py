"""Prescribed motions, written as on paper: the crane with a moving trolley beside SymPy and SciPy, and constraints."""

from itertools import pairwise

import numpy as np
import pytest
from mechanisms import HALF
from scipy.integrate import quad, solve_ivp
from sympy import Symbol, cos, lambdify, sin, symbols
from sympy.physics import mechanics as me

import qddot
from qddot.model import (
    Constraint,
    Coordinate,
    Input,
    ModelError,
    Output,
    Parameter,
    Prescribed,
    Quantity,
    Rolling,
    System,
    from_sympy,
)
from qddot.signal import smoothed, table

END = 3.0
VALUES = {"m": 800.0, "L": 6.0, "g": 9.81, "c": 900.0}
s, sdot, sddot, theta, thetadot, w, wdot = symbols("s sdot sddot theta thetadot w wdot")
m, L, g, c = symbols("m L g c")
PARAMETERS = [Parameter(Symbol(name), value, unit, f"parameter {name}") for (name, value), unit in
              zip(VALUES.items(), ("kg", "m", "m/s^2", "N m s/rad"), strict=True)]  # fmt: skip


def crane(**changes):
    """The load hangs below a trolley at s(t), under a jib that lifts it by w(t)."""
    given = {
        "name": "crane",
        "title": "Load below a moving trolley",
        "coordinates": [Coordinate(theta, "rad", "angle of the rope")],
        "parameters": PARAMETERS,
        "inputs": [Prescribed(s, "m", "way of the trolley"), Prescribed(w, "m", "height of the jib")],
        "quantities": [Quantity(Symbol("x"), s + L * sin(theta), "m", "place of the load", rate=Symbol("v"))],
        "kinetic_energy": HALF * m * (Symbol("v") ** 2 + (wdot + L * thetadot * sin(theta)) ** 2),
        "potential_energy": m * g * (w - L * cos(theta)),
        "dissipation": HALF * c * thetadot**2,
        "outputs": [Output(Symbol("pull"), m * (sddot + L * Symbol("thetaddot")), "N", "an output of an acceleration")],
    }
    return System(**given | changes)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return qddot.load(qddot.generate(crane(), tmp_path_factory.mktemp("kernels")))


def acceleration():
    """The angle's second derivative by SymPy, with s(t) and w(t) in T: of theta, thetadot, sddot, wddot."""
    angle, x, h = me.dynamicsymbols("angle x h")
    vx, vy = x.diff() + L * angle.diff() * cos(angle), h.diff() + L * angle.diff() * sin(angle)
    N, A = me.ReferenceFrame("N"), me.ReferenceFrame("A")
    A.set_ang_vel(N, angle.diff() * N.z)
    lagrangian = m * (vx**2 + vy**2) / 2 - m * g * (h - L * cos(angle))
    method = me.LagrangesMethod(lagrangian, [angle], forcelist=[(A, -c * angle.diff() * N.z)], frame=N)
    method.form_lagranges_equations()
    found = (method.forcing[0] / method.mass_matrix[0]).subs({Symbol(k): v for k, v in VALUES.items()})
    t = me.dynamicsymbols._t
    return lambdify([angle, angle.diff(), x.diff(t, 2), h.diff(t, 2)], found)


def ramp():
    """Within a second from 0 to 2 m, started and stopped within 0.4 s each."""
    return smoothed(table([0.3, 1.3], [0.0, 2.0]), 0.4)


COURSES = {"s": ramp(), "w": qddot.signal.sine(0.3, 0.7, 0.4)}
STOPS = (0.0, 0.1, 0.5, 1.1, 1.5, END)


def reference(x, ways=COURSES):
    """The state at END by SciPy at 1e-12, from stop to stop."""
    of = acceleration()
    for start, end in pairwise(STOPS):

        def slope(t, x, start=start, end=end):
            inside = min(max(t, start + 1e-10), end - 1e-10)
            second = [float(way.derivative(inside, 2)) for way in (ways["s"], ways["w"])]
            return [x[1], of(x[0], x[1], *second)]

        x = solve_ivp(slope, (start, end), x, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return x


START = [0.2, -0.1]


@pytest.fixture(scope="module")
def expected():
    return reference(np.array(START))


@pytest.mark.parametrize(
    ("method", "options", "tolerance"),
    [
        ("rk4", {"step": 1e-3}, 1e-11),
        ("dop853", {"rtol": 1e-12, "atol": 1e-12}, 1e-11),
        ("rodas5p", {"rtol": 1e-10, "atol": 1e-12}, 1e-8),
        ("taylor", {"rtol": 1e-12, "atol": 1e-12}, 1e-10),
    ],
)
def test_the_crane_swings_as_sympy_and_scipy_say(model, expected, method, options, tolerance):
    run = qddot.simulate(model, (0, END), method=method, inputs=COURSES, initial=START, **options)
    np.testing.assert_allclose(run.states[-1], expected, rtol=0, atol=tolerance)


def test_lanes_and_batches_read_accelerations(model, expected):
    quiet = {"s": ramp(), "w": qddot.signal.constant(0.0)}
    others = reference(np.array(START), quiet)
    batch = qddot.simulate_batch(
        model, (0, END), method="rk4", step=1e-3, initial=START, output_times=[END],
        inputs={"s": COURSES["s"], "w": [COURSES["w"], 0.0] * 5},
    )  # fmt: skip
    for k, name in enumerate(("theta", "thetadot")):
        np.testing.assert_allclose(batch[name][::2, -1], expected[k], rtol=0, atol=1e-11)
        np.testing.assert_allclose(batch[name][1::2, -1], others[k], rtol=0, atol=1e-11)


def test_energy_put_in_by_the_motion_balances(model):
    """E(t) - E(0) is the integral of the power put in less that dissipated."""
    times = np.linspace(0, END, 3001)
    run = qddot.simulate(
        model, (0, END), method="dop853", rtol=1e-12, atol=1e-12, inputs=COURSES, initial=START, output_times=times
    )
    p = model.constants(model.parameter_values())
    rows = np.zeros((len(times), 4))
    names = [channel.name for channel in model.tables.inputs]
    assert names[:2] == ["s", "w"] and set(names) == {"s", "w", "sdot", "wdot", "sddot", "wddot"}
    for k, t in enumerate(times):
        inside = min(t + 1e-9, END)
        u = [float(COURSES[each.input].derivative(inside, each.order)) for each in model.tables.inputs]
        model.kernel("energy")(t, np.ascontiguousarray(run.states[k]), np.array(u), p, rows[k])
    energy, power = rows[:, 0] + rows[:, 1], rows[:, 3] - rows[:, 2]
    given = np.trapezoid(power, times)
    assert abs(given) > 100.0
    assert energy[-1] - energy[0] == pytest.approx(given, rel=2e-3)


def test_a_constraint_may_hold_what_moves(tmp_path):
    """A bead on a rod that time moves: x is the way of the rod, y slides on it; a blade on a moving floor."""
    x, y, phi, xdot, ydot, phidot = symbols("x y phi xdot ydot phidot")
    system = System(
        "bead", "Bead",
        [Coordinate(x, "m", "x"), Coordinate(y, "m", "y"), Coordinate(phi, "m", "z")],
        [Parameter(m, 2.0, "kg", "m"), Parameter(L, 30.0, "N/m", "stiffness")],
        inputs=[Prescribed(s, "m", "way of the rod")],
        kinetic_energy=HALF * m * (xdot**2 + ydot**2 + phidot**2),
        potential_energy=HALF * L * y**2,
        constraints=[
            Constraint(Symbol("lam"), x - s - y / 2, "N", "rod"),
            Rolling(Symbol("mu"), phidot - 3 * sdot, "N", "a"),
        ],
    )  # fmt: skip
    model = qddot.load(qddot.generate(system, tmp_path))
    way = COURSES["w"]
    start = {"y": 0.1, "ydot": 0.0, "phi": 0.0}
    run = qddot.simulate(model, (0, 2), method="dop853", rtol=1e-11, atol=1e-12, inputs={"s": way}, initial=start)

    def slope(t, y):  # by hand: T with x = s + y/2
        return [y[1], -(30.0 * y[0] + 2.0 * 0.5 * float(way.derivative(t, 2))) / (2.0 * 1.25)]

    by_hand = solve_ivp(slope, (0, 2), [0.1, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose([run["y"][-1], run["ydot"][-1]], by_hand, atol=1e-9)
    assert run["x"][-1] == pytest.approx(float(way(2.0)) + run["y"][-1] / 2, abs=1e-12)
    assert run["phi"][-1] == pytest.approx(3 * (float(way(2.0)) - float(way(0.0))), abs=1e-9)


def test_sympys_crane_comes_in():
    angle, x = me.dynamicsymbols("theta s")
    T = m * ((x.diff() + L * angle.diff() * cos(angle)) ** 2 + (L * angle.diff() * sin(angle)) ** 2) / 2
    method = me.LagrangesMethod(T + m * g * L * cos(angle), [angle])
    system = from_sympy(
        method, "crane_by_sympy", "Crane", coordinates=[Coordinate(angle, "rad", "angle")], parameters=PARAMETERS[:3],
        inputs=[Prescribed(x, "m", "way")],
        outputs=[Output(Symbol("a"), x.diff(me.dynamicsymbols._t, 2), "m/s^2", "a")],
    )  # fmt: skip
    assert sdot in (system.kinetic_energy - system.potential_energy).free_symbols
    assert system.outputs[0].expression == sddot


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inputs": [Input(s, "m", "way"), Prescribed(w, "m", "h")], "outputs": []},
         r'depends on sdot, the rate of the input s, .*: declare it as a prescribed motion, Prescribed\(s, "m", ...\)'),
        ({"potential_energy": m * g * w * sddot}, "the potential energy depends on sddot, an acceleration"),
        ({"quantities": [Quantity(Symbol("x"), sddot, "m", "a", rate=Symbol("v"))]},
         "would need the third derivative of s"),
        ({"constraints": [Constraint(Symbol("lam"), theta - s * sdot, "N m", "a")]}, "constraint lam depends on sdot"),
        ({"constraints": [Rolling(Symbol("mu"), thetadot - sddot, "N m", "a")]}, "constraint mu depends on sddot"),
        ({"parameters": [*PARAMETERS, Parameter(sddot, 1.0, "m", "a")]},
         "sddot is used twice, as parameter and as input acceleration"),
        ({"inputs": [Prescribed(s, "m", "way"), Prescribed(w, "m", "h"), Prescribed(Symbol("y"), "m", "h")]},
         "input y is used nowhere"),
    ],
)  # fmt: skip
def test_what_a_prescribed_motion_cannot_be_is_refused(changes, message, tmp_path):
    with pytest.raises(ModelError, match=message):
        qddot.generate(crane(**changes), tmp_path)


def test_a_course_that_jumps_or_has_a_kink_is_refused_with_the_smoothing_that_mends_it(model):
    step, line = qddot.road.step(0.2), table([0, 1], [0, 1])
    with pytest.raises(ValueError, match=r"input s jumps at t = 0, .*smooth it, twice, by qddot.signal.smoothed"):
        qddot.simulate(model, (0, 1), inputs={"s": step}, initial=START, step=1e-2)
    with pytest.raises(ValueError, match=r"input s has a kink.*or smooth it, once, by qddot.signal.smoothed"):
        qddot.simulate(model, (0, 1), inputs={"s": line}, initial=START, step=1e-2)
    qddot.prepare(
        model, (0, 1), inputs={"s": smoothed(smoothed(step, 0.1), 0.1), "w": smoothed(line, 0.1)}, initial=START
    )


@pytest.mark.parametrize("width", [0.3, 2.7])
def test_smoothed_is_the_mean_over_a_window(width):
    rng = np.random.default_rng(3)
    given = table(np.sort(rng.uniform(0, 5, 9)), rng.normal(size=9))
    first = smoothed(given, width)
    for before, after in ((given, first), (first, smoothed(first, width))):
        for t in np.linspace(-2, 8, 31):
            corners = [at for at in np.sort(before.pieces[:, 0]) if t - width / 2 < at < t + width / 2]
            mean = quad(
                lambda x, f=before: float(f(x)), t - width / 2, t + width / 2, points=corners or None, limit=300
            )[0]
            assert float(after(t)) == pytest.approx(mean / width, abs=1e-11)
    at = first.breakpoints
    np.testing.assert_allclose(first.derivative(at - 1e-10), first.derivative(at + 1e-10), atol=1e-6)


def test_what_cannot_be_smoothed_is_refused():
    with pytest.raises(ValueError, match="holds a sine"):
        smoothed(qddot.signal.sine(1.0, 1.0), 0.1)
    with pytest.raises(ValueError, match="is of third degree"):
        smoothed(table([0, 1, 2, 4], [0, 1, 0, 2], "cubic"), 0.1)
    with pytest.raises(ValueError, match=r"width is 0\.0, expected a positive number"):
        smoothed(table([0, 1], [0, 1]), 0)
    with pytest.raises(ValueError, match="signal is 3, expected a signal"):
        smoothed(3, 0.1)
