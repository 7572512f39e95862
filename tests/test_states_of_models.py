"""States of first order beside the coordinates: derived as on paper, refused by name, written down, compared."""

import warnings

import numpy as np
import pytest
from derived import generated_module
from scipy.integrate import solve_ivp
from sympy import Abs, I, Rational, Symbol, cos, floor, symbols

import qddot
from qddot.codegen.compare.difference import compare
from qddot.codegen.compare.sheet import read
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.page import html
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.generate import generate
from qddot.codegen.lagrange import derive
from qddot.model import Coordinate, Input, ModelError, Output, Parameter, Quantity, State, System

x, xdot, xddot, z, zdot, y, ydot, m, k, alpha, A, gamma, beta, w, wdot, v, s, sdot = symbols(
    "x xdot xddot z zdot y ydot m k alpha A gamma beta w wdot v s sdot"
)
half = Rational(1, 2)
HYSTERESIS = State(z, A * v - gamma * Abs(v) * Abs(z) * z - beta * v * z**2, "m", "hysteresis of the damper")
INTEGRAL = State(y, x - w + 3 * cos(y), "m s", "integral")
SPEED, STRETCH = Quantity(v, xdot - wdot, "m/s", "speed"), Quantity(s, x + 2 * z, "m", "stretch", rate=sdot)
VALUES = {m: 2.0, k: 3.0, alpha: 5.0, A: 1.0, gamma: 7.0, beta: 3.0}


def bouc_wen(**changes):
    """A mass on a spring and a hysteresis, shaken at its foot; z in T, Pi, Phi and Q, its rate in Q and an output."""
    given = {
        "coordinates": [Coordinate(x, "m", "displacement")],
        "states": [HYSTERESIS, INTEGRAL],
        "parameters": [Parameter(symbol, value, "1", f"parameter {symbol}") for symbol, value in VALUES.items()],
        "inputs": [Input(w, "m", "foot")],
        "quantities": [SPEED, STRETCH],
        "kinetic_energy": half * m * xdot**2 * (1 + z**2),
        "potential_energy": half * k * s**2,
        "dissipation": half * alpha * v**2 * (1 + Abs(z)),
        "generalized_forces": {x: -alpha * z - 2 * y + zdot / 10 - sdot / 5},
        "outputs": [Output(Symbol("force"), zdot * z + xddot, "N", "force")],
    }
    return System(name="bouc_wen", title="Bouc-Wen oscillator", **given | changes)


@pytest.fixture(scope="module")
def kernels(tmp_path_factory):
    return generated_module(bouc_wen(), tmp_path_factory.mktemp("bouc_wen"))


def by_hand(state, u):
    """The Bouc-Wen oscillator as on paper: d/dt of dT/dxdot has the rate of z in it."""
    M, K, a, slope, g, b = VALUES.values()
    (X, X_dot, Z, Y), (W, W_dot) = state, u
    V = X_dot - W_dot
    Z_dot = slope * V - g * abs(V) * abs(Z) * Z - b * V * Z**2
    force = -a * Z - 2 * Y + Z_dot / 10 - (X_dot + 2 * Z_dot) / 5
    force += -K * (X + 2 * Z) - a * V * (1 + abs(Z)) - 2 * M * Z * Z_dot * X_dot
    return np.array([X_dot, force / (M * (1 + Z**2)), Z_dot, X - W + 3 * np.cos(Y)])


POINTS = [(point[:4], point[4:]) for point in np.random.default_rng(4).uniform(-1.5, 1.5, (50, 6))]


def channels(u):
    """The inputs of the kernels: the foot, its rate, and the modes of the conditions, which are free."""
    return np.concatenate([u, [0.0, 0.0]])


@pytest.fixture(scope="module")
def constants(kernels):
    c = np.empty(len(VALUES) + len(kernels.CONSTANT))
    kernels.constants.py_func(np.array([*VALUES.values()]), c)
    return c


def test_the_right_hand_side_is_that_on_paper(kernels, constants):
    assert [row[0] for row in kernels.STATE] == ["x", "xdot", "z", "y"]
    assert kernels.STATE[2:] == (("z", "m", "hysteresis of the damper"), ("y", "m s", "integral"))
    assert not kernels.LINEAR
    for state, u in POINTS:
        dx, force, expected = np.empty(4), np.empty(1), by_hand(state, u)
        kernels.rhs.py_func(0.0, state, channels(u), constants, dx)
        assert np.abs(dx - expected).max() <= 1e-13 * np.abs(expected).max()
        kernels.outputs.py_func(0.0, state, channels(u), constants, force)
        assert force[0] == pytest.approx(expected[2] * state[2] + expected[1], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("name", "by"), [("jacobian", 0), ("input_jacobian", 1)])
