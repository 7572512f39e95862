"""Where pieces of a table meet is a switch: located on the branch that goes on beyond it, in either argument.

Beside SciPy's DOP853 at 1e-12, run from one knot to the next with the piece written by hand.
"""

from bisect import bisect_right
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechanisms import HALF, coordinates, energy, off, parameters
from scipy.integrate import solve_ivp
from scipy.interpolate import RegularGridInterpolator
from sympy import Symbol, symbols

import qddot
from qddot.codegen.compare.command import run as compare
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.lagrange import derive
from qddot.model import Constraint, Input, Parameter, State, System, Table
from qddot.model.interpolation import alternating

x, xdot, y, ydot, m, J, c = symbols("x xdot y ydot m J c")
LINE = [-2.0, -1.0, 0.0, 0.5, 1.5]
PULL = {kind: [3.0, 1.0, 0.0, -2.0, -3.0] for kind in ("linear", "monotone", "cubic")}
#: The most evaluations of dop853 that locates, of those where it ignores: the first derivatives cost it most.
MOST = {"linear": 0.5, "monotone": 0.8, "cubic": 1.1}
SPAN, TIGHT = 10.0, {"rtol": 1e-9, "atol": 1e-11}


# What changes its sign

STEPS = st.lists(st.floats(0.01, 3.0), min_size=2, max_size=20)


@settings(max_examples=60, deadline=None)
@given(
    steps=st.lists(st.floats(0.01, 3.0), min_size=2, max_size=20), refused=st.booleans(), share=st.floats(0.01, 0.99)
)
def test_it_changes_its_sign_at_the_points_and_nowhere_else(steps, refused, share):
    line = np.cumsum(steps)
    knots, sides = alternating(tuple(line), refused=refused), []
    for a, b in zip([line[0] - 1, *line], [*line, line[-1] + 1], strict=True):
        places = [a + (b - a) * part for part in (0.01, share, 0.99)]
        signs = {float(np.sign(knots.at(place))) for place in places}
        assert len(signs) == 1
        sides += signs
    turns = [one != other for one, other in pairwise(sides)]
    assert turns == [not (refused and k in (0, len(line) - 1)) for k in range(len(line))]
    for point in line[1:-1] if refused else line:
        assert abs(knots.at(point)) < 1e-12
        before, after = (knots.at(np.nextafter(point, way), 1) for way in (-np.inf, np.inf))
        assert abs(before) == pytest.approx(1.0) and before == pytest.approx(after, abs=1e-9)


# A mass on a spring that is known by points


def mass(table, name, **changes):
    given = {
        "title": "Mass on a spring by points",
        "coordinates": coordinates("m", "x"),
        "parameters": [Parameter(m, 1.0, "kg", "mass")],
        "kinetic_energy": HALF * m * xdot**2,
        "generalized_forces": {x: table(x)},
    }
    return System(name=name, **given | changes)


def spring(kind, outside="hold"):
    return Table("pull", "N", LINE, PULL[kind], interpolation=kind, outside=outside, argument="m")


def by_pieces(rates, lines, start, span):
    """The state at the end; rates(t, state, cell) on the cell of each line's argument (value, points) that it is in."""
    t, state = 0.0, np.array(start)
    cell = [bisect_right(list(points), value(state)) for value, points in lines]
    while t < span:
        watched, ways = [], []
        for k, (value, points) in enumerate(lines):
            for step in (-1, 0):
                i = cell[k] + step
                if 0 <= i < len(points):
                    event = lambda t, state, v=value, at=points[i]: v(state) - at  # noqa: E731
                    event.terminal, event.direction = True, -1 if step else 1
                    watched.append(event)
                    ways.append((k, -1 if step else 1))
        run = solve_ivp(
            lambda t, state, cell=tuple(cell): rates(t, state, cell), (t, span), state, "DOP853",
            rtol=1e-12, atol=1e-14, events=watched,
        )  # fmt: skip
        t, state = run.t[-1], run.y[:, -1]
        for (k, way), found in zip(ways, run.t_events, strict=True):
            cell[k] += way * bool(len(found))
    return state


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


@pytest.fixture(scope="module", params=PULL)
def sprung(request, made):
    """The model, where it ends, and the kind of its table."""
    table = spring(request.param)

    def rates(t, state, cell):
        origin, *coefficients = table.pieces.pieces[cell[0]]
        return [state[1], np.polyval(coefficients[::-1], state[0] - origin)]

    end = by_pieces(rates, [(lambda s: s[0], LINE)], [1.2, 0.0], SPAN)
    return made(mass(table, f"sprung_{request.param}")), end, request.param


