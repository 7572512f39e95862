"""Tables of a state: interpolated as SciPy does, differentiated by the chain rule, alone and in lanes, refused."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator, make_interp_spline
from sympy import Abs, Max, Rational, Symbol, symbols

import qddot
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.page import html
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.generate import artefacts, generate
from qddot.codegen.lagrange import derive
from qddot.codegen.slips import explained
from qddot.model import Coordinate, Input, ModelError, Output, Parameter, Quantity, State, System, Table
from qddot.runner.lanes.kernel import lane_rhs

half = Rational(1, 2)
x, xdot, m, k, c, A, F, s, sdot, z = symbols("x xdot m k c A F s sdot z")


# Interpolation

POINTS = st.lists(st.tuples(st.floats(0.01, 3.0), st.floats(-5.0, 5.0)), min_size=2, max_size=20)
PEERS = {
    "linear": lambda x, y: make_interp_spline(x, y, k=1),
    "cubic": CubicSpline,
    "monotone": lambda x, y: PchipInterpolator(x, y) if len(x) > 2 else make_interp_spline(x, y, k=1),
}


@pytest.mark.parametrize("kind", PEERS)
@settings(max_examples=60, deadline=None)
@given(points=POINTS, share=st.floats(0.0, 0.999))
def test_tables_interpolate_as_scipy_does(kind, points, share):
    steps, values = zip(*points, strict=True)
    knots = np.cumsum(steps)
    at = knots[0] + share * (knots[-1] - knots[0])
    table, peer = Table("tried", "1", knots, values, interpolation=kind), PEERS[kind](knots, values)
    for order in range(2 if kind == "linear" or len(points) == 2 else 3):
        expected = float(peer.derivative(order)(at) if order else peer(at))
        size = np.abs(values).max() / min(steps) ** order
        assert abs(table.pieces.at(at, order) - expected) <= 1e-9 * (size + abs(expected))


def test_outside_of_a_table():
    ends = {
        kind: Table("tried", "1", [0, 1, 3], [1, 2, 0], outside=kind).pieces for kind in ("hold", "extend", "refuse")
    }
    assert [ends["hold"].at(at) for at in (-1, 0, 3, 5)] == [1, 1, 0, 0]
    assert [ends["hold"].at(at, 1) for at in (-1, 5)] == [0, 0]
    assert [ends["extend"].at(at) for at in (-1, 0, 3, 5)] == [0, 1, 0, -2]
    assert [ends["refuse"].at(at) for at in (0, 3)] == [1, 0]
    assert np.isnan([ends["refuse"].at(at, order) for at in (-1e-9, 3 + 1e-9) for order in (0, 1)]).all()


# A model with tables everywhere

LIFT = Table("lift", "m", [-2, -1, 0, 1, 2.5], [0.3, -0.4, 0.2, 0.8, 0.1], interpolation="cubic", outside="extend")
GAIN = Table("gain", "1", [-3, -1, 2, 4], [0.5, 1.0, 1.5, 4.0], interpolation="monotone", meaning="gain of the servo")
CURVE = Table("curve", "N", [-2.0, 0.1, 2.0], [3.0, -1.0, 2.0], outside="hold", argument="m")


def everywhere():
    """Tables in T, Pi, Phi, Q, a quantity with a rate, a state's rate and an output, of each other too."""
    return System(
        name="everywhere",
        title="Tables everywhere",
        coordinates=[Coordinate(x, "m", "place")],
        states=[State(z, CURVE(x - z) - LIFT(z) * xdot, "m", "servo")],
        parameters=[
            Parameter(m, 2.0, "kg", "mass"),
            Parameter(k, 3.0, "N/m", "spring"),
            Parameter(A, 0.7, "1", "share"),
        ],
        inputs=[Input(F, "N", "force")],
        quantities=[Quantity(s, LIFT(x) + A * x, "m", "stretch", rate=sdot), Quantity(c, GAIN(A), "1", "fixed gain")],
        kinetic_energy=half * m * xdot**2 * (3 + LIFT(2 * x)),
        potential_energy=half * k * s**2,
        dissipation=half * GAIN(xdot) * xdot**2 + c * sdot**2,
        generalized_forces={x: F * GAIN(LIFT(x) + z) - CURVE(Max(x, z))},
        outputs=[Output(Symbol("slope"), sdot, "m/s", "rate of the stretch")],
    )


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return qddot.load(generate(everywhere(), tmp_path_factory.mktemp("everywhere")))