def test_derivatives_are_those_of_the_equations_on_paper(kernels, constants, name, by):
    places = [(row, column) for row, columns in enumerate(getattr(kernels, name.upper())) for column in columns]
    for point in POINTS:
        values, found = np.empty(len(places)), np.zeros((4, len(point[by])))
        getattr(kernels, name).py_func(0.0, point[0], channels(point[1]), constants, values)
        found[tuple(np.array(places).T)] = values
        expected = np.empty_like(found)
        for column in range(len(point[by])):
            ends = [[part.copy() for part in point] for _ in range(2)]
            for end, step in zip(ends, (1e-6, -1e-6), strict=True):
                end[by][column] += step
            expected[:, column] = (by_hand(*ends[0]) - by_hand(*ends[1])) / 2e-6
        assert np.abs(found - expected).max() <= 1e-7 * np.abs(expected).max()


def test_power_put_in_balances_the_change_of_energy(kernels, constants):
    def energy(state, u):
        values = np.empty(4)
        kernels.energy.py_func(0.0, state, channels(u), constants, values)
        return values

    for state, u in POINTS:
        velocity, step = by_hand(state, u), 1e-5
        moved = np.array([u[1], 0.0])
        one, other = (
            energy(state + step * velocity, u + step * moved),
            energy(state - step * velocity, u - step * moved),
        )
        change = ((one - other) / (2 * step))[:2].sum()
        _, _, dissipated, put_in = energy(state, u)
        assert change == pytest.approx(put_in - dissipated, rel=1e-7, abs=1e-6)


