"""Tables of two arguments, engine maps and tyres: interpolated as SciPy does, differentiated by both, or refused."""

import re

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, RectBivariateSpline, RegularGridInterpolator
from sympy import Function, Rational, Symbol, cos, sin, symbols
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

import qddot
from qddot.codegen.compare.command import run as compare
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.generate import artefacts, generate
from qddot.codegen.lagrange import derive
from qddot.model import (
    Coordinate,
    Input,
    ModelError,
    Output,
    Parameter,
    Part,
    Quantity,
    State,
    System,
    Table,
    from_sympy,
)
from qddot.runner.lanes.kernel import lane_rhs

half = Rational(1, 2)
x, y, z, xdot, ydot, m, k, F, s, sdot = symbols("x y z xdot ydot m k F s sdot")


# Interpolation

STEPS = st.lists(st.floats(0.05, 2.0), min_size=2, max_size=7)


@pytest.mark.parametrize("kind", ["linear", "cubic"])
@settings(max_examples=40, deadline=None)
@given(along_x=STEPS, along_y=STEPS, seed=st.integers(0, 10_000), shares=st.tuples(*2 * [st.floats(0.0, 0.999)]))
def test_tables_of_two_arguments_interpolate_as_scipy_does(kind, along_x, along_y, seed, shares):
    X, Y = np.cumsum(along_x), np.cumsum(along_y)
    Z = np.random.default_rng(seed).uniform(-3, 3, (len(X), len(Y)))
    a, b = (line[0] + share * (line[-1] - line[0]) for line, share in zip((X, Y), shares, strict=True))
    pieces = Table("tried", "1", X, Y, z=Z, interpolation=kind).pieces
    if kind == "linear":
        assert abs(pieces.at(a, b) - RegularGridInterpolator((X, Y), Z)((a, b))) <= 1e-12
        return
    for by_x, by_y in ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)):
        if len(X) > 3 and len(Y) > 3:
            expected = RectBivariateSpline(X, Y, Z, kx=3, ky=3, s=0)(a, b, dx=by_x, dy=by_y).item()
        else:
            expected = CubicSpline(X, CubicSpline(Y, Z, axis=1)(b, by_y))(a, by_x)
        size = np.abs(Z).max() / (np.diff(X).min() ** by_x * np.diff(Y).min() ** by_y)
        assert abs(pieces.at(a, b, by_x, by_y) - expected) <= 1e-8 * size


@pytest.mark.parametrize(("kind", "most"), [("linear", 1), ("cubic", 3)])
def test_derivatives_are_differences_in_50_digits(kind, most):
    chance = np.random.default_rng(7)
    pieces = Table("tried", "1", [0, 1, 3, 4], [0, 2, 3, 5, 6], z=chance.normal(size=(4, 5)), interpolation=kind).pieces
    with mpmath.workdps(50):
        step = mpmath.mpf(10) ** -12
        for a, b in ((0.4, 1.1), (2.2, 2.5), (3.5, 4.4), (3.9, 5.9)):
            for by_x in range(most + 1):
                for by_y in range(most + 1):
                    ways = ((1, 0), by_x < most), ((0, 1), by_y < most)
                    for (dx, dy), further in ways:
                        a_1, a_2 = mpmath.mpf(a) + dx * step, mpmath.mpf(a) - dx * step
                        b_1, b_2 = mpmath.mpf(b) + dy * step, mpmath.mpf(b) - dy * step
                        difference = (pieces.at(a_1, b_1, by_x, by_y) - pieces.at(a_2, b_2, by_x, by_y)) / (2 * step)
                        expected = pieces.at(mpmath.mpf(a), mpmath.mpf(b), by_x + dx, by_y + dy) if further else 0
                        assert abs(difference - expected) < 1e-14  # of coefficients in doubles


