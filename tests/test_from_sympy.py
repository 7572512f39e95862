"""Models from SymPy's mechanics: their kernels beside SymPy's own equations, and what has no place in a System."""

import numpy as np
import pytest
from derived import generated_module
from sympy import Matrix, Symbol, cos, lambdify, sin, symbols
from sympy.physics import mechanics as me

from qddot.model import Arrow, Bar, Coordinate, Input, ModelError, Output, Parameter, Polygon, from_sympy

m, k, g, L, r, c = symbols("m k g L r c", positive=True)
VALUES = {m: 1.3, k: 40.0, g: 9.81, L: 0.7, r: 0.4, c: 0.6}


def parameters(*wanted):
    units = {m: "kg", k: "N/m", g: "m/s^2", L: "m", r: "m", c: "N s/m"}
    return [Parameter(each, VALUES[each], units[each], f"parameter {each}") for each in wanted]


def cart():
    """Lagrange's: a pendulum on a sprung cart, a force on the cart, friction, and a torque on the rod."""
    x, phi, F, M = me.dynamicsymbols("x phi F M")
    N = me.ReferenceFrame("N")
    A = N.orientnew("A", "Axis", [phi, N.z])
    pivot, bob = me.Point("C"), me.Point("B")
    pivot.set_vel(N, x.diff() * N.x)
    bob.set_vel(N, pivot.vel(N) + L * phi.diff() * A.x)
    T = m * x.diff() ** 2 + m * bob.vel(N).dot(bob.vel(N)) / 2
    lagrangian = T - k * x**2 / 2 + m * g * L * cos(phi)
    loads = [(pivot, (F - c * x.diff()) * N.x), (A, M * N.z), (bob, -c * bob.vel(N))]
    method = me.LagrangesMethod(lagrangian, [x, phi], forcelist=loads, frame=N)
    method.form_lagranges_equations()
    system = from_sympy(
        method,
        "cart",
        "Cart",
        coordinates=[Coordinate(x, "m", "place"), Coordinate(phi, "rad", "angle")],
        parameters=parameters(m, k, g, L, c),
        inputs=[Input(F, "N", "force"), Input(M, "N m", "torque")],
        outputs=[Output(Symbol("tip"), x.diff(me.dynamicsymbols._t, 2) + L * phi, "m/s^2", "an output")],
    )
    return method, system, [F, M], None


def cylinder():
    """Lagrange's with a holonomic and a nonholonomic constraint, both with multipliers."""
    x, y, phi = me.dynamicsymbols("x y phi")
    T = m * (x.diff() ** 2 + y.diff() ** 2) / 2 + m * r**2 * phi.diff() ** 2 / 4
    method = me.LagrangesMethod(
        T - m * g * y, [x, y, phi], hol_coneqs=[y - L * sin(x)], nonhol_coneqs=[x.diff() * cos(y) - r * phi.diff()]
    )
    method.form_lagranges_equations()
    system = from_sympy(
        method,
        "cylinder",
        "Cylinder",
        coordinates=[Coordinate(x, "m", "place"), Coordinate(y, "m", "height"), Coordinate(phi, "rad", "turn")],
        parameters=parameters(m, g, L, r),
        multipliers=[("lam_y", "N", "contact"), ("mu", "N", "no slip")],
    )
    return method, system, [], lambda x: [x[0], VALUES[L] * np.sin(x[0]), x[2]]


def disc():
    """Kane's: a disc that rolls, by its speeds in its own axes, friction at its centre."""
    q, u = me.dynamicsymbols("q1:6"), me.dynamicsymbols("u1:6")
    N = me.ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q[0], N.z])
    lean = Y.orientnew("L", "Axis", [q[1], Y.x])
    R = lean.orientnew("R", "Axis", [q[2], lean.y])
    R.set_ang_vel(N, u[0] * lean.x + u[1] * lean.y + u[2] * lean.z)
    centre = me.Point("Dmc")
    centre.set_vel(N, u[3] * N.x + u[4] * N.y + (R.ang_vel_in(N).cross(r * lean.z)).dot(N.z) * N.z)
    turning = q[1].diff() * lean.x + q[2].diff() * lean.y + q[0].diff() * (sin(q[1]) * lean.y + cos(q[1]) * lean.z)
    kinematic = [(R.ang_vel_in(N) - turning).dot(axis) for axis in (lean.x, lean.y, lean.z)]
    kinematic += [q[3].diff() - u[3], q[4].diff() - u[4]]
    slip = u[3] * N.x + u[4] * N.y - R.ang_vel_in(N).cross(r * lean.z)
    held = [slip.dot(N.x), slip.dot(N.y)]
    inertia = me.inertia(lean, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4)
    body = me.RigidBody("disc", centre, R, m, (inertia, centre))
    method = me.KanesMethod(
        N, q, u[:3], kd_eqs=kinematic, u_dependent=u[3:], velocity_constraints=held, bodies=[body],
        forcelist=[(centre, -m * g * N.z - c * centre.vel(N))],
    )  # fmt: skip
    method.kanes_equations()
    system = from_sympy(
        method,
        "disc",
        "Disc",
        coordinates=[Coordinate(each, "rad" if i < 3 else "m", f"q {i}") for i, each in enumerate(q)],
        parameters=parameters(m, g, r, c),
        multipliers=[("lam_x", "N", "no slip"), ("lam_y", "N", "no slip")],
        outputs=[Output(Symbol("spin"), u[1], "rad/s", "speed of the disc about its axis")],
    )
    return method, system, [], None


