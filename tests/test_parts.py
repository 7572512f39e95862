"""Models put together from parts: beside the same model written in one piece, and beside SymPy; clashes by name."""

from dataclasses import fields

import numpy as np
import pytest
from derived import generated_module
from sympy import Rational, Symbol, cos, lambdify, sin, symbols
from sympy.physics import mechanics as me

from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.lagrange import derive
from qddot.model import (
    Constraint,
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
)

HALF = Rational(1, 2)
x, xdot, m, k, c, g = symbols("x xdot m k c g")
top, bottom, topdot, bottomdot, F = symbols("top bottom topdot bottomdot F")
z, zdot, a, s, sdot, tau = symbols("z zdot a s sdot tau")

mass = Part(
    "mass",
    coordinates=[Coordinate(x, "m", "place")],
    parameters=[Parameter(m, 1.0, "kg", "size"), Parameter(g, 9.81, "m/s^2", "acceleration of gravity")],
    kinetic_energy=HALF * m * xdot**2,
    potential_energy=m * g * x,
    shared=[g],
)
strut = Part(
    "strut",
    coordinates=[Coordinate(top, "m", "upper end"), Coordinate(bottom, "m", "lower end")],
    parameters=[Parameter(k, 100.0, "N/m", "stiffness"), Parameter(c, 3.0, "N s/m", "damping")],
    inputs=[Input(F, "N", "force of the {} actuator")],
    potential_energy=HALF * k * (top - bottom) ** 2,
    dissipation=HALF * c * (topdot - bottomdot) ** 2,
    generalized_forces={top: F, bottom: -F},
    outputs=[Output(Symbol("pull"), k * (bottom - top), "N", "spring force")],
)
x_1, x_2, x_3, theta, L, b = symbols("x_1 x_2 x_3 theta L b")
pendulum = Part(
    "pendulum",
    coordinates=[Coordinate(theta, "rad", "angle")],
    parameters=[Parameter(L, 0.8, "m", "length"), Parameter(b, 0.5, "kg", "bob")],
    kinetic_energy=HALF * b * ((Symbol("xdot_2") + L * Symbol("thetadot") * cos(theta)) ** 2
                               + (L * Symbol("thetadot") * sin(theta)) ** 2),
    potential_energy=-b * g * L * cos(theta),
)  # fmt: skip


def machine():
    """Two masses, struts to each other and to the ground, one from the end of a pendulum: ends as expressions."""
    tip = x_2 + L * sin(theta)
    whole = mass("1") + mass("2", m=2.5) + pendulum
    whole += strut("a", top=x_1, bottom=0) + strut("b", "middle", top=tip, bottom=x_1, k=250.0, c=0.7)
    return whole.system("machine", "Masses, struts and a pendulum")


def by_sympy():
    """The same by LagrangesMethod, in one piece: accelerations as a function of state, forces, parameters."""
    q1, q2, q3, u1, u2 = me.dynamicsymbols("q1 q2 q3 u1 u2")
    m1, m2, gr, rod, bob, ka, kb, ca, cb = p = symbols("m1 m2 gr rod bob ka kb ca cb")
    N = me.ReferenceFrame("N")
    end = q2 + rod * sin(q3)
    ground, one, two = me.Point("O"), me.Point("A"), me.Point("B")
    ground.set_vel(N, 0)
    one.set_vel(N, q1.diff() * N.x)
    two.set_vel(N, end.diff(me.dynamicsymbols._t) * N.x)
    T = m1 * q1.diff() ** 2 / 2 + m2 * q2.diff() ** 2 / 2
    T += bob * ((q2.diff() + rod * q3.diff() * cos(q3)) ** 2 + (rod * q3.diff() * sin(q3)) ** 2) / 2
    V = gr * (m1 * q1 + m2 * q2) - bob * gr * rod * cos(q3) + ka * q1**2 / 2 + kb * (end - q1) ** 2 / 2
    slip = end.diff(me.dynamicsymbols._t) - q1.diff()
    loads = [(one, (u1 - u2 - ca * q1.diff() + cb * slip) * N.x), (two, (u2 - cb * slip) * N.x)]
    method = me.LagrangesMethod(T - V, [q1, q2, q3], forcelist=loads, frame=N)
    method.form_lagranges_equations()
    state = [q1, q2, q3, q1.diff(), q2.diff(), q3.diff()]
    both = lambdify([state, [u1, u2], p], (method.mass_matrix, method.forcing))
    return lambda *given: np.linalg.solve(*both(*given)).ravel()


def test_masses_struts_and_a_pendulum_move_as_sympy_says(tmp_path):
    system = machine()
    module = generated_module(system, tmp_path)
    reference, chance = by_sympy(), np.random.default_rng(8)
    by_name = {str(each.symbol): each.default for each in system.parameters}
    assert list(by_name) == ["m_1", "m_2", "g", "L", "b", "k_a", "k_b", "c_a", "c_b"]
    p = np.array(list(by_name.values()))
    constants = np.zeros(100)
    module.constants.py_func(p, constants)
    for _ in range(5):
        state, u, rates = chance.uniform(-1, 1, 6), chance.uniform(-9, 9, 2), np.zeros(6)
        module.rhs.py_func(0.0, state, u, constants, rates)
        np.testing.assert_allclose(rates[3:], reference(state, u, p), rtol=1e-12)


