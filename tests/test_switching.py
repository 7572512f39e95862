"""Conditions in the state are held on a side during a step, which ends where one leaves it.

Beside SciPy's DOP853 at 1e-12, run from one switch to the next with the branch written by hand.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import Abs, Heaviside, Max, Min, Piecewise, Rational, Symbol, sign, symbols

import qddot
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.lagrange import derive
from qddot.model import Coordinate, Input, Output, Parameter, State, System

HALF = Rational(1, 2)
x, xdot, m, k, k_b, a, c, u, z, zdot = symbols("x xdot m k k_b a c u z zdot")
SPAN, TIGHT = 5.0, {"rtol": 1e-8, "atol": 1e-10}


def system(name, force=0, **changes):
    """A mass between bump stops, under a force from outside and another."""
    given = {
        "title": "Mass between stops",
        "coordinates": [Coordinate(x, "m", "place")],
        "parameters": [
            Parameter(m, 1.0, "kg", "mass"),
            Parameter(k, 10.0, "N/m", "stiffness"),
            Parameter(k_b, 1e4, "N/m", "stiffness of the stops"),
            Parameter(a, 0.1, "m", "free way"),
            Parameter(c, 0.1, "N s/m", "damping"),
        ],
        "kinetic_energy": HALF * m * xdot**2,
        "potential_energy": HALF * k * x**2 + HALF * k_b * Max(x - a, -x - a, 0) ** 2,
        "dissipation": HALF * c * xdot**2,
        "generalized_forces": {x: u + force},
        "inputs": [Input(u, "N", "force from outside")],
        "outputs": [Output(Symbol("contact"), k_b * Max(x - a, -x - a, 0), "N", "force of a stop")],
    }
    return System(name=name, **given | changes)


PUSH = qddot.signal.sine(5.0, 3 / (2 * np.pi))


def by_hand(slope, sides, y, span=SPAN):
    """The state at the end, and the times of the switches: slope(t, y, signs) of the functions sides(t, y)."""
    t, times = 0.0, []
    signs = [np.sign(g(t, y)) for g in sides]
    while t < span:
        watched = []
        for g, side in zip(sides, signs, strict=True):
            event = lambda t, y, g=g: g(t, y)  # noqa: E731 - solve_ivp wants attributes on it
            event.terminal, event.direction = True, -side
            watched.append(event)
        run = solve_ivp(
            lambda t, y, signs=tuple(signs): slope(t, y, signs), (t, span), y,
            method="DOP853", rtol=1e-12, atol=1e-14, events=watched,
        )  # fmt: skip
        t, y = run.t[-1], run.y[:, -1]
        for i, found in enumerate(run.t_events):
            if run.status == 1 and len(found):
                signs[i] *= -1
        if run.status == 1:
            times.append(t)
    return y, times


def between_stops(t, y, signs):
    right, left = signs
    stop = 1e4 * (y[0] - 0.1) * (right > 0) + 1e4 * (y[0] + 0.1) * (left > 0)
    return [y[1], 5 * np.sin(3 * t) - 10 * y[0] - 0.1 * y[1] - stop]


STOPS = (lambda t, y: y[0] - 0.1, lambda t, y: -y[0] - 0.1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("kernels")


@pytest.fixture(scope="module")
def bump(folder):
    return qddot.load(qddot.generate(system("bump"), folder))


@pytest.fixture(scope="module")
def expected():
    y, times = by_hand(between_stops, STOPS, np.array([0.0, 1.0]))
    assert len(times) == 22
    return y


METHODS = [
    ("tsit5", TIGHT, 5e-6), ("dop853", TIGHT, 1e-6), ("vern7", TIGHT, 1e-6), ("ode45", TIGHT, 1e-5),
    ("rodas5p", TIGHT, 5e-5), ("ode15s", TIGHT, 5e-4), ("rk4", {"step": 1e-3, "switching": "locate"}, 5e-4),
]  # fmt: skip


@pytest.mark.parametrize(("method", "options", "tolerance"), METHODS)
def test_stops_are_met_as_by_hand(bump, expected, method, options, tolerance):
    run = qddot.simulate(bump, (0, SPAN), method=method, initial=[0, 1], inputs={"u": PUSH}, **options)
    np.testing.assert_allclose(run.states[-1], expected, rtol=0, atol=tolerance)
    ignored = qddot.simulate(
        bump, (0, SPAN), method=method, initial=[0, 1], inputs={"u": PUSH}, **options | {"switching": "ignore"}
    )
    if method != "ode15s":  # which starts anew at order 1 behind each switch
        worse = np.abs(ignored.states[-1] - expected).max()
        assert worse > 3 * np.abs(run.states[-1] - expected).max()
        if method in ("dop853", "vern7"):
            assert run.statistics.evaluations < 0.7 * ignored.statistics.evaluations


def test_what_lies_between_steps_and_events_are_those_of_the_branch(bump, expected):
    """A prepared run gives the same each time; events of stops; the state between saved points; back again."""
    events = [qddot.crossing(bump, "x", 0.1, called="right"), qddot.crossing(bump, "contact", 5.0, direction=1)]
    run = qddot.prepare(
        bump, (0, SPAN), method="dop853", initial=[0, 1], inputs={"u": PUSH}, events=events, rtol=1e-10, atol=1e-12
    )
    first, second = run(), run()
    assert np.array_equal(first.states, second.states)
    _, times = by_hand(between_stops, STOPS, np.array([0.0, 1.0]))
    right = first.events.times("right")
    assert all(np.abs(np.array(times) - t).min() < 1e-8 for t in right)
    within = np.linspace(0.05, SPAN, 40)
    for t, place in zip(within, first.at(within)["x"], strict=True):
        y, _ = by_hand(between_stops, STOPS, np.array([0.0, 1.0]), t) if t in within[::13] else (None, None)
        if y is not None:
            assert place == pytest.approx(y[0], abs=1e-7)
    back = qddot.simulate(
        bump, (SPAN, 0), method="dop853", initial=first.states[-1], inputs={"u": PUSH}, rtol=1e-11, atol=1e-13
    )
    np.testing.assert_allclose(back.states[-1], [0, 1], atol=1e-5)


def test_modes_are_no_business_of_who_reads_results(bump):
    run = qddot.simulate(bump, (0, 0.1), method="tsit5", initial=[0, 1], inputs={"u": PUSH})
    assert [each.name for each in run.quantities] == ["x", "xdot", "contact", "u"]
    assert bump.tables.free_inputs == ("u",)
    with pytest.raises(ValueError, match="mode_1"):
        qddot.simulate(bump, (0, 0.1), method="tsit5", initial=[0, 1], inputs={"mode_1": 1.0})
    page = text(describe(derive(system("bump")), "test.py"))
    assert "mode" not in page


def test_a_mode_holds_the_branch_however_the_state_moves(bump):
    """rhs and jacobian are those of the branch, smooth across the stop."""
    c_run = bump.constants(bump.parameter_values())
    names = [channel.name for channel in bump.tables.inputs]
    far = np.array([0.15, 0.0])
    u_run, dx, sides = np.zeros(len(names)), np.zeros(2), np.zeros(len(bump.tables.modes))
    bump.kernel("rhs")(0.0, far, u_run, c_run, dx)
    assert dx[1] == pytest.approx(-10 * 0.15 - 1e4 * 0.05)
    bump.kernel("modes")(0.0, np.zeros(2), u_run, c_run, sides)
    u_run[[names.index(name) for name in bump.tables.modes]] = sides * np.inf
    bump.kernel("rhs")(0.0, far, u_run, c_run, dx)
    assert dx[1] == pytest.approx(-10 * 0.15)


def test_a_step_of_constant_length_keeps_its_order_where_asked_to(bump, expected):
    errors = [
        np.abs(
            qddot.simulate(
                bump, (0, SPAN), method="rk4", initial=[0, 1], inputs={"u": PUSH}, step=step, switching="locate"
            ).states[-1]
            - expected
        ).max()
        for step in (1e-3, 2.5e-4)
    ]
    assert errors[0] / errors[1] > 100


@pytest.mark.parametrize("method", ["dop853", "tsit5", "rodas5p"])
def test_a_branch_that_ends_at_its_switch_is_passed(folder, method):
    """Max(-x, 0)**2.5 has no value beyond x = 0 on the branch that is held."""
    name = "root"
    made = system(
        name, -Max(-x, 0) ** 2 * Max(-x, 0) ** HALF * 200, outputs=[],
        potential_energy=0, generalized_forces={x: -k * x + 1500 * Max(-x, 0) ** 2 * Max(-x, 0) ** HALF},
        parameters=[Parameter(m, 1.0, "kg", "mass"), Parameter(k, 10.0, "N/m", "stiffness"),
                    Parameter(c, 0.1, "N s/m", "damping")], inputs=[],
    )  # fmt: skip
    model = qddot.load(qddot.generate(made, folder))
    run, before_zero = (
        qddot.simulate(model, span, method=method, initial=[0.5, 0], rtol=1e-9, atol=1e-11)
        for span in ((0, 3), (-3, 0))
    )
    np.testing.assert_allclose(before_zero.states[-1], run.states[-1], atol=1e-6)
    reference = solve_ivp(
        lambda t, y: [y[1], -10 * y[0] - 0.1 * y[1] + 1500 * max(-y[0], 0.0) ** 2.5], (0, 3), [0.5, 0.0],
        method="DOP853", rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    np.testing.assert_allclose(run.states[-1], reference.y[:, -1], atol=1e-6)


@pytest.fixture(scope="module")
def jumping(folder):
    """A relay with a dead zone that pushes outward, and a saturated actuator: jumps that are crossed."""
    force = 3.0 * Heaviside(x - a) - 2.0 * Heaviside(-x - a) + 4.0 * Min(Max(z, -HALF), HALF)
    made = system(
        "jumping", force, potential_energy=HALF * k * x**2, outputs=[],
        parameters=[Parameter(m, 1.0, "kg", "mass"), Parameter(k, 10.0, "N/m", "stiffness"),
                    Parameter(a, 0.1, "m", "free way"), Parameter(c, 0.1, "N s/m", "damping")],
        states=[State(z, -3 * z + 9 * x + Piecewise((xdot, (xdot > 0) & (x > a)), (0, True)), "1", "actuator", zdot)],
    )  # fmt: skip
    return qddot.load(qddot.generate(made, folder))


@pytest.mark.parametrize(("method", "tolerance"), [("dop853", 1e-6), ("tsit5", 1e-5), ("rodas5p", 1e-4)])
def test_jumps_are_crossed_at_their_time(jumping, method, tolerance):
    def slope(t, y, signs):
        right, left, high, low, forward = signs
        actuator = 0.5 if high > 0 else -0.5 if low > 0 else y[2]
        force = 3.0 * (right > 0) - 2.0 * (left > 0) + 4.0 * actuator
        return [
            y[1],
            np.sin(3 * t) * 5 - 10 * y[0] - 0.1 * y[1] + force,
            -3 * y[2] + 9 * y[0] + (y[1] if forward > 0 and right > 0 else 0.0),
        ]

    sides = (
        lambda t, y: y[0] - 0.1, lambda t, y: -y[0] - 0.1, lambda t, y: y[2] - 0.5,
        lambda t, y: -y[2] - 0.5, lambda t, y: y[1],
    )  # fmt: skip
    y, times = by_hand(slope, sides, np.array([0.3, 0.2, 0.0]))
    assert len(times) > 15
    run = qddot.simulate(
        jumping, (0, SPAN), method=method, initial=[0.3, 0.2, 0.0], inputs={"u": PUSH}, rtol=1e-9, atol=1e-11
    )
    np.testing.assert_allclose(run.states[-1], y, atol=tolerance)


def test_the_option_is_taken_or_refused_by_name(bump):
    run = {"initial": [0, 1], "inputs": {"u": PUSH}}
    with pytest.raises(ValueError, match="switching is 'find', expected 'locate' or 'ignore'"):
        qddot.simulate(bump, (0, 1), method="tsit5", switching="find", **run)
    with pytest.raises(ValueError, match=r"switching: method taylor takes none; .* choose euler"):
        qddot.simulate(bump, (0, 1), method="taylor", switching="locate", **run)
    with pytest.raises(ValueError, match="switching"):
        qddot.simulate_batch(bump, (0, 1), method="tsit5", switching="locate", runs=8, **run)


def test_a_batch_in_lanes_steps_over_switches(bump):
    """As one run that ignores them does."""
    batch = qddot.simulate_batch(
        bump, (0, 2), method="tsit5", initial=[0, 1], inputs={"u": PUSH}, runs=8, output_times=[2.0], **TIGHT
    )
    alone = qddot.simulate(
        bump, (0, 2), method="tsit5", initial=[0, 1], inputs={"u": PUSH}, switching="ignore", **TIGHT
    )
    np.testing.assert_allclose(batch["x"][0, -1], alone["x"][-1], atol=1e-4)


def test_rest_on_a_switch_is_no_trouble(folder):
    """x = 0 for good where |x| acts, and a slide along x = a: neither moves."""
    made = system(
        "resting", -k_b * x * sign(x) * x, potential_energy=0, outputs=[], inputs=[],
        generalized_forces={x: -k_b * x * sign(x) * x}, dissipation=0,
        parameters=[Parameter(m, 1.0, "kg", "mass"), Parameter(k_b, 10.0, "N/m^2", "stiffness")],
    )  # fmt: skip
    model = qddot.load(qddot.generate(made, folder))
    run = qddot.simulate(model, (0, 10), method="dop853", initial=[0, 0], rtol=1e-8, atol=1e-10)
    assert not run.states.any()


METHODS_THAT_SLIDE = [
    ("tsit5", TIGHT), ("dop853", TIGHT), ("vern7", TIGHT), ("ode23", {"rtol": 1e-6, "atol": 1e-9}), ("ode45", TIGHT),
    ("rodas5p", TIGHT), ("ode15s", TIGHT), ("rk4", {"step": 1e-2, "switching": "locate"}),
]  # fmt: skip


@pytest.fixture(scope="module")
def braked(folder):
    """Phi = 10 |v| on a unit mass and spring."""
    made = System(
        "braked", "A mass that is braked",
        [Coordinate(x, "m", "place")],
        [Parameter(m, 1.0, "kg", "mass"), Parameter(k, 1.0, "N/m", "stiffness"), Parameter(c, 10.0, "N", "brake")],
        HALF * m * xdot**2, HALF * k * x**2, c * Abs(xdot),
    )  # fmt: skip
    return qddot.load(qddot.generate(made, folder))


@pytest.mark.parametrize(("method", "options"), METHODS_THAT_SLIDE)
def test_a_brake_stops_for_good(braked, method, options):
    """x = -10 + 10 cos t + 5 sin t until v = 0 at atan(1/2), and then nothing moves, in a handful of steps."""
    stop = np.arctan(0.5)
    place = -10 + 10 * np.cos(stop) + 5 * np.sin(stop)
    run = qddot.simulate(braked, (0, 10), method=method, initial=[0, 5], **options)
    tolerance = 1e-6 if method in ("dop853", "tsit5", "vern7", "rk4") else 1e-4
    assert run["x"][-1] == pytest.approx(place, abs=tolerance)
    assert abs(run["xdot"][-1]) < 1e-12
    if method != "rk4":
        assert run.statistics.steps < 200
    assert run.at(stop + 0.1)["xdot"] == pytest.approx(0, abs=1e-9)