def test_outside_in_both_directions():
    def made(outside, kind="linear"):
        return Table("tried", "1", [0, 1], [0, 2], z=[[1, 5], [2, 8]], outside=outside, interpolation=kind).pieces

    hold, extend, refuse = (made(each) for each in ("hold", "extend", "refuse"))
    assert [hold.at(*p) for p in ((-1, 0), (9, 9), (-1, 1), (0.5, 7), (1, 2))] == [1, 8, 3, 6.5, 8]
    assert [hold.at(*p, 1, 0) for p in ((-1, 1), (2, 1), (0.5, -3))] == [0, 0, 1]
    # 1 + x + 2 y + x y everywhere
    places = [(-1.0, -2.0), (3.0, 0.5), (0.5, 5.0), (2.0, 4.0), (-2.0, 1.0)]
    assert [extend.at(a, b) for a, b in places] == pytest.approx([1 + a + 2 * b + a * b for a, b in places])
    assert [refuse.at(0, 0), refuse.at(1, 2)] == [1, 8]
    beyond = [(1 + 1e-12, 1), (0.5, 2 + 1e-12), (-1e-12, 1), (0.5, -1e-12), (-1, 9)]
    assert np.isnan([refuse.at(*p, *orders) for p in beyond for orders in ((0, 0), (1, 0), (0, 1), (1, 1))]).all()
    assert np.isnan([made("refuse", "cubic").at(*p) for p in beyond]).all()


# A model with tables of two arguments everywhere

X, Y = [-2.0, -0.7, 0.1, 0.9, 2.0], [-2.0, -1.0, 0.3, 1.2, 2.1]
CHANCE = np.random.default_rng(11)
HILL = Table("hill", "m", X, Y, z=CHANCE.uniform(-1, 1, (5, 5)), interpolation="cubic", outside="extend")
DRAG = Table("drag", "N s/m", X, Y, z=CHANCE.uniform(0.5, 1, (5, 5)), meaning="drag of the hull", argument=("m/s", "m"))


def everywhere():
    """Tables of two arguments in T, Pi, Phi, Q, a quantity with a rate and a state's rate."""
    return System(
        name="hills",
        title="Tables of two arguments everywhere",
        coordinates=[Coordinate(x, "m", "east"), Coordinate(y, "m", "north")],
        states=[State(z, DRAG(xdot, z) * F - HILL(z, x * y), "m", "servo")],
        parameters=[Parameter(m, 2.0, "kg", "mass"), Parameter(k, 3.0, "N/m", "spring")],
        inputs=[Input(F, "N", "force")],
        quantities=[Quantity(s, HILL(x, y), "m", "height", rate=sdot)],
        kinetic_energy=half * m * (xdot**2 + ydot**2 + sdot**2),
        potential_energy=half * k * HILL(x + y, x - y) ** 2 + m * s,
        dissipation=half * DRAG(xdot, y) * xdot**2,
        generalized_forces={y: F * HILL(x, 1) - DRAG(ydot, z)},
        outputs=[Output(Symbol("slope"), sdot, "m/s", "rate of the height")],
    )


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return qddot.load(generate(everywhere(), tmp_path_factory.mktemp("hills")))


def by_hand(state, force):
    """The rates, from SciPy's interpolation and the equations on paper; a quantity's second rate included."""
    a, b, v, w, servo = state
    M, K = 2.0, 3.0
    spline = RectBivariateSpline(X, Y, np.array(HILL.z), kx=3, ky=3, s=0)
    grid = RegularGridInterpolator((X, Y), np.array(DRAG.z))

    def hill(p, q, i=0, j=0):
        return spline(p, q, dx=i, dy=j).item()

    def drag(p, q):
        return grid((p, q)).item()

    def drag_slope(p, q, d=1e-7):
        return (drag(p + d, q) - drag(p - d, q)) / (2 * d)

    slopes = np.array([hill(a, b, 1, 0), hill(a, b, 0, 1)])
    bends = np.array([[hill(a, b, 2, 0), hill(a, b, 1, 1)], [hill(a, b, 1, 1), hill(a, b, 0, 2)]])
    speeds = np.array([v, w])
    mass = M * (np.eye(2) + np.outer(slopes, slopes))
    stretch, p, q = hill(a + b, a - b), hill(a + b, a - b, 1, 0), hill(a + b, a - b, 0, 1)
    pulls = K * stretch * np.array([p + q, p - q]) + M * slopes
    damping = np.array([drag(v, b) * v + half_(drag_slope(v, b)) * v**2, 0.0])
    forces = np.array([0.0, force * hill(a, 1) - drag(w, servo)])
    right = forces - pulls - damping - M * slopes * (speeds @ bends @ speeds)
    return np.array([v, w, *np.linalg.solve(mass, right), drag(v, servo) * force - hill(servo, a * b)])