def test_the_series_of_a_model_whose_mass_moves_with_a_state(tmp_path):
    model = qddot.load(generate(bouc_wen(), tmp_path))
    settings = {"initial": [0.3, -0.2, 0.1, 0.4], "inputs": {"w": qddot.signal.sine(0.2, 1.5)}}
    series = qddot.simulate(model, (0.0, 1.5), method="taylor", rtol=1e-11, atol=1e-13, **settings)

    def rhs(t, state):
        omega = 2 * np.pi * 1.5
        return by_hand(state, (0.2 * np.sin(omega * t), 0.2 * omega * np.cos(omega * t)))

    expected = solve_ivp(rhs, (0.0, 1.5), settings["initial"], method="DOP853", rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(series.states[-1], expected.y[:, -1], rtol=1e-8)


def test_an_affine_state_keeps_a_model_linear(tmp_path):
    states = [State(z, k * (x - z) + 3, "m", "stretch"), State(y, z + wdot, "m s", "integral")]
    found = bouc_wen(
        states=states,
        quantities=[],
        kinetic_energy=half * m * xdot**2,
        potential_energy=half * k * (x - z) ** 2 + alpha * x * y,
        dissipation=0,
        generalized_forces={x: w * A - gamma * zdot + beta},
        outputs=[],
    )
    module = generated_module(found, tmp_path)
    assert module.LINEAR
    c, dx = np.empty(len(VALUES) + len(module.CONSTANT)), np.empty(4)
    module.constants.py_func(np.array([*VALUES.values()]), c)
    module.rhs.py_func(0.0, np.array([1.0, 2.0, 3.0, 4.0]), np.array([5.0, 6.0]), c, dx)
    stretching = 3.0 * (1.0 - 3.0) + 3.0
    acceleration = (5.0 - 7.0 * stretching + 3.0 - 3.0 * (1.0 - 3.0) - 5.0 * 4.0) / 2.0
    np.testing.assert_allclose(dx, [2.0, acceleration, stretching, 3.0 + 6.0], rtol=1e-14)


K, kk = Symbol("K"), Symbol("kk")
WRONG = {
    "unknown symbol": ({"states": [State(z, kk * x, "m", "z")]}, "rate of z uses kk, which is not declared"),
    "acceleration": ({"states": [State(z, xddot, "m", "z")]}, "rate of z uses xddot, an acceleration, which"),
    "loop": (
        {"states": [State(z, ydot, "m", "z"), State(y, x + zdot, "m", "y")]},
        "zdot needs ydot needs zdot: an algebraic loop; solve these equations",
    ),
    "loop through a quantity": (
        {"quantities": [SPEED, Quantity(s, x + zdot, "m", "s")], "states": [State(z, s, "m", "z"), INTEGRAL],
         "generalized_forces": {}},
        "s needs zdot needs s",
    ),
    "itself": ({"states": [State(z, zdot, "m", "z"), INTEGRAL]}, "zdot needs zdot"),
    "rate in T": ({"kinetic_energy": half * m * xdot**2 + zdot**2}, "kinetic energy depends on zdot, the rate of the"),
    "rate in Phi, through a quantity": ({"dissipation": half * sdot**2}, "dissipation depends on zdot, the rate of"),
    "rate in Pi": ({"potential_energy": x * ydot}, "potential energy depends on ydot, the rate of the state y"),
    "name of a coordinate": ({"states": [State(x, v, "m", "z")]}, "x is used twice, as coordinate and as state"),
    "name of a rate": ({"inputs": [Input(w, "m", "w", rate_symbol=zdot)]}, "zdot is used twice, as state rate and as"),
    "no unit": ({"states": [State(z, v, "", "z"), INTEGRAL]}, 'z has no unit; write "1" where it has none'),
    "no meaning": ({"states": [State(z, v, "m", " "), INTEGRAL]}, "z has no meaning"),
    "no such unit": ({"states": [State(z, v, "mm/kgg", "z"), INTEGRAL]}, "the unit of z is 'mm/kgg'"),
    "no state": ({"states": [Coordinate(z, "m", "z")]}, "states holds Coordinate"),
    "no symbol": ({"states": [State(2 * z, v, "m", "z")]}, "state 2*z is a Mul, expected a SymPy Symbol"),
    "no expression": ({"states": [State(z, "x - z", "m", "z")]}, "rate of z is a str, expected a SymPy expression"),
    "no form": ({"states": [State(z, floor(x), "m", "z"), INTEGRAL]}, "rate of z uses floor(x): floor has no compiled"),
    "complex": ({"states": [State(z, I * x, "m", "z"), INTEGRAL]}, "rate of z uses I*x: it is complex"),
    "no force": ({"generalized_forces": {z: -x}}, "a generalized force is given for z, which is no coordinate"),
    "rate of a rate": (
        {"quantities": [SPEED, Quantity(s, x + zdot, "m", "s", rate=sdot)]},
        "quantity s depends on zdot, so its rate would need the second derivative of z",
    ),
    "rate of an input's rate": (
        {"quantities": [SPEED, Quantity(s, wdot, "m", "s", rate=sdot)]},
        "quantity s depends on wdot, so its rate would need the second derivative of w",
    ),
    "rate of a hidden velocity": (
        {"quantities": [SPEED, Quantity(s, 3 * v, "m", "s", rate=sdot)]},
        "quantity s depends on wdot, so its rate would need the second derivative of w",
    ),
    "rate of a quantity's rate": (
        {"quantities": [SPEED, STRETCH, Quantity(K, sdot**2, "m", "s", rate=kk)]},
        "quantity K depends on sdot, so its rate would need the second derivative of s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_what_is_no_state_is_refused_by_name(case):
    changes, message = WRONG[case]
    with pytest.raises(ModelError) as refused:
        bouc_wen(**changes)
    assert message in str(refused.value)


def test_a_state_that_nothing_reads_is_told():
    work = State(Symbol("work"), alpha * v * xdot, "J", "work of the damper")
    with pytest.warns(UserWarning, match="nothing depends on the state work: it is integrated for the results alone"):
        bouc_wen(states=[HYSTERESIS, INTEGRAL, work])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bouc_wen()
        bouc_wen(outputs=[Output(Symbol("wear"), work.symbol, "J", "wear")], states=[HYSTERESIS, INTEGRAL, work])


def test_the_order_of_states_and_quantities_is_free():
    """A state's rate may use another's, and a quantity may use the rate of a state that uses quantities."""
    force = Quantity(s, alpha * zdot, "N", "force of the dashpot")
    found = bouc_wen(
        quantities=[SPEED, force],
        states=[State(y, 2 * zdot, "m", "y"), State(z, A * v - z, "m", "z")],
        potential_energy=half * k * x**2 + gamma * z * x + beta * y,
        generalized_forces={x: -s},
    )
    assert [str(symbol) for symbol in found.definitions] == ["v", "zdot", "s", "ydot"]
    assert found.written_out(ydot) == 2 * (A * (xdot - wdot) - z)


def test_pages_have_the_states_and_their_equations():
    document = describe(derive(bouc_wen()), "bouc_wen.py")
    lines = text(document)
    assert "Internal states\n───────────────\n  z, ż  m    hysteresis of the damper\n  y, ẏ  m s  integral" in lines
    assert "z, hysteresis of the damper:\n  ż = A·v − γ·z·|v|·|z| − β·v·z²\n" in lines
    quantities = lines[lines.index("Quantities\n") : lines.index("Energies")]
    assert "ż" not in quantities.replace("ṡ = ẋ + 2·ż", "")
    written = tex(document)
    assert r"\section*{Coordinates, states and inputs}" in written
    assert "The internal states follow their own equations:" in written
    assert r"& \dot{z} = A \, v" in written.replace(r"A v", r"A \, v")
    page = html(document)
    assert page.count('class="number"') == 3
    assert '<section id="states"><h2>Internal states</h2>' in page


SHEETS = {
    "z: zdot = A*v - gamma*abs(v)*abs(z)*z - beta*v*z**2": [],
    "z: zdot = (A - gamma*abs(v)/v*abs(z)*z - beta*z**2)*(xdot - wdot)": [],
    "z: zdot = A*v - gamma*abs(v)*abs(z)*z + beta*v*z**2": ["sign"],
    "z: zdot = A*xdot - gamma*abs(v)*abs(z)*z - beta*v*z**2": ["extra", "missing"],
    "y: 2*ydot = 2*(x - w + 3*cos(y))": [],
    "y: ydot = x + 3*cos(y)": ["missing"],
    "y: 0 = 0": ["missing"] * 4,
}


@pytest.mark.parametrize("sheet", SHEETS)
def test_equations_of_states_are_compared(tmp_path, sheet):
    (tmp_path / "sheet.txt").write_text(sheet)
    (found,) = compare(read(tmp_path / "sheet.txt"), derive(bouc_wen()))
    assert [change.kind for change in found.changes] == SHEETS[sheet]