def by_hand(state, force):
    X, V, Z = state
    M, K, share = 2.0, 3.0, 0.7
    lift, gain = CubicSpline(LIFT.x, LIFT.y), PchipInterpolator(GAIN.x, GAIN.y)

    def curve(at):
        return np.interp(at, CURVE.x, CURVE.y)

    def hold(at):
        return gain(np.clip(at, GAIN.x[0], GAIN.x[-1]))

    stretch, rise = lift(X) + share * X, lift(X, 1) + share
    right = force * hold(lift(X) + Z) - curve(max(X, Z)) - K * stretch * rise
    right -= half_slope(gain, V) + 2 * hold(share) * rise**2 * V + M * lift(2 * X, 1) * V**2
    Z_dot = curve(X - Z) - lift(Z) * V
    return np.array([V, right / (M * (3 + lift(2 * X))), Z_dot])


def half_slope(gain, V):
    """The derivative of gain(v) v^2 / 2."""
    return gain(V) * V + 0.5 * gain(V, 1) * V**2


def given(model, force):
    """All channels: the force, and modes that hold nothing."""
    return np.append(force, np.zeros(len(model.tables.inputs) - 1))


PLACES = np.random.default_rng(6).uniform(-0.9, 0.9, (40, 4))


def test_the_right_hand_side_is_that_on_paper(model):
    constants = model.constants(model.parameter_values())
    for *state, force in PLACES:
        dx, expected = np.empty(3), by_hand(state, force)
        model.kernel("rhs")(0.0, np.array(state), given(model, force), constants, dx)
        assert np.abs(dx - expected).max() <= 1e-12 * np.abs(expected).max()


def test_the_jacobian_is_that_on_paper(model):
    constants = model.constants(model.parameter_values())
    for *state, force in PLACES:
        found = model.matrix("jacobian")(0.0, np.array(state), given(model, force), constants)
        steps = 1e-6 * np.eye(3)
        expected = np.array([(by_hand(state + d, force) - by_hand(state - d, force)) / 2e-6 for d in steps]).T
        assert np.abs(found - expected).max() <= 1e-6 * np.abs(expected).max()


def test_only_what_is_called_is_written(tmp_path):
    text = generate(everywhere(), tmp_path).read_text()
    assert "import numpy as np" in text
    assert re.findall(r"def ((?:lift|gain|curve)\w*)", text) == [
        *("curve_knots", "curve_knots_slope", "curve_held", "curve_slope_held"),
        *("gain_knots", "gain_knots_slope", "gain", "gain_held", "gain_slope_held", "gain_curvature_held"),
        *("lift_knots", "lift_knots_slope", "lift_held", "lift_slope_held", "lift_curvature_held"),
    ]
    assert "# gain in 1: gain of the servo, 4 points from -3.0 to 4.0, monotone, its ends held outside;" in text


def test_pages_have_tables_with_primes_for_derivatives():
    document = describe(derive(everywhere()), "everywhere.py")
    lines = text(document)
    assert "Tables\n──────\n  curve  N  3 points from -2.0 to 2.0 m, linear, its ends held outside\n" in lines
    assert "s = lift(x) + A·x" in lines
    assert "lift′(2·x)" in lines
    assert r"\text{lift}'(2 x)" in tex(document)
    assert '<section id="tables"><h2>Tables</h2>' in html(document)