def half_(value):
    return 0.5 * value


def given(model, force):
    """All channels: the force, and modes that hold nothing."""
    return np.append(force, np.zeros(len(model.tables.inputs) - 1))


PLACES = np.random.default_rng(6).uniform(-0.65, 0.85, (30, 6))


def test_the_right_hand_side_is_that_on_paper(model):
    constants = model.constants(model.parameter_values())
    for *state, force in PLACES:
        dx, expected = np.empty(5), by_hand(state, force)
        model.kernel("rhs")(0.0, np.array(state), given(model, force), constants, dx)
        assert np.abs(dx - expected).max() <= 1e-7 * np.abs(expected).max()  # a difference stands in `by_hand`


def test_the_jacobian_is_that_of_the_right_hand_side(model):
    constants = model.constants(model.parameter_values())

    def rates(state, force):
        dx = np.empty(5)
        model.kernel("rhs")(0.0, state, given(model, force), constants, dx)
        return dx

    for *state, force in PLACES:
        found = model.matrix("jacobian")(0.0, np.array(state), given(model, force), constants)
        steps = 1e-6 * np.eye(5)
        expected = np.array([(rates(state + d, force) - rates(state - d, force)) / 2e-6 for d in steps]).T
        assert np.abs(found - expected).max() <= 1e-6 * np.abs(expected).max()


def test_only_what_is_called_is_written(tmp_path):
    written = generate(everywhere(), tmp_path).read_text()
    held = ["drag_held", "drag_by_y_held", "drag_by_x_held", "drag_by_xy_held"]
    assert re.findall(r"def (drag\w*)\(x, y, p, r\)", written) == held
    hills = re.findall(r"def (hill\w*)\(x, y, p, r\)", written)
    assert hills[:3] == ["hill_held", "hill_by_y_held", "hill_by_yy_held"]
    assert "# drag in N s/m: drag of the hull, 5 x 5 points from -2.0 to 2.0 m/s and -2.0 to 2.1 m, linear," in written
    assert written.count('("drag", "N s/m"') == 2


def test_pages_have_signs_of_partial_derivatives():
    document = describe(derive(everywhere()), "hills.py")
    lines = text(document)
    assert "drag  N s/m  drag of the hull, 5 x 5 points from -2.0 to 2.0 m/s and -2.0 to 2.1 m, linear" in lines
    assert "s = hill(x, y)" in lines
    assert "∂₁hill(x, y)" in lines and "∂₁²hill(x, y)" in lines and "∂₁∂₂hill(x, y)" in lines
    assert r"\partial_{1}\partial_{2}\text{hill}(x, y)" in tex(document)


def test_lanes_look_up_as_runs_alone_do(model):
    assert lane_rhs(model) is not None
    starts = np.linspace(-0.3, 0.6, 11)
    given = {"inputs": {"F": 0.5}, "method": "tsit5", "rtol": 1e-9, "atol": 1e-12}
    batch = qddot.simulate_batch(model, (0.0, 1.0), initial={"x": starts}, output_times=[1.0], **given)
    for i, each in enumerate(starts):
        alone = qddot.simulate(model, (0.0, 1.0), initial={"x": each}, **given)
        found, expected = ([run[name][index] for name in "xyz"] for run, index in ((batch, (i, -1)), (alone, -1)))
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8)


def test_what_is_no_number_is_looked_up_nowhere(model):
    """Neither infinite arguments nor those that are no numbers read beside the data."""
    values = [model.module.hill_held(a, b, 0.0, 0.0) for a in (np.inf, -np.inf, np.nan, 0.5) for b in (np.nan, np.inf)]
    assert not np.isfinite(values).any()
    assert model.module.drag_held(1e300, -1e300, 0.0, 0.0) == DRAG.z[-1][0]


# An engine on its map, which drives a car

