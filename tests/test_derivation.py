"""The generated equations against two independent derivations, and against differences of themselves."""

import casadi
import numpy as np
import pytest
import sympy
from matrices import matrix
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

from qddot.model.system import t
from qddot.runner.ranges import expanded


def accelerations(kernels, point):
    time, x, u, _, c = point
    dx = np.full(len(x), np.nan)
    kernels.rhs.py_func(time, x, u, c, dx)
    n = len(x) // 2
    assert (dx[:n] == x[n:]).all()
    return dx[n:]


def symbols_of(system, kernels):
    """Symbols in the order of a point's values: t, x, u, p; rates of inputs are the time derivatives of the inputs."""
    q = [coordinate.symbol for coordinate in system.coordinates]
    v = [coordinate.rate for coordinate in system.coordinates]
    u = [sympy.Symbol(row[0]) for row in expanded(kernels.INPUT)]
    return [t, *q, *v, *u, *(parameter.symbol for parameter in system.parameters)]


def values_of(point):
    time, x, u, p, _ = point
    return [time, *x, *u, *p]


def test_sympys_lagranges_method_gives_the_same_accelerations(system, kernels, points):
    q = [dynamicsymbols(coordinate.symbol.name) for coordinate in system.coordinates]
    qdot = [coordinate.diff(dynamicsymbols._t) for coordinate in q]
    moving = {c.symbol: a for c, a in zip(system.coordinates, q, strict=True)}
    moving |= {c.rate: a for c, a in zip(system.coordinates, qdot, strict=True)}
    energy = system.written_out(system.kinetic_energy) - system.written_out(system.potential_energy)
    method = LagrangesMethod(energy.xreplace(moving), q)
    method.form_lagranges_equations()
    dissipation = system.written_out(system.dissipation)
    rest = [system.written_out(system.force(c)) - dissipation.diff(c.rate) for c in system.coordinates]
    back = {derivative: c.rate for c, derivative in zip(system.coordinates, qdot, strict=True)}
    still = {a: c.symbol for c, a in zip(system.coordinates, q, strict=True)}
    M = method.mass_matrix.xreplace(back).xreplace(still)
    f = (method.forcing.xreplace(back).xreplace(still)) + sympy.Matrix(rest)
    reference = sympy.lambdify([symbols_of(system, kernels)], [M, f], modules="numpy", cse=True)
    for point in points:
        mass, force = reference(values_of(point))
        expected = np.linalg.solve(np.array(mass, float), np.array(force, float)).ravel()
        found = accelerations(kernels, point)
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max() * max(1, np.linalg.cond(mass) / 100)