def bar():
    """Kane's with a configuration constraint, whose derivative is the velocity constraint: one constraint here."""
    q, u = me.dynamicsymbols("q1:3"), me.dynamicsymbols("u1:3")
    N = me.ReferenceFrame("N")
    origin, P = me.Point("O"), me.Point("P")
    origin.set_vel(N, 0)
    P.set_pos(origin, q[0] * N.x + q[1] * N.y)
    P.set_vel(N, (u[0] - u[1]) * N.x + u[1] * N.y)
    on = q[0] ** 2 + 2 * q[1] ** 2 - L**2
    method = me.KanesMethod(
        N, [q[0]], [u[0]], kd_eqs=[q[0].diff() - u[0] + u[1], q[1].diff() - u[1]], q_dependent=[q[1]],
        configuration_constraints=[on], u_dependent=[u[1]], velocity_constraints=[on.diff(me.dynamicsymbols._t)],
        bodies=[me.Particle("P", P, m)], forcelist=[(P, -m * g * N.y - k * q[0] * N.x)],
    )  # fmt: skip
    method.kanes_equations()
    system = from_sympy(
        method,
        "bar",
        "Bar",
        coordinates=[Coordinate(q[0], "m", "x"), Coordinate(q[1], "m", "y")],
        parameters=parameters(m, k, g, L),
        multipliers=[("lam", "N/m", "ellipse")],
    )
    return method, system, [], lambda x: [x[0], np.sqrt((VALUES[L] ** 2 - x[0] ** 2) / 2)]


def number(expression, *values):
    """An expression or matrix as floating-point numbers, values put in one mapping after the other."""
    for each in values:
        expression = Matrix(expression).subs(each)
    return np.array(expression.evalf(), dtype=float)


def accelerations(method, inputs, x, v, u):
    """By SymPy: qddot at a state, of Lagrange's equations as they are, of Kane's through its speeds."""
    t, n = me.dynamicsymbols._t, len(method.q)
    position = dict(zip(method.q, x, strict=True)) | VALUES | dict(zip(inputs, u, strict=True))
    rates = {q.diff(t): value for q, value in zip(method.q, v, strict=True)}
    if isinstance(method, me.LagrangesMethod):
        full, right = method.mass_matrix, method.forcing
        if method.lam_vec:
            full, right = method.mass_matrix_full[n:, n:], method.forcing_full[n:, 0]
        return np.linalg.solve(number(full, rates, position), number(right, rates, position)).ravel()[:n]
    kinematics = Matrix([method.kindiffdict()[q.diff(t)] for q in method.q])
    still = kinematics.subs(dict.fromkeys(method.u, 0))
    speeds = np.linalg.solve(number(kinematics.jacobian(method.u), position), v - number(still, position).ravel())
    at = dict(zip(method.u, speeds, strict=True))
    udot = np.linalg.solve(number(method.mass_matrix, at, position), number(method.forcing, at, position)).ravel()
    slopes = {each.diff(t): value for each, value in zip(method.u, udot, strict=True)} | rates
    return number(kinematics.diff(t), slopes, at, position).ravel()


@pytest.mark.parametrize("made", [cart, cylinder, disc, bar])
def test_the_kernels_give_sympys_accelerations(made, tmp_path):
    method, system, inputs, onto = made()
    module = generated_module(system, tmp_path)
    names = [str(each.symbol) for each in system.coordinates]
    n, chance = len(names), np.random.default_rng(4)
    p = np.array([float(each.default) for each in system.parameters])
    constants = np.zeros(len(p) + len(module.CONSTANT) + 40)
    module.constants.py_func(p, constants)
    rhs = module.rhs if system.constraints else module.rhs.py_func
    for _ in range(3):
        x, u = chance.uniform(0.2, 0.6, n), chance.uniform(-2, 2, len(inputs))
        x = np.array(onto(x)) if onto else x
        v = tangent(system, x, chance.uniform(-1, 1, n))
        rates = np.zeros(2 * n)
        rhs(0.0, np.concatenate([x, v]), u, constants, rates)
        np.testing.assert_allclose(rates[:n], v, rtol=1e-15)
        np.testing.assert_allclose(rates[n:], accelerations(method, inputs, x, v, u), rtol=1e-10, atol=1e-10)


def tangent(system, x, v):
    """The velocity nearest to v that the constraints allow: their derivatives by SymPy."""
    if not system.constraints:
        return v
    q = [each.symbol for each in system.coordinates]
    rates = [each.rate for each in system.coordinates]
    rows = [
        [each.expression.diff(s) for s in (q if type(each).__name__ == "Constraint" else rates)]
        for each in system.constraints
    ]
    known = {each.symbol: each.default for each in system.parameters}
    G = np.array(lambdify(q, Matrix(rows).subs(known))(*x), dtype=float)
    return v - np.linalg.pinv(G) @ (G @ v)