SPEEDS, PEDAL = np.linspace(50.0, 650.0, 9), np.array([0.0, 0.1, 0.25, 0.5, 0.75, 1.0])
TORQUE = np.array([[-20 - 0.05 * n + p * (260 - ((n - 330) / 30) ** 2) for p in PEDAL] for n in SPEEDS])
omega, omegadot, theta, a, adot = symbols("omega omegadot theta a adot")


def engine(kind):
    """A flywheel that is driven by an engine and braked by the air; its throttle follows the pedal."""
    J, c, tau, u = symbols("J c tau u")
    torque = Table(
        "torque", "N m", SPEEDS, PEDAL, z=TORQUE, interpolation=kind, outside="extend", argument=("rad/s", "1")
    )
    thetadot = Symbol("thetadot")
    return System(
        name=f"engine_{kind}",
        title="Engine on its map",
        coordinates=[Coordinate(theta, "rad", "angle of the crankshaft")],
        states=[State(a, (u - a) / tau, "1", "throttle")],
        parameters=[
            Parameter(J, 0.8, "kg m^2", "inertia"),
            Parameter(c, 0.0007, "N m s^2", "drag of the air"),
            Parameter(tau, 0.2, "s", "lag of the throttle"),
        ],
        inputs=[Input(u, "1", "pedal")],
        kinetic_energy=half * J * thetadot**2,
        generalized_forces={theta: torque(thetadot, a) - c * thetadot**2},
    )


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """The engine, how it starts, for how long it runs, and where it is then by SciPy."""
    spline = RectBivariateSpline(SPEEDS, PEDAL, TORQUE, kx=3, ky=3, s=0)

    def slope(t, state):
        _, w, throttle = state
        return [w, (spline(w, throttle).item() - 0.0007 * w * w) / 0.8, (0.9 - throttle) / 0.2]

    start, span = [0.0, 90.0, 0.05], (0.0, 3.0)
    expected = solve_ivp(slope, span, start, method="DOP853", rtol=1e-12, atol=1e-12, max_step=0.01).y[:, -1]
    return qddot.load(generate(engine("cubic"), tmp_path_factory.mktemp("engine"))), start, span, expected


@pytest.mark.parametrize(("method", "tolerance"), [("dop853", 1e-10), ("rodas5p", 1e-7)])
def test_an_engine_on_its_map_beside_scipy(driven, method, tolerance):
    model, start, span, expected = driven
    assert expected[1] > 300  # across most of the map
    tight = {"rtol": 1e-12, "atol": 1e-12} if method == "dop853" else {"rtol": 1e-10, "atol": 1e-10}
    run = qddot.simulate(model, span, initial=start, inputs={"u": 0.9}, method=method, **tight)
    np.testing.assert_allclose(run.states[-1], expected, rtol=tolerance)


def test_a_run_that_leaves_the_map_names_both_of_its_arguments(tmp_path):
    table = Table("torque", "N", [-1, 1], [-1, 1], z=[[0, 1], [1, 2]], outside="refuse", argument=("m", "m/s"))
    model = qddot.load(generate(with_table(table(x, xdot), name="beyond"), tmp_path))
    with pytest.raises(qddot.IntegrationError, match=r"torque \(-1 to 1 m\), torque \(-1 to 1 m/s\)"):
        qddot.simulate(model, (0.0, 9.0), method="tsit5", initial=[0.0, 0.0])


# Other rooms