METHODS = [
    ("dop853", TIGHT, 5e-9), ("vern7", TIGHT, 1e-8), ("tsit5", TIGHT, 1e-8), ("ode45", TIGHT, 5e-8),
    ("ode23", {"rtol": 1e-6, "atol": 1e-8}, 1e-3), ("rodas5p", TIGHT, 1e-8), ("ode15s", TIGHT, 1e-6),
    ("rk4", {"step": 2e-3, "switching": "locate"}, 1e-9),
]  # fmt: skip


@pytest.mark.parametrize(("method", "options", "tolerance"), METHODS)
def test_a_mass_on_points_goes_from_knot_to_knot(sprung, method, options, tolerance):
    model, expected, _ = sprung
    run = qddot.simulate(model, (0, SPAN), method=method, initial=[1.2, 0.0], **options)
    np.testing.assert_allclose(run.states[-1], expected, rtol=0, atol=tolerance)


def test_knots_are_worth_their_search(sprung):
    model, expected, kind = sprung
    located, ignored = (
        qddot.simulate(model, (0, SPAN), method="dop853", initial=[1.2, 0.0], switching=way, **TIGHT)
        for way in ("locate", "ignore")
    )
    assert located.statistics.evaluations < MOST[kind] * ignored.statistics.evaluations
    errors = [np.abs(run.states[-1] - expected).max() for run in (located, ignored)]
    assert errors[0] < errors[1]


def test_a_piece_that_is_held_goes_on_beyond_its_end(made):
    """pull_held is the polynomial of the nearest piece of the sign that is held, whatever x is."""
    table = spring("linear")
    model = made(mass(table, "held"))
    pieces = table.pieces.pieces
    for at in np.linspace(-3.0, 3.0, 101):
        own = bisect_right(LINE, at)
        assert model.module.pull_held(at, 0.0) == pytest.approx(table.pieces.at(at), abs=1e-14)
        for mode, odd in ((np.inf, 0), (-np.inf, 1)):
            near = own if own % 2 == odd else own + 1 if own == 0 else own - 1
            if own % 2 != odd and 0 < own < len(LINE):
                near = own + 1 if at > (LINE[own - 1] + LINE[own]) / 2 else own - 1
            origin, value, slope, *_ = pieces[near]
            assert model.module.pull_held(at, mode) == pytest.approx(value + slope * (at - origin), abs=1e-13)


def test_lanes_step_over_knots_as_runs_that_ignore_them(sprung):
    model, _, _ = sprung
    starts = np.linspace(0.2, 1.4, 8)
    batch = qddot.simulate_batch(model, (0, 2), method="tsit5", initial={"x": starts}, output_times=[2.0], **TIGHT)
    for k, each in enumerate(starts):
        alone = qddot.simulate(model, (0, 2), method="tsit5", initial=[each, 0.0], switching="ignore", **TIGHT)
        assert batch["x"][k, -1] == pytest.approx(alone["x"][-1], abs=2e-6)


def test_which_knots_are_located(made):
    """Of tables of any kind, up to 100 points, at what moves; within where it refuses."""
    many = np.linspace(0.0, 1.0, 101)
    for table, argument, count in (
        (spring("linear"), x, 1),
        (Table("pull", "N", LINE, PULL["linear"], interpolation="cubic"), x, 1),
        (Table("pull", "N", many, many**2), x, 0),
        (Table("pull", "N", [0, 1], [0, 1], outside="refuse"), x, 0),
        (Table("pull", "N", LINE, PULL["linear"]), m, 0),
    ):
        system = mass(lambda _, table=table, argument=argument: table(argument), "tried")
        assert len(derive(system).modes.functions) == count


@pytest.fixture(scope="module")
def refusing(made):
    return made(mass(spring("linear", "refuse"), "refusing"))


@pytest.mark.parametrize("method", ["dop853", "ode15s", "rodas5p"])
def test_a_table_that_refuses_still_ends_the_run(refusing, method):
    with pytest.raises(qddot.IntegrationError, match=r"a table that refuses it: pull \(-2 to 1\.5 m\)"):
        qddot.simulate(refusing, (0, SPAN), method=method, initial=[0.0, 4.0], **TIGHT)


def test_pages_and_compare_show_tables_as_they_were_written(tmp_path, capsys):
    system = mass(spring("linear"), "shown")
    page = text(describe(derive(system), "test.py"))
    assert "pull(x)" in page and "held(" not in page and "mode" not in page
    model, sheet = tmp_path / "shown.py", tmp_path / "sheet.txt"
    model.write_text(
        "from sympy import symbols\nfrom qddot.model import Coordinate, Parameter, System, Table\n"
        "x, xdot, m = symbols('x xdot m')\npull = Table('pull', 'N', [0, 1, 2], [0, 1, 4])\n"
        "def system():\n    return System(name='shown', title='Shown', coordinates=[Coordinate(x, 'm', 'x')],\n"
        "        parameters=[Parameter(m, 1.0, 'kg', 'mass')], kinetic_energy=m * xdot**2 / 2,\n"
        "        potential_energy=pull(x)**2)\n"
    )
    sheet.write_text("x: m*xddot = -2*pull(x)*pull_slope(x)\n")
    assert compare(sheet, str(model), "text") == 0
    assert "equal" in capsys.readouterr().out