def test_names_meanings_and_order_are_those_of_the_parts():
    system = machine()
    assert [str(each.symbol) for each in system.inputs] == ["F_a", "F_b"]
    assert [each.meaning for each in system.inputs] == ["force of the strut a actuator", "force of the middle actuator"]
    assert system.parameters[0].meaning == "size, mass 1"
    assert system.parameters[2].meaning == "acceleration of gravity"
    # an end that is a coordinate of a mass is that coordinate; one that is an expression is a quantity with its rate
    assert [(str(each.symbol), str(each.rate)) for each in system.quantities] == [
        ("bottom_a", "bottomdot_a"),
        ("top_b", "topdot_b"),
    ]
    assert system.outputs[0].expression == Symbol("k_a") * (Symbol("bottom_a") - x_1)
    page = text(describe(derive(system), "test.py"), width=100)
    assert "spring force, middle" in page
    assert "pull_a" in page.replace(" ", "") or "pullₐ" in page


def test_parts_of_parts():
    """A chain of two bogies of two masses is the chain that is written mass by mass."""
    pair = mass("1") + mass("2") + strut("0", top=x_1, bottom=x_2)
    four = (pair("f") + pair("r", k_0=7.0)).system("four", "Four")
    assert [str(each.symbol) for each in four.coordinates] == ["x_1_f", "x_2_f", "x_1_r", "x_2_r"]
    assert {str(each.symbol): each.default for each in four.parameters}["k_0_r"] == 7.0
    v = symbols("xdot_1_f xdot_2_f xdot_1_r xdot_2_r")
    sizes = symbols("m_1_f m_2_f m_1_r m_2_r")
    assert four.kinetic_energy == sum(HALF * size * rate**2 for size, rate in zip(sizes, v, strict=True))
    assert four.parameters[[str(each.symbol) for each in four.parameters].index("k_0_f")].meaning == (
        "stiffness, strut 0, mass 1 + mass 2 + strut 0 f"
    )


def test_all_that_a_system_has_joins():
    """States, tables, constraints, sets, positions, quantities before those that they use, Baumgarte's terms."""
    area = Table("area", "m^2", x=[0, 1], y=[1.0, 2.0])
    lam, h, w = symbols("lam h w")
    leg = Part(
        "leg",
        coordinates=[Coordinate(s, "m", "stroke"), Coordinate(z, "m", "height")],
        parameters=[
            Parameter(m, 1.0, "kg", "size"),
            Parameter(tau, 0.1, "s", "delay"),
            Parameter(a, 0.0, "m", "place"),
        ],
        inputs=[Input(w, "m", "ground", position=a)],
        states=[State(h, (s - h) / tau, "m", "lagging stroke", Symbol("rate_h"))],
        quantities=[Quantity(Symbol("e"), Symbol("body_height") - z, "m", "stretch", rate=Symbol("edot"))],
        constraints=[Constraint(lam, s - 2 * z, "N", "lever")],
        kinetic_energy=HALF * m * (sdot**2 + zdot**2),
        potential_energy=area(s) * (z - w) ** 2,
        dissipation=Symbol("edot") ** 2,
        generalized_forces={z: Symbol("rate_h"), Symbol("e"): -Symbol("e")},
        outputs=[Output(Symbol("held"), Symbol("reaction_s") + Symbol("sddot"), "N", "sum")],
        parameter_sets={"heavy": {m: 9.0}},
    )
    y, M = symbols("y M")
    body = Part(
        "body",
        coordinates=[Coordinate(y, "m", "heave")],
        parameters=[Parameter(M, 5.0, "kg", "body"), Parameter(a, 2.0, "1/s", "Baumgarte's")],
        kinetic_energy=HALF * M * Symbol("ydot") ** 2,
        quantities=[Quantity(Symbol("body_height"), 3 * y, "m", "height of the body")],
        parameter_sets={"heavy": {M: 50.0}},
        baumgarte=(a, a),
    )
    system = (leg("1", a=Symbol("a") / 2) + leg("2", tau=0.3) + body).system("legs", "Legs")
    assert [str(each.symbol) for each in system.states] == ["h_1", "h_2"]
    assert [str(each.rate) for each in system.states] == ["rate_h_1", "rate_h_2"]
    assert [each.position for each in system.inputs] == [a / 2, Symbol("a_2")]
    assert [str(each.symbol) for each in system.quantities] == ["body_height", "e_1", "e_2"]
    assert [str(each) for each in system.tables] and len(system.tables) == 1
    assert {str(each) for each in system.parameter_sets["heavy"]} == {"m_1", "m_2", "M"}
    assert [each.expression for each in system.constraints] == [Symbol(f"s_{i}") - 2 * Symbol(f"z_{i}") for i in (1, 2)]
    assert {str(q): str(force) for q, force in system.generalized_forces.items()} == {
        "z_1": "e_1 + rate_h_1",
        "z_2": "e_2 + rate_h_2",
        "y": "-3*e_1 - 3*e_2",
    }
    assert system.outputs[1].expression == Symbol("reaction_s_2") + Symbol("sddot_2")
    assert system.baumgarte == (a, a)
    derive(system)