def test_speeds_and_accelerations_stand_in_outputs():
    assert str(disc()[1].outputs[0].expression).count("qdot") or "q1dot" in str(disc()[1].outputs[0].expression)
    assert {str(each) for each in cart()[1].outputs[0].expression.free_symbols} == {"xddot", "L", "phi"}


def test_a_derivative_of_a_constraint_on_positions_is_no_further_constraint():
    assert [type(each).__name__ for each in bar()[1].constraints] == ["Constraint"]
    assert [type(each).__name__ for each in disc()[1].constraints] == ["Rolling", "Rolling"]


def test_the_lagrangian_is_split_at_rest():
    system = cart()[1]
    potential = {str(each) for each in system.potential_energy.free_symbols}
    assert potential == {"k", "x", "m", "g", "L", "phi"}
    at_rest = {each.rate: 0 for each in system.coordinates}
    assert system.kinetic_energy.subs(at_rest).expand() == 0


def simple(**changes):
    q, F = me.dynamicsymbols("q F")
    method = changes.pop("method", None) or me.LagrangesMethod(m * q.diff() ** 2 / 2 - F * q, [q])
    given = {
        "coordinates": [Coordinate(Symbol("q"), "m", "place")],
        "parameters": parameters(m),
        "inputs": [Input(Symbol("F"), "N", "force")],
    }
    return from_sympy(method, "simple", "Simple", **given | changes)


def kane(**changes):
    q, u, a = me.dynamicsymbols("q u a")
    N, P = me.ReferenceFrame("N"), me.Point("P")
    P.set_vel(N, u * N.x + (a * N.y if changes.get("u_auxiliary") else 0))
    given = {"kd_eqs": [q.diff() - u], "bodies": [me.Particle("P", P, m)], "u_auxiliary": None}
    return me.KanesMethod(N, [q], [u], **given | changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inputs": []}, r"F\(t\) is no coordinate of the method and no input: declare it, Input\(F, "),
        ({"coordinates": []}, "the method has the coordinates q, and none are declared"),
        (
            {"coordinates": [Coordinate(Symbol("x"), "m", "place")]},
            "the method has the coordinates q, and x are declared",
        ),
        ({"method": 3}, "found a int, expected a LagrangesMethod or a KanesMethod"),
        ({"multipliers": [("lam", "N", "pin")]}, "0 constraints on positions and 0 on velocities, and 1 multipliers"),
        ({"method": kane(bodies=None), "inputs": []}, "the method has no bodies: give them to KanesMethod"),
        ({"method": kane(u_auxiliary=[me.dynamicsymbols("a")]), "inputs": []}, r"auxiliary speeds \(a\) have no place"),
        ({"method": kane(kd_eqs=None), "inputs": []}, "1 generalized speeds are not those of 1 coordinates"),
    ],
)
def test_what_has_no_place_is_refused_by_name(changes, message):
    with pytest.raises(ModelError, match=message):
        simple(**changes)
    assert simple().name == "simple"


def test_a_speed_that_nothing_determines_is_refused():
    q, u = me.dynamicsymbols("q1:3"), me.dynamicsymbols("u1:3")
    N, P = me.ReferenceFrame("N"), me.Point("P")
    P.set_vel(N, u[0] * N.x)
    kinematic = [q[0].diff() - u[0] - u[1], q[1].diff() - 2 * (u[0] + u[1])]
    method = me.KanesMethod(N, q, u, kd_eqs=kinematic, bodies=[me.Particle("P", P, m)])
    with pytest.raises(ModelError, match="the kinematic equations cannot be solved for the generalized speeds"):
        from_sympy(method, "a", "A", coordinates=[Coordinate(each, "m", "x") for each in q], parameters=parameters(m))


def test_a_scene_is_read_as_the_rest_is():
    theta, push = me.dynamicsymbols("theta push")
    method = me.LagrangesMethod(m * (L * theta.diff()) ** 2 / 2 + m * g * L * cos(theta), [theta])
    method.form_lagranges_equations()
    bob = (L * sin(theta), -L * cos(theta))
    taken = from_sympy(
        method,
        "swing",
        "Swing",
        coordinates=[Coordinate(theta, "rad", "angle")],
        parameters=parameters(m, g, L),
        inputs=[Input(push, "N", "push")],
        scene=[Bar((0, 0), bob), Polygon([(0, 0), [L, 0], bob], colour="blue", angle=2 * theta), Arrow(bob, (push, 0))],
    )
    angle = Symbol("theta")
    place = (L * sin(angle), -L * cos(angle))
    bar, polygon, arrow = taken.scene
    assert str((bar.start, bar.end)) == str(((0, 0), place))
    assert str(polygon.corners) == str(((0, 0), (L, 0), place)) and polygon.colour == "blue"
    assert str(polygon.angle) == "2*theta" and str(arrow.force) == "(push, 0)"