# Two arguments: an engine between the lines of its map

SPEEDS, PEDAL = [0.0, 150.0, 300.0, 450.0, 600.0], [0.0, 0.3, 0.6, 1.0]
TORQUE = [[-10, 60, 120, 150], [-15, 90, 180, 230], [-22, 80, 190, 260], [-30, 50, 150, 220], [-40, -10, 60, 120]]


def test_an_engine_goes_from_line_to_line_of_its_map(made):
    """The pedal swings, the throttle follows: both cross lines, at times of their own."""
    torque = Table("torque", "N m", SPEEDS, PEDAL, z=TORQUE, outside="extend", argument=("rad/s", "1"))
    a, u, phi, phidot = symbols("a u phi phidot")
    model = made(
        System(
            "engine",
            "Engine on its map",
            coordinates("rad", "phi"),
            parameters(J=(0.5, "kg m^2"), c=(0.0009, "N m s^2")),
            HALF * J * phidot**2,
            generalized_forces={phi: torque(phidot, a) - c * phidot**2},
            states=[State(a, 4 * (u - a), "1", "throttle")],
            inputs=[Input(u, "1", "pedal")],
        )
    )
    pedal = qddot.signal.sine(0.45, 0.5)
    pieces = torque.pieces

    def rates(t, state, cell):
        _, w, throttle = state
        i, k = cell
        cubic = pieces.patches[i][k]
        d, e = w - pieces.x[i], throttle - pieces.y[k]
        pull = cubic[0] + cubic[1] * e + d * (cubic[2] + cubic[3] * e)
        return [w, (pull - 0.0009 * w * w) / 0.5, 4 * (0.45 * np.sin(np.pi * t) - throttle)]

    lines = [(lambda s: s[1], SPEEDS), (lambda s: s[2], PEDAL)]
    end = by_pieces(rates, lines, [0.0, 200.0, 0.9], 6.0)
    grid = RegularGridInterpolator((SPEEDS, PEDAL), np.array(TORQUE, dtype=float))
    assert model.module.torque_held(210.0, 0.45, 0.0, 0.0) == pytest.approx(grid((210.0, 0.45)))
    run = qddot.simulate(model, (0, 6), initial=[0.0, 200.0, 0.9], inputs={"u": pedal}, method="dop853", **TIGHT)
    np.testing.assert_allclose(run.states[-1], end, rtol=1e-8)
    ignored = qddot.simulate(
        model, (0, 6), initial=[0.0, 200.0, 0.9], inputs={"u": pedal}, method="dop853", switching="ignore", **TIGHT
    )
    assert run.statistics.evaluations < ignored.statistics.evaluations


# In a constraint


def test_a_bead_on_a_monotone_wire(made):
    """The wire's curvature jumps at its points, and the force that it takes with it."""
    wire = Table("wire", "m", LINE, [0.3, 0.0, 0.1, 0.4, 0.5], interpolation="monotone", outside="extend")
    system = System(
        "bead",
        "Bead on a wire through points",
        coordinates("m", "x y"),
        parameters(m=(1.5, "kg"), k=(40.0, "N/m"), g=(9.81, "m/s^2")),
        HALF * m * (xdot**2 + ydot**2),
        HALF * Symbol("k") * x**2 + m * Symbol("g") * y,
        constraints=[Constraint(Symbol("lam"), y - wire(x), "N", "the wire")],
    )
    model = made(system)
    assert len(model.tables.modes) == 1

    def rates(t, state, cell):
        origin, *coefficients = wire.pieces.pieces[cell[0]]
        bend = np.polyder(np.poly1d(coefficients[::-1]), 2)(state[0] - origin)
        slope = np.polyder(np.poly1d(coefficients[::-1]))(state[0] - origin)
        right = 40.0 / 1.5 * state[0] + 9.81 * slope + slope * bend * state[1] ** 2
        return [state[1], -right / (1 + slope**2)]

    end = by_pieces(rates, [(lambda s: s[0], LINE)], [0.2, 6.0], 4.0)
    start = qddot.assemble(model, {"x": 0.2, "xdot": 6.0})
    run = qddot.simulate(model, (0, 4), initial=start, method="dop853", rtol=1e-10, atol=1e-12)
    assert run["x"].max() > 0.5 and run["x"].min() < -1.0
    np.testing.assert_allclose([run["x"][-1], run["xdot"][-1]], end, atol=1e-7)
    assert np.ptp(energy(model, run)) < 1e-7
    assert off(model, run).max() < 1e-12