def test_lanes_and_stages_look_up_as_runs_alone_do(model):
    assert lane_rhs(model) is not None
    starts = np.linspace(-0.3, 0.8, 11)  # SciPy goes on as a cubic outside
    settings = {"inputs": {"F": 0.5}, "method": "tsit5", "rtol": 1e-9, "atol": 1e-12}
    batch = qddot.simulate_batch(model, (0.0, 2.0), initial={"x": starts}, output_times=[2.0], **settings)
    for k, each in enumerate(starts):
        alone = qddot.simulate(model, (0.0, 2.0), initial={"x": each}, **settings)
        expected = solve_ivp(lambda t, y: by_hand(y, 0.5), (0, 2), [each, 0, 0], rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose([batch[name][k, -1] for name in "xz"], [alone[name][-1] for name in "xz"], rtol=1e-6)
        np.testing.assert_allclose(alone.states[-1], expected.y[:, -1], rtol=1e-5, atol=1e-7)


# A hydraulic recoil brake, whose orifice closes with the stroke

STROKE, AREA = [0.0, 0.05, 0.2, 0.4, 0.6, 0.75], [9e-4, 8.5e-4, 7e-4, 5e-4, 2.5e-4, 0.4e-4]
BRAKE = {"m": 900.0, "k": 6000.0, "A": 0.006, "rho": 870.0, "C_d": 0.65}


@pytest.fixture(scope="module")
def brake(tmp_path_factory):
    """The pressure of an orifice, p = rho/2 (A v / (C_d a))^2, on the piston's area A."""
    rho, C_d, p = symbols("rho C_d p")
    area = Table("area", "m^2", STROKE, AREA, argument="m", outside="refuse", meaning="orifice of the recoil brake")
    system = System(
        name="brake",
        title="Hydraulic recoil brake",
        coordinates=[Coordinate(x, "m", "recoil")],
        parameters=[Parameter(Symbol(name), value, "1", f"parameter {name}") for name, value in BRAKE.items()],
        inputs=[Input(F, "N", "force")],
        quantities=[Quantity(p, half * rho * (A * xdot / (C_d * area(x))) ** 2, "Pa", "pressure")],
        kinetic_energy=half * m * xdot**2,
        potential_energy=half * k * x**2,
        generalized_forces={x: F - A * p * Abs(xdot) / xdot},
        outputs=[Quantity(p, half * rho * (A * xdot / (C_d * area(x))) ** 2, "Pa", "pressure")],
    )
    return qddot.load(generate(system, tmp_path_factory.mktemp("brake")))


def braking(t, state):
    X, V = state
    pressure = 0.5 * 870.0 * (0.006 * V / (0.65 * np.interp(X, STROKE, AREA))) ** 2
    return [V, (-6000.0 * X - 0.006 * pressure * np.sign(V)) / 900.0]


def test_the_recoil_brake_does_what_scipy_computes_with_interp(brake):
    start, end = [0.0, 12.0], 0.05
    expected = solve_ivp(braking, (0.0, end), start, method="DOP853", rtol=1e-13, atol=1e-15, max_step=1e-4)
    run = qddot.simulate(
        brake, (0.0, end), initial={"xdot": 12.0}, inputs={"F": 0.0}, method="dop853", rtol=1e-13, atol=1e-15
    )
    assert expected.y[0, -1] > STROKE[2]  # past knots
    np.testing.assert_allclose(run.states[-1], expected.y[:, -1], rtol=1e-10)


def test_a_table_has_no_taylor_series(brake):
    with pytest.raises(qddot.LoadError, match="no Taylor series: the table area has no recurrence"):
        qddot.simulate(brake, (0.0, 0.1), initial={"xdot": 1.0}, inputs={"F": 0.0}, method="taylor")


@pytest.mark.parametrize("method", ["tsit5", "dop853", "rodas5p", "ode15s"])
def test_a_run_that_leaves_a_table_says_so(brake, method):
    """Slowly, too: where a step that the time still sees no longer moves the recoil, it must not creep for ever."""
    message = r"beyond the points of a table that refuses it: area \(0 to 0\.75 m\)"
    with pytest.raises(qddot.IntegrationError, match=message):
        qddot.simulate(brake, (0.0, 1.0), initial={"xdot": 60.0}, inputs={"F": 0.0}, method=method, max_steps=20_000)


def test_a_lane_that_leaves_a_table_ends_there(brake):
    settings = {"inputs": {"F": 0.0}, "method": "tsit5", "max_steps": 20_000, "output_times": [0.05]}
    batch = qddot.simulate_batch(brake, (0.0, 0.05), initial={"xdot": np.array([12.0, 60.0])}, **settings)
    assert batch.failed_state[0] == ""
    assert batch.failed_state[1] in ("x", "xdot")


# From files


def test_points_come_from_a_file_beside_the_model_with_their_units(tmp_path):
    (tmp_path / "orifice.csv").write_text("# measured\nstroke [mm];area [cm^2]\n0;9,5\n250;4\n")
    (tmp_path / "made.py").write_text(
        "from qddot.model import Table\narea = Table('area', 'm^2', file='orifice.csv', argument='m')\n"
    )
    names = {"__file__": str(tmp_path / "made.py")}
    exec(compile((tmp_path / "made.py").read_text(), "made.py", "exec"), names)
    assert names["area"].x == (0.0, 0.25)
    assert names["area"].y == pytest.approx((9.5e-4, 4e-4))


WRONG = {
    "order": (lambda: Table("area", "m", [0, 2, 1], [1, 2, 3]), "table area: x[2] = 1 is not greater than x[1] = 2"),
    "repeated": (lambda: Table("area", "m", [0, 0], [1, 2]), "x[1] = 0 is not greater than x[0] = 0"),
    "one point": (lambda: Table("area", "m", [0], [1]), "has 1 x and 1 y, expected as many of both, 2 to 4000"),
    "lengths": (lambda: Table("area", "m", [0, 1], [1]), "has 2 x and 1 y"),
    "no points": (lambda: Table("area", "m"), "has 0 x and 0 y"),
    "no number": (lambda: Table("area", "m", [0, 1], [1, "2"]), "y[1] is '2', expected a finite number"),
    "infinite": (lambda: Table("area", "m", [0, 1], [1, np.inf]), "y[1] is inf, expected a finite number"),
    "kind": (
        lambda: Table("area", "m", [0, 1], [1, 2], interpolation="quadratic"),
        "interpolation is 'quadratic', expect",
    ),
    "outside": (lambda: Table("area", "m", [0, 1], [1, 2], outside="wrap"), "outside is 'wrap', expected hold, extend"),
    "both": (lambda: Table("area", "m", [0, 1], [1, 2], file="a.csv"), "has points and a file; give one of them"),
    "no file": (lambda: Table("area", "m", file="/no/such.csv"), "table area: /no/such.csv: No such file or directory"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_no_table_is_refused_by_name(case):
    make, message = WRONG[case]
    with pytest.raises(ValueError, match=re.escape(message)):
        make()


def with_table(table, argument=x, **changes):
    given = {
        "coordinates": [Coordinate(x, "m", "place")],
        "parameters": [Parameter(m, 2.0, "kg", "mass")],
        "kinetic_energy": half * m * xdot**2,
        "generalized_forces": {x: table(argument)},
    }
    return artefacts(System(name="tried", title="tried", **given | changes), "tried.py")


LINE = ([0, 1], [1, 2])
REFUSED = {
    "name of a symbol": (lambda: with_table(Table("m", "N", *LINE)), "m is used twice, as parameter and as table"),
    "name of a slope": (
        lambda: with_table(Table("m", "N", *LINE), parameters=[Parameter(Symbol("m_slope"), 1.0, "1", "m")],
                           kinetic_energy=Symbol("m_slope") * xdot**2),
        "m_slope is used twice, as parameter and as table",
    ),
    "two of a name": (
        lambda: with_table(Table("a", "N", *LINE), potential_energy=Table("a", "N", [0, 1], [2, 3])(x)),
        "a is used twice, as table and as table",
    ),
    "name of a kernel": (lambda: with_table(Table("rhs", "N", *LINE)), "table 'rhs' would shadow a name"),
    "no name": (lambda: with_table(Table("a b", "N", *LINE)), "table 'a b' is not a valid identifier"),
    "unit": (lambda: with_table(Table("a", "kgg", *LINE)), "table a has the unit 'kgg'"),
    "argument": (lambda: with_table(Table("a", "N", *LINE, argument="mmm")), "table a has the unit 'mmm'"),
    "unknown symbol": (lambda: with_table(Table("a", "N", *LINE), argument=k), "generalized force of x uses k, which"),
    "slope that jumps in T": (
        lambda: with_table(
            Table("a", "N", *LINE), quantities=[Quantity(s, Table("b", "m", *LINE)(x), "m", "height", rate=sdot)],
            kinetic_energy=half * m * sdot**2 + half * m * xdot**2,
        ),
        "kinetic energy jumps at the points of the table b: its force would be an impulse, which is lost",
    ),
    "infinite argument": (lambda: with_table(Table("a", "N", *LINE), argument=x / 0), "divided by zero"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_model_cannot_hold_is_refused_by_name(case):
    make, message = REFUSED[case]
    with pytest.raises(ModelError) as refused:
        make()
    assert message in str(refused.value)


def test_an_argument_too_many_is_refused_with_its_line(tmp_path):
    path = tmp_path / "model.py"
    path.write_text("")
    with pytest.raises(ModelError, match=r"takes .* 1 argument"), explained(path):
        CURVE(x, x)