def test_casadis_automatic_differentiation_gives_the_same_accelerations(system, kernels, points):
    symbols = symbols_of(system, kernels)
    twins = {symbol: casadi.SX.sym(symbol.name) for symbol in symbols}
    functions = {name: getattr(casadi, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh")}

    def translated(expression):
        return sympy.lambdify(symbols, system.written_out(expression), modules=[functions])(*twins.values())

    q = casadi.vertcat(*(twins[c.symbol] for c in system.coordinates))
    v = casadi.vertcat(*(twins[c.rate] for c in system.coordinates))
    T, potential, phi = map(translated, (system.kinetic_energy, system.potential_energy, system.dissipation))
    forces = casadi.vertcat(*(translated(system.force(c)) for c in system.coordinates))
    L = T - potential
    momenta = casadi.gradient(L, v)
    M = casadi.jacobian(momenta, v)
    f = forces - casadi.gradient(phi, v) + casadi.gradient(L, q) - casadi.jacobian(momenta, q) @ v
    reference = casadi.Function("reference", list(twins.values()), [casadi.solve(M, f)])
    for point in points:
        expected = np.array(reference(*values_of(point))).ravel()
        assert accelerations(kernels, point) == pytest.approx(expected, rel=1e-10, abs=1e-12 * np.abs(expected).max())


def test_jacobian_agrees_with_central_differences(kernels, points):
    for time, x, u, _, c in points[:10]:
        J = matrix(kernels, "jacobian", time, x, u, c)
        differences = np.empty_like(J)
        for k in range(len(x)):
            up, down = np.empty(len(x)), np.empty(len(x))
            step = 1e-6 * np.eye(len(x))[k]
            kernels.rhs.py_func(time, x + step, u, c, up)
            kernels.rhs.py_func(time, x - step, u, c, down)
            differences[:, k] = (up - down) / 2e-6
        assert np.abs(J - differences).max() <= 1e-7 * np.abs(J).max()


def test_linear_models_are_found_and_their_matrices_give_rhs(name, kernels, points):
    assert (name not in ("cart_pole", "double_pendulum", "pendulum")) == kernels.LINEAR
    if not kernels.LINEAR:
        return
    for time, x, u, _, c in points[:10]:
        A, B = matrix(kernels, "jacobian", time, x, u, c), matrix(kernels, "input_jacobian", time, x, u, c)
        dx, offset, nothing = np.empty(len(x)), np.empty(len(x)), np.zeros(len(x) + len(u))
        kernels.rhs.py_func(time, x, u, c, dx)
        kernels.rhs.py_func(0.0, nothing, nothing, c, offset)
        expected = A @ x + B @ u[: kernels.RHS_INPUTS] + offset
        assert expected == pytest.approx(dx, rel=1e-11, abs=1e-12 * np.abs(dx).max())


def test_input_jacobian_agrees_with_differences_of_rhs(kernels, points):
    for time, x, u, _, c in points[:10]:
        B = matrix(kernels, "input_jacobian", time, x, u, c)
        for k in range(kernels.RHS_INPUTS):
            up, down, step = np.empty(len(x)), np.empty(len(x)), 1e-3 * np.eye(len(u))[k]
            kernels.rhs.py_func(time, x, u + step, c, up)
            kernels.rhs.py_func(time, x, u - step, c, down)
            assert B[:, k] == pytest.approx((up - down) / 2e-3, rel=1e-8, abs=1e-9 * np.abs(up).max())


def test_mass_matrix_is_symmetric_positive_definite_and_gives_the_kinetic_energy(system, kernels, points):
    kinds = {"cart_pole": "configuration-dependent", "double_pendulum": "configuration-dependent"}
    kinds |= {"pendulum": "configuration-dependent"}
    assert kinds.get(kernels.NAME, "diagonal") == kernels.MASS_MATRIX
    for time, x, u, _, c in points[:20]:
        n = len(x) // 2
        M, E = matrix(kernels, "mass", time, x, u, c), np.empty(4)
        kernels.energy.py_func(time, x, u, c, E)
        assert np.linalg.eigvalsh(M).min() > 0
        assert 0.5 * x[n:] @ M @ x[n:] == pytest.approx(E[0], rel=1e-12)


def test_power_balance_holds_at_every_point(kernels, points):
    """d(T + Pi)/dt along the motion equals power in less power dissipated, by differences of the energy kernel."""
    for time, x, u, _, c in points[:20]:
        channels = expanded(kernels.INPUT)
        names, rates = [row[0] for row in channels], np.zeros(len(channels))
        for k, row in enumerate(channels):
            if row[2]:
                rates[names.index(row[1])] = u[k]
        dx, E = np.empty(len(x)), np.empty(4)
        kernels.rhs.py_func(time, x, u, c, dx)
        kernels.energy.py_func(time, x, u, c, E)
        h = 1e-7 / max(1.0, np.abs(dx).max() / np.abs(x).max())
        energies = []
        for side in (-h, h):
            around = np.empty(4)
            kernels.energy.py_func(time + side, x + side * dx, u + side * rates, c, around)
            energies.append(around[0] + around[1])
        scale = abs(E[2]) + abs(E[3]) + (abs(E[0]) + abs(E[1])) * np.abs(dx).max()
        assert (energies[1] - energies[0]) / (2 * h) == pytest.approx(E[3] - E[2], abs=1e-7 * scale)


def test_outputs_are_their_expressions(system, kernels, points):
    accelerations_of = [coordinate.acceleration for coordinate in system.coordinates]
    names = symbols_of(system, kernels) + accelerations_of
    for output, index in zip(system.output_expressions, range(len(expanded(kernels.OUTPUT))), strict=True):
        assert expanded(kernels.OUTPUT)[index] == (output.symbol.name, output.unit, output.meaning)
        reference = sympy.lambdify([names], system.written_out(output.expression), modules="math")
        for point in points[:5]:
            time, x, u, _, c = point
            y = np.empty(len(expanded(kernels.OUTPUT)))
            kernels.outputs.py_func(time, x, u, c, y)
            expected = reference([*values_of(point), *accelerations(kernels, point)])
            assert y[index] == pytest.approx(expected, rel=1e-11, abs=1e-12)


def test_positions_are_their_expressions(system, kernels, points):
    placed = {channel.symbol.name: channel.position for channel in system.inputs if channel.position is not None}
    assert expanded(getattr(kernels, "POSITION", ())) == list(placed)
    if not placed:
        assert not hasattr(kernels, "positions")
        return
    parameters = [parameter.symbol for parameter in system.parameters]
    reference = sympy.lambdify([parameters], [system.written_out(place) for place in placed.values()], modules="math")
    for _, _, _, p, _ in points[:5]:
        found = np.empty(len(placed))
        kernels.positions.py_func(p, found)
        assert found == pytest.approx(reference(p), rel=1e-12, abs=1e-12)