def test_compare_knows_tables_and_their_derivatives(tmp_path, capsys):
    model = tmp_path / "hilly.py"
    model.write_text(
        "from sympy import symbols\nfrom qddot.model import Coordinate, Parameter, System, Table\n"
        "x, y, xdot, ydot, m = symbols('x y xdot ydot m')\n"
        "hill = Table('hill', 'm', [0, 1, 2, 3], [0, 1, 2, 3], interpolation='cubic',\n"
        "             z=[[i * k % 3 for k in range(4)] for i in range(4)])\n"
        "dip = Table('dip', 'm', [0, 1, 3], [1, 2, 0], interpolation='cubic')\n"
        "def system():\n"
        "    places = [Coordinate(x, 'm', 'x'), Coordinate(y, 'm', 'y')]\n"
        "    return System(name='hilly', title='Hills', coordinates=places,\n"
        "    parameters=[Parameter(m, 1.0, 'kg', 'mass')], kinetic_energy=m * (xdot**2 + ydot**2) / 2,\n"
        "    potential_energy=m * hill(x, y) + m * dip(x)**2)\n"
    )
    right = "x: m*xddot + m*hill_by_x(x, y) + 2*m*dip(x)*dip_slope(x) = 0\ny: m*yddot = -m*hill_by_y(x, y)\n"
    sheets = {
        right: (0, "2 of 2 equations are equal"),
        right.replace("hill_by_y(x, y)", "hill_by_y(y, x)"): (1, "hill"),
        right.replace("dip_slope(x)", "dip_curvature(x)"): (1, "dip"),
    }
    for sheet, (code, said) in sheets.items():
        path = tmp_path / "sheet.txt"
        path.write_text(sheet)
        assert compare(path, str(model), "text") == code
        assert said in capsys.readouterr().out
        assert compare(path, str(model), "latex") == code
        assert "hill_by" not in capsys.readouterr().out
    for wrong, message in (("hill(x)", "hill takes 2 arguments"), ("hil(x, y)", "hil is no function (there are abs,")):
        path.write_text(f"x: m*xddot = {wrong}\n")
        with pytest.raises(Exception, match=re.escape(message)):
            compare(path, str(model), "text")


def test_copies_of_a_part_look_up_their_own_arguments(tmp_path):
    tyre = Table("tyre", "N", [-1, 0, 1], [0, 5], z=[[-1, -9], [0, 0], [1, 9]], argument=("m", "N"))
    load = Symbol("load")
    wheel = Part(
        "wheel",
        coordinates=[Coordinate(x, "m", "slip of the {}")],
        parameters=[Parameter(m, 1.0, "kg", "mass"), Parameter(load, 2.0, "N", "load")],
        kinetic_energy=half * m * xdot**2,
        generalized_forces={x: -tyre(x, load)},
    )
    model = qddot.load(generate((wheel("f", "front") + wheel("r", "rear", load=3.0)).system("two", "Two"), tmp_path))
    dx = np.empty(4)
    model.kernel("rhs")(0.0, np.array([0.5, -0.5, 0, 0]), np.zeros(4), model.constants(model.parameter_values()), dx)
    assert dx[2:] == pytest.approx([-0.5 * (1 + 8 * 2 / 5), 0.5 * (1 + 8 * 3 / 5)])


def test_a_method_of_sympys_mechanics_may_hold_one():
    q, t = dynamicsymbols("q"), dynamicsymbols._t
    lagrangian = m * q.diff(t) ** 2 / 2 - HILL(q, sin(q))
    made = from_sympy(
        LagrangesMethod(lagrangian, [q]),
        name="sliding",
        title="sliding",
        coordinates=[Coordinate(q, "m", "place")],
        parameters=[Parameter(m, 1.0, "kg", "mass")],
    )
    q = Symbol("q")
    assert made.potential_energy == HILL(q, sin(q))
    by_x, by_y = HILL.function((1, 0)), HILL.function((0, 1))
    assert made.potential_energy.diff(q) == by_x(q, sin(q)) + cos(q) * by_y(q, sin(q))
    assert not made.potential_energy.diff(q, 2).has(Function("Subs"))


# From files


def read(tmp_path, content, **changes):
    (tmp_path / "map.csv").write_text(content)
    given = {"file": tmp_path / "map.csv", "argument": ("rad/s", "1")}
    return Table("torque", "N m", **given | changes)


ROWS = "speed [rpm];pedal [%];torque [kN m]\n3000;0;-0,02\n3000;100;0,2\n1500;100;0,1\n1500;0;-0,01\n"


def test_points_come_from_three_columns_in_any_order(tmp_path):
    table = read(tmp_path, ROWS)
    assert table.x == pytest.approx((50 * np.pi, 100 * np.pi))
    assert table.y == (0.0, 1.0)
    assert table.z == ((-10.0, 100.0), (-20.0, 200.0))


