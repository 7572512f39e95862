"""T, Pi, Phi and Q in any form: derivation, Jacobian and power balance against automatic differentiation."""

import numpy as np
import pytest
from derived import Reference, generated_module
from matrices import matrix
from sympy import Abs, Heaviside, Max, Piecewise, Rational, Symbol, cos, exp, log, sin, sqrt, symbols, tanh

from qddot.model.system import Coordinate, Input, Output, Parameter, Quantity, System, t
from qddot.runner.ranges import expanded

q, v, p, pv, m, k, c, g, r, w, wdot, f = symbols("q qdot p pdot m k c g r w wdot F")
half = Rational(1, 2)
ONE = (Coordinate(q, "m", "displacement"),)
TWO = (*ONE, Coordinate(p, "rad", "angle"))


def parameters(*chosen):
    return tuple(Parameter(s, 1.5, "1", f"parameter {s}") for s in chosen)


def system(name, coordinates, used, T, **rest):
    made = parameters(*used)
    return System(name=name, title=name, coordinates=coordinates, parameters=made, kinetic_energy=T, **rest)


W = Input(w, "rad", "prescribed angle")
ODD = [
    # a bead on a hoop that turns with a prescribed angle: T has a part without velocities, Pi is explicit in time
    system(
        "hoop", (Coordinate(q, "rad", "angle"),), (m, r, g),
        half * m * r**2 * (v**2 + sin(q) ** 2 * t**2),
        potential_energy=-m * g * r * cos(q) + half * m * q**2 * sin(t),
    ),
    # T linear in the velocity, through an input
    system("drift", ONE, (m,), half * m * v**2 + m * v * w**2 * q, inputs=(W,), potential_energy=m * q**2 * cos(w)),
    # a generalized potential, linear in the velocities: a charge in a magnetic field
    system("magnet", TWO, (m, k), half * m * (v**2 + pv**2), potential_energy=k * (q * pv - p * v) + half * k * q**2),
    # T that is not quadratic: relativistic, with the mass matrix depending on the velocity
    system("fast", ONE, (m, k), m * 9 * (1 - sqrt(1 - v**2 / 9)), potential_energy=half * k * q**2),
    # dissipation in the coordinate and the velocity, not quadratic; forces of all arguments
    system(
        "drag", TWO, (m, c, k), half * m * (v**2 + pv**2),
        dissipation=c * (1 + q**2) * v**4 / 4 + c * pv**2 * exp(-p**2),
        potential_energy=k * log(1 + q**2 + p**2), inputs=(Input(f, "N", "force"),),
        generalized_forces={q: f * tanh(v) + sin(t), p: -f * q * p},
    ),
    # kinks: a bump stop, Coulomb friction made smooth, a one-sided spring
    system(
        "stop", ONE, (m, k, c), half * m * v**2,
        potential_energy=half * k * Max(q - Rational(1, 2), 0) ** 2 + k * Abs(q) * half
        + Piecewise((half * k * q**2, q < 0), (0, True)),
        generalized_forces={q: -c * tanh(10 * v) + Heaviside(q) * c},
    ),
    # quantities of quantities, with rates, coupled constant inertia, time in a quantity
    system(
        "chainrule", TWO, (m, k, c), half * m * v**2 + m * (v + 2 * pv) ** 2 + m * v * pv / 4,
        quantities=(
            Quantity(Symbol("s"), q + 2 * p - w, "m", "stretch", rate=Symbol("sdot")),
            Quantity(Symbol("e"), Symbol("s") ** 2 + sin(t) * q, "m", "square", rate=Symbol("edot")),
        ),
        inputs=(W,), potential_energy=half * k * Symbol("e") ** 2 + k * Symbol("s") ** 4,
        dissipation=half * c * Symbol("edot") ** 2 + half * c * Symbol("sdot") ** 2,
        outputs=(Output(Symbol("pull"), k * Symbol("s") + Symbol("qddot"), "N", "a force"),),
    ),
    # velocities that are quantities: T through the rates of positions
    system(
        "position", TWO, (m, r, g), half * m * (Symbol("xdot_m") ** 2 + Symbol("ydot_m") ** 2) + m * v**2,
        quantities=(
            Quantity(Symbol("x_m"), q + r * sin(p), "m", "position", rate=Symbol("xdot_m")),
            Quantity(Symbol("y_m"), -r * cos(p), "m", "height", rate=Symbol("ydot_m")),
        ),
        potential_energy=m * g * Symbol("y_m") + m * g * q * Symbol("x_m"),
    ),
]  # fmt: skip


@pytest.fixture(scope="module", params=ODD, ids=lambda s: s.name)
def case(request, tmp_path_factory):
    module = generated_module(request.param, tmp_path_factory.mktemp(request.param.name))
    return module, Reference(request.param, [row[0] for row in expanded(module.INPUT)])


@pytest.fixture(scope="module")
def points(case):
    module, _ = case
    rng = np.random.default_rng(11)
    found = []
    for _ in range(100):
        p = rng.uniform(0.5, 2, len(expanded(module.PARAMETER)))
        constants = np.empty(len(p) + len(expanded(module.CONSTANT)))
        module.constants.py_func(p, constants)
        x, channels = rng.uniform(-1, 1, len(expanded(module.STATE))), expanded(module.INPUT)
        u = rng.uniform(-1, 1, len(channels))
        u[[row[0].startswith("mode_") for row in channels]] = 0.0  # conditions are free
        found.append((rng.uniform(0, 3), x, u, p, constants))
    return found


def test_accelerations_and_energies(case, points):
    module, reference = case
    for time, x, u, p, constants in points:
        expected, _, kinetic, potential = reference(time, x, u, p)
        dx, E = np.empty(len(x)), np.empty(4)
        module.rhs.py_func(time, x, u, constants, dx)
        module.energy.py_func(time, x, u, constants, E)
        assert dx[len(x) // 2 :] == pytest.approx(expected, rel=1e-10, abs=1e-10)
        assert (E[0], E[1]) == pytest.approx((kinetic, potential), rel=1e-12, abs=1e-12)


def test_power_balance(case, points):
    module, reference = case
    for time, x, u, p, constants in points:
        _, change, *_ = reference(time, x, u, p)
        E = np.empty(4)
        module.energy.py_func(time, x, u, constants, E)
        assert E[3] - E[2] == pytest.approx(change, rel=1e-9, abs=1e-9)


def test_jacobian(case, points):
    module, _ = case
    for time, x, u, _, constants in points[:20]:
        if np.abs(np.abs(x) - 0.5).min() < 1e-4 or np.abs(x).min() < 1e-4:
            continue  # at a kink there is no derivative
        J, differences = matrix(module, "jacobian", time, x, u, constants), np.empty((len(x), len(x)))
        for k in range(len(x)):
            up, down, step = np.empty(len(x)), np.empty(len(x)), 1e-6 * np.eye(len(x))[k]
            module.rhs.py_func(time, x + step, u, constants, up)
            module.rhs.py_func(time, x - step, u, constants, down)
            differences[:, k] = (up - down) / 2e-6
        assert pytest.approx(differences, rel=1e-5, abs=1e-6 * max(1, np.abs(J).max())) == J
