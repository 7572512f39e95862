"""Kernels of models with constraints, each number beside what SymPy, differences or the balance of power say."""

import numpy as np
import pytest
from mechanisms import HALF, coordinates, parameters, rolling_disc, slider_crank
from sympy import Matrix, Symbol, cos, lambdify, sin, symbols

import qddot
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.lagrange import derive
from qddot.model import Constraint, Input, Output, Rolling, System, t


def carousel():
    """A bead on an arm that turns and grows as time says, beside a blade on a moving floor: all that depends on t."""
    x, y, xdot, ydot, m, a, b, k, u = symbols("x y xdot ydot m a b k u")
    return System(
        name="carousel",
        title="Bead on a turning arm, and a blade on a moving floor",
        coordinates=coordinates("m", "x y z"),
        parameters=parameters(m=(1.3, "kg"), a=(0.8, "1/s"), b=(0.2, "m/s"), k=(7.0, "N/m")),
        inputs=[Input(u, "m/s", "speed of the floor")],
        kinetic_energy=HALF * m * (xdot**2 + ydot**2 + 2 * Symbol("zdot") ** 2),
        potential_energy=HALF * k * (x**2 + 2 * y**2),
        constraints=[
            Rolling(Symbol("mu"), Symbol("zdot") + x * ydot * a / b - u, "N", "blade"),
            Constraint(Symbol("lam"), x * sin(a * t) - y * cos(a * t) + b * t * t, "N/m", "arm"),
        ],
        outputs=[Output(Symbol("pull"), Symbol("lam") * 2 + Symbol("reaction_y"), "N", "of both")],
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    return lambda system: qddot.load(qddot.generate(system, folder))


@pytest.fixture(scope="module")
def turning(made):
    return made(carousel())


def point(model, seed=1):
    """t, x off the constraints, u, c."""
    chance = np.random.default_rng(seed)
    x = chance.uniform(0.2, 1.0, len(model.state_names))
    u = chance.normal(size=max(1, len(model.tables.inputs)))
    return 0.7, x, u, model.constants(model.parameter_values())


def called(model, name, size, t, x, u, c):
    values = np.zeros(size)
    model.kernel(name)(t, x, u, c, values)
    return values


def equations(system, t_, x, u):
    """(qddot, lambda) by SymPy's own derivatives and NumPy's solution."""
    q, v = [c.symbol for c in system.coordinates], [c.rate for c in system.coordinates]
    T, V = system.kinetic_energy, system.potential_energy
    M = Matrix([[T.diff(a).diff(b) for b in v] for a in v])
    rates = []
    for each in system.constraints:
        f = each.expression
        moved = sum((f.diff(a) * b for a, b in zip(q, v, strict=True)), f.diff(t))
        rates.append(moved if isinstance(each, Constraint) else f)
    G = Matrix([[rate.diff(b) for b in v] for rate in rates])
    inputs = {channel.symbol: channel.rate for channel in system.inputs}
    drift = [
        -sum((rate.diff(a) * b for a, b in zip(q, v, strict=True)), rate.diff(t))
        - sum(rate.diff(a) * b for a, b in inputs.items())
        for rate in rates
    ]
    momenta = [T.diff(b) for b in v]
    f = [
        system.force(c) + T.diff(a) - V.diff(a) - system.dissipation.diff(b)
        - sum((p.diff(k) * s for k, s in zip(q, v, strict=True)), p.diff(t))
        for c, a, b, p in zip(system.coordinates, q, v, momenta, strict=True)
    ]  # fmt: skip
    values = {p.symbol: p.default for p in system.parameters}
    arguments = [*q, *v, t, *inputs, *inputs.values()]
    numbers = lambdify(arguments, [each.subs(values) for each in (M, G, Matrix(f), Matrix(drift))])(*x, t_, *u)
    M, G, f, drift = (np.array(each, dtype=float) for each in numbers)
    whole = np.block([[M, G.T], [G, np.zeros((len(rates), len(rates)))]])
    return np.split(np.linalg.solve(whole, np.concatenate([f[:, 0], drift[:, 0]])), [len(q)])


@pytest.mark.parametrize("system", [carousel(), slider_crank()], ids=lambda system: system.name)
def test_accelerations_and_multipliers_beside_sympy(made, system):
    model = made(system)
    n = model.tables.coordinates
    at = point(model)
    slopes = called(model, "rhs", 2 * n, *at)
    u = np.zeros(2 * len(system.inputs))
    u[: len(at[2])] = at[2] if len(system.inputs) else []
    a, multipliers = equations(system, at[0], at[1], u)
    assert np.allclose(slopes[n:], a, rtol=1e-11) and np.array_equal(slopes[:n], at[1][n:])
    outputs = dict(
        zip(
            [o.name for o in model.tables.outputs],
            called(model, "outputs", len(model.tables.outputs), *at),
            strict=True,
        )
    )
    for each, value in zip(system.constraints, multipliers, strict=True):
        assert outputs[each.symbol.name] == pytest.approx(value, rel=1e-11)
    if system.name == "carousel":
        assert outputs["pull"] == pytest.approx(2 * outputs["lam"] + outputs["reaction_y"], rel=1e-12)


@pytest.mark.parametrize("system", [carousel(), slider_crank()], ids=lambda system: system.name)
def test_jacobians_beside_differences(made, system):
    model = made(system)
    t_, x, u, c = point(model)
    size, h = len(x), 1e-6

    def rhs(x, u):
        return called(model, "rhs", size, t_, x, u, c)

    exact = model.matrix("jacobian")(t_, x, u, c)
    by_state = np.array([rhs(x + step, u) - rhs(x - step, u) for step in h * np.eye(size)]).T / (2 * h)
    assert np.allclose(exact, by_state, rtol=1e-6, atol=1e-6)
    exact = model.matrix("input_jacobian")(t_, x, u, c)
    by_input = np.array([rhs(x, u + step) - rhs(x, u - step) for step in h * np.eye(len(u))[: exact.shape[1]]]).T / (
        2 * h
    )
    assert exact.shape[1] == model.tables.rhs_inputs
    assert exact.size == 0 or np.allclose(exact, by_input, rtol=1e-6, atol=1e-6)


def test_the_tangent_is_the_derivative_of_the_residuals(turning):
    t_, x, u, c = point(turning)
    n, h = turning.tables.coordinates, 1e-6

    def residuals(x):
        whole = turning.matrix("constraints")(t_, x, u, c)
        return np.concatenate([whole[n : n + turning.tables.n_positions, n], whole[n:, n + 1]])

    exact = turning.matrix("tangent")(t_, x, u, c)
    assert np.allclose(
        exact,
        np.array([residuals(x + s) - residuals(x - s) for s in h * np.eye(len(x))]).T / (2 * h),
        rtol=1e-7,
        atol=1e-8,
    )


def test_power_put_in_by_constraints_that_depend_on_time_balances(turning):
    """d(T + Pi)/dt along the motion is what the arm and the floor put in."""
    x = qddot.assemble(turning, {"x": 0.5, "xdot": 0.3}, t0=0.7, inputs={"u": 0.4}, guess={"y": 0.6})
    u, c = np.array([0.4, 0.0]), turning.constants(turning.parameter_values())
    u = u[: max(1, len(turning.tables.inputs))]
    slope = called(turning, "rhs", len(x), 0.7, x, u, c)
    h = 1e-6
    before, after = (called(turning, "energy", 4, 0.7 + s, x + s * slope, u, c) for s in (-h, h))
    energies = called(turning, "energy", 4, 0.7, x, u, c)
    change = (after[:2].sum() - before[:2].sum()) / (2 * h)
    assert change == pytest.approx(energies[3] - energies[2], rel=1e-7) and abs(change) > 1e-3


def test_positions_come_first_whatever_their_order(turning):
    assert [(each.name, each.on_positions) for each in turning.tables.constraints] == [("lam", True), ("mu", False)]
    assert [o.name for o in turning.tables.outputs] == ["pull", "mu", "lam", *(f"reaction_{k}" for k in "xyz")]


def test_constraints_and_multipliers_are_on_the_page():
    document = describe(derive(slider_crank()), "slider_crank.py")
    shown = text(document)
    assert "r·cos(α) + l·cos(β) − x = 0" in shown and "λ_x" in shown
    written = tex(document)
    assert r"\sum_{j} \lambda_{j} G_{jk}" in written and r"\section*{Constraints}" in written
    assert "Constraints" in text(describe(derive(rolling_disc()), "disc.py"))