GRID = {"x": [0, 1], "y": [0, 1], "z": [[1, 2], [3, 4]]}


def made(**changes):
    return Table("map", "N", **GRID | changes)


WRONG = {
    "monotone": (
        lambda _: made(interpolation="monotone"),
        "interpolation is 'monotone', expected linear or cubic of two",
    ),
    "rows": (lambda _: made(z=[[1, 2]]), "map: has 2 x and 1 rows of z, expected one for each x"),
    "short row": (lambda _: made(z=[[1, 2], [3]]), "has 2 y, and z[1] is 1 numbers, expected a number for each y"),
    "flat": (lambda _: made(z=[1, 2]), "has 2 y, and z[0] is 1, expected a number for each y"),
    "text": (lambda _: made(z=[[1, 2], [3, "4"]]), "z[1][1] is '4', expected a finite number"),
    "nan": (lambda _: made(z=[[1, 2], [3, np.nan]]), "z[1][1] is nan, expected a finite number"),
    "order": (lambda _: made(y=[1, 0]), "y[1] = 0 is not greater than y[0] = 1"),
    "one line": (lambda _: made(x=[0], z=[[1, 2]]), "has 1 x and 2 y, expected two or more of each, and 4000 points"),
    "many": (lambda _: made(x=range(64), y=range(64), z=np.zeros((64, 64))), "has 64 x and 64 y, expected two or"),
    "one unit": (lambda _: made(argument="m"), "has the argument 'm' and z: give two units, of x and of y"),
    "two units": (lambda _: Table("map", "N", [0, 1], [0, 1], argument=("m", "s")), "has the units m, s of arguments"),
    "missing": (
        lambda path: read(path, ROWS.replace("1500;0;-0,01\n", "")),
        "no row for x = 157.07963267948966, y = 0.0; a",
    ),
    "twice": (lambda path: read(path, f"{ROWS}1500;0;1\n"), "line 6: the point x = 157.07963267948966, y = 0.0 is"),
    "two columns": (lambda path: read(path, "a,b\n1,2\n3,4\n"), "line 2: no column '2'; the line has 2 of 3 columns"),
    "three units": (lambda path: read(path, ROWS, argument=("1", "1", "1")), "has 3 units of arguments, expected one"),
    "unit": (lambda path: read(path, ROWS, argument=("m", "1")), "column 'speed': [rpm] cannot be turned into [m]"),
    "both": (lambda path: read(path, ROWS, z=[[1, 2], [3, 4]]), "has points and a file; give one of them"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_no_table_of_two_arguments_is_refused_by_name(case, tmp_path):
    make, message = WRONG[case]
    with pytest.raises(ValueError, match=re.escape(message)):
        make(tmp_path)


def with_table(force, name="tried"):
    return System(
        name=name,
        title="tried",
        coordinates=[Coordinate(x, "m", "place")],
        parameters=[Parameter(m, 2.0, "kg", "mass")],
        kinetic_energy=half * m * xdot**2,
        generalized_forces={x: force},
    )


IN_MODELS = {
    "unit": (lambda: made(argument=("m", "kgg"))(x, xdot), "table map has the unit 'kgg'"),
    "dimension": (
        lambda: made(argument=("m", "m"))(x, xdot),
        "generalized force of x gives the table map xdot, which is in m/s, expected m",
    ),
    "one of a line": (
        lambda: Table("line", "N", [0, 1], [0, 1], argument="m/s")(x),
        "generalized force of x gives the table line x, which is in m, expected m/s",
    ),
    "name of a line": (lambda: made()(x, xdot) * Symbol("map_pieces_x"), "uses map_pieces_x, which is not declared"),
    "unknown": (lambda: made()(x, k), "generalized force of x uses k, which is not declared"),
}


@pytest.mark.parametrize("case", IN_MODELS)
def test_what_a_model_cannot_hold_is_refused_by_name(case):
    make, message = IN_MODELS[case]
    with pytest.raises(ModelError) as refused:
        artefacts(with_table(make()), "tried.py")
    assert message in str(refused.value)


def test_calls_need_both_arguments():
    with pytest.raises(TypeError, match="takes exactly 2 arguments"):
        HILL(x)