def test_symbols_with_assumptions_are_one_with_plain_ones():
    stiff = Symbol("k", positive=True)
    part = Part(
        "part",
        coordinates=[Coordinate(Symbol("x", real=True), "m", "place")],
        parameters=[Parameter(stiff, 2.0, "N/m", "stiffness"), Parameter(m, 1.0, "kg", "size")],
        kinetic_energy=HALF * m * xdot**2,
        potential_energy=stiff * x**2,
    )
    system = part("1").system("one", "One")
    assert system.potential_energy == Symbol("k_1") * x_1**2
    with pytest.raises(ModelError, match="k_1 is declared with positive=True, and has the value -2"):
        part("1", k=-2.0).system("one", "One")


def clash(**changes):
    return Part("other", **changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: mass("1") + mass("1"), "part mass 1 is added twice: give each copy a mark of its own"),
        (lambda: mass("1", n=3), "part mass 1 declares no n"),
        (lambda: strut("1", botom=3), "part strut 1 declares no botom; did you mean bottom"),
        (lambda: strut("a b"), "the mark 'a b' must be a text of letters, digits and underscores"),
        (lambda: mass("1", m="3"), "part mass 1: m is '3', expected a number, a symbol or an expression"),
        (lambda: strut("1", pull=3), "pull_1, of the kind output, cannot be given"),
        (lambda: mass + clash(parameters=[Parameter(m, 2.0, "kg", "size")]),
         "parameter m is declared by mass and by other, with default 1.0 and 2.0: declare it in one of them"),
        (lambda: mass + clash(quantities=[Quantity(m, x, "m", "length")]),
         "m is among the parameters of mass and among the quantities of other: rename one of them"),
        (lambda: mass.renamed({"xx": "y"}), "part mass uses no name xx"),
        (lambda: mass.renamed({"m": "g"}), "m would become g, which it has already"),
        (lambda: (mass + strut).system("a", "A"), r"F \(force of the {} actuator\) holds {}, where a mark"),
        (lambda: (mass + clash(parameter_sets={"s": {m: 2.0}}) + Part("third", parameter_sets={"s": {m: 3.0}})),
         "parameter set s gives m the value 2.0 in mass \\+ other and 3.0 in third"),
        (lambda: Part("p", parameters=[Parameter(m, 1.0, "kg", "m")], parameter_sets={"s": {m: 2.0}})("1", m=k),
         "m_1 is given, and the set s gives it a value"),
        (lambda: clash(baumgarte=(k, k)) + Part("third", baumgarte=(c, c)), "baumgarte is .* in other and .* in third"),
        (lambda: Part("p", coordinates=[x]), "part p: coordinates holds x, expected Coordinate"),
        (lambda: Part("p", kinetic_energy="m"), "part p: kinetic energy is a str, expected a SymPy expression"),
        (lambda: (mass + clash(quantities=[Quantity(k, c, "m", "k"), Quantity(c, k, "m", "c")])).system("a", "A"),
         "k needs c needs k: quantities in a circle; give one of them"),
        (lambda: (mass + clash(potential_energy=k * Symbol("x_9"))).system("a", "A"), "uses x_9, which is not"),
    ],
)  # fmt: skip
def test_clashes_and_slips_are_refused_by_name_with_what_to_do(make, message):
    with pytest.raises(ModelError, match=message):
        make()


def test_parts_add_to_parts_alone():
    with pytest.raises(TypeError):
        _ = mass + 3


def test_a_part_has_all_that_a_system_has():
    assert {each.name for each in fields(System)} - {"title"} <= {each.name for each in fields(Part)}


def test_renaming_takes_rates_accelerations_and_reactions_along():
    part = mass.renamed({"x": "height_1"})
    assert part.kinetic_energy == HALF * m * Symbol("heightdot_1") ** 2
    out = Part("out", coordinates=[Coordinate(x, "m", "x", Symbol("v"))], outputs=[
        Output(Symbol("o"), Symbol("vdot") + Symbol("reaction_x") + Symbol("v"), "N", "sum")])  # fmt: skip
    assert {str(each) for each in out("7").outputs[0].expression.free_symbols} == {"vdot_7", "reaction_x_7", "v_7"}
    assert {str(each) for each in out.renamed({"x": "y"}).outputs[0].expression.free_symbols} == {
        "vdot", "reaction_y", "v",
    }  # fmt: skip
