"""What makes a model physics: every slip is named, with what to do about it."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sympy import Derivative, Function, Piecewise, Rational, Symbol, latex, symbols

from qddot.codegen.lagrange import derive
from qddot.model.naming import dotted, name_problem
from qddot.model.system import Coordinate, Input, ModelError, Output, Parameter, Quantity, System, t

x, xdot, xddot, y, ydot, m, k, c, f, s, r, w, wdot = symbols("x xdot xddot y ydot m k c F s r w wdot")
half = Rational(1, 2)

GOOD = System(
    name="mass",
    title="Mass on a spring",
    coordinates=[Coordinate(x, "m", "displacement")],
    parameters=[Parameter(m, 2.0, "kg", "mass"), Parameter(k, 50.0, "N/m", "stiffness")],
    kinetic_energy=half * m * xdot**2,
    potential_energy=half * k * x**2,
    generalized_forces={x: f},
    inputs=[Input(f, "N", "force")],
)

TWO = (Coordinate(x, "m", "first"), Coordinate(y, "m", "second"))
ASSUMED = Symbol("k", negative=True)

BAD = {
    "undeclared symbol": (
        {"potential_energy": half * c * x**2},
        "potential energy uses c, which is not declared",
        "parameter k is used nowhere",
    ),
    "slip in a name": (
        {"potential_energy": half * Symbol("kk") * x**2},
        "potential energy uses kk, which is not declared; did you mean k?",
    ),
    "other assumptions": (
        {"potential_energy": half * ASSUMED * x**2},
        "parameter k is declared with negative=True, and has the value 50.0",
    ),
    "symbol used twice": ({"inputs": [Input(k, "N", "force")]}, "k is used twice, as parameter and as input"),
    "velocity as parameter": (
        {"parameters": [*GOOD.parameters, Parameter(xdot, 1.0, "m/s", "speed")]},
        "xdot is used twice, as velocity and as parameter",
    ),
    "no velocity in T": (
        {"kinetic_energy": half * m * x**2},
        "the kinetic energy depends on no velocity (xdot)",
    ),
    "coordinate without inertia": (
        {"coordinates": TWO, "potential_energy": half * k * (x - y) ** 2},
        "coordinate y has no inertia: the kinetic energy does not depend on ydot, so the mass matrix is singular",
    ),
    "singular mass matrix": (
        {"coordinates": TWO, "kinetic_energy": half * m * (xdot + ydot) ** 2},
        "the mass matrix is singular: a motion of x, y together has no kinetic energy",
    ),
    "unused parameter": (
        {"parameters": [*GOOD.parameters, Parameter(c, 1.0, "N s/m", "damping")]},
        "parameter c is used nowhere",
    ),
    "unused input": ({"generalized_forces": {}}, "input F is used nowhere"),
    "unused quantity": ({"quantities": [Quantity(s, 2 * x, "m", "stretch")]}, "quantity s is used nowhere"),
    "undeclared symbol in a position": (
        {"inputs": [Input(f, "N", "force", position=Symbol("kk"))]},
        "position of F uses kk, which is not declared; did you mean k?",
    ),
    "moving position": (
        {"inputs": [Input(f, "N", "force", position=s)], "quantities": [Quantity(s, k + x, "m", "place")]},
        "position of F depends on s, which moves; it may depend on parameters alone",
    ),
    "no position": ({"inputs": [Input(f, "N", "force", position="front")]}, "position of F is a str"),
    "no identifier": (
        {"parameters": [*GOOD.parameters, Parameter(Symbol("1k"), 1.0, "N/m", "stiffness")]},
        "parameter '1k' is not a valid identifier",
    ),
    "hostile name": (
        {"parameters": [*GOOD.parameters, Parameter(Symbol("a=1;import os"), 1.0, "1", "trouble")]},
        "parameter 'a=1;import os' is not a valid identifier",
    ),
    "keyword": (
        {"parameters": [*GOOD.parameters, Parameter(Symbol("lambda"), 1.0, "1", "factor")]},
        "parameter 'lambda' is a Python keyword",
    ),
    "time as a parameter": (
        {"parameters": [*GOOD.parameters, Parameter(t, 1.0, "s", "time")]},
        "t is used twice, as time and as parameter",
    ),
    "bad model name": ({"name": "my model"}, "the name 'my model' is not a valid identifier"),
    "no unit": ({"inputs": [Input(f, " ", "force")]}, 'F has no unit; write "1" where it has none'),
    "no meaning": ({"coordinates": [Coordinate(x, "m", "")]}, "x has no meaning"),
    "line break in a meaning": (
        {"inputs": [Input(f, "N", "force\nimport os")]},
        "the meaning of F holds a character that cannot be printed",
    ),
    "default not finite": (
        {"parameters": [Parameter(m, float("nan"), "kg", "mass"), GOOD.parameters[1]]},
        "parameter m has the default nan, expected a finite number",
    ),
    "default as text": (
        {"parameters": [Parameter(m, "2", "kg", "mass"), GOOD.parameters[1]]},
        "parameter m has the default '2', expected a finite number",
    ),
    "unknown name in a set": (
        {"parameter_sets": {"heavy": {Symbol("mm"): 3.0}}},
        "parameter set heavy names mm, which is no parameter; did you mean m?",
    ),
    "set with a value that is none": (
        {"parameter_sets": {"heavy": {m: float("inf")}}},
        "parameter set heavy gives m the value inf, expected a finite number",
    ),
    "force on no coordinate": (
        {"generalized_forces": {y: f}},
        "a generalized force is given for y, which is no coordinate",
    ),
    "text as expression": (
        {"potential_energy": "k*x**2/2"},
        "potential energy is a str, expected a SymPy expression",
    ),
    "functions of time": (
        {"potential_energy": half * k * Function("x")(t) ** 2},
        "potential energy uses x(t): write plain symbols for coordinates and velocities, not functions of time",
    ),
    "derivative": (
        {"potential_energy": half * k * Derivative(Function("x")(t), t) ** 2},
        "write plain symbols for coordinates and velocities",
    ),
    "acceleration in a force": (
        {"generalized_forces": {x: f * xddot}},
        "generalized force of x uses xddot, an acceleration",
    ),
    "quantity before its time": (
        {"quantities": [Quantity(s, 2 * r, "m", "one"), Quantity(r, x, "m", "two")], "outputs": []},
        "quantity s uses r, which comes later",
    ),
    "quantity of itself": ({"quantities": [Quantity(s, s + x, "m", "one")]}, "quantity s uses itself"),
    "rate of a velocity": (
        {"quantities": [Quantity(s, xdot, "m/s", "speed", rate=r)]},
        "quantity s depends on xdot, so its rate would need accelerations",
    ),
    "output's slip": (
        {"outputs": [Output(Symbol("a"), xdot * c, "N", "force")]},
        "output a uses c, which is not declared",
    ),
    "output with a taken name": (
        {"outputs": [Output(k, k * x, "N", "force")]},
        "k is used twice, as parameter and as output",
    ),
    "no coordinates": ({"coordinates": []}, "has no coordinates"),
    "symbol as text": ({"inputs": [Input("F", "N", "force")]}, "input 'F' is a str, expected a SymPy Symbol"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_model_is_refused_by_name(case):
    changes, *expected = BAD[case]
    with pytest.raises(ModelError) as refused:
        replace(GOOD, **changes)
    message = str(refused.value)
    assert message.startswith(f"model {changes.get('name', 'mass')}: ")
    for part in expected:
        if part == "parameter k is used nowhere":
            continue  # one thing at a time: names are checked before uses
        assert part in message


def test_all_slips_of_a_kind_are_told_at_once():
    with pytest.raises(ModelError) as refused:
        replace(GOOD, inputs=[Input(f, "", "")], coordinates=[Coordinate(x, "", "displacement")])
    assert str(refused.value).count("has no unit") == 2


def test_energies_with_the_rate_of_an_input_are_refused_with_a_way_out():
    moving = replace(GOOD, inputs=[Input(w, "m", "base")], generalized_forces={}, kinetic_energy=m * (xdot + wdot) ** 2)
    with pytest.raises(ModelError, match="second derivative: declare it as a prescribed motion"):
        derive(moving)


def test_functions_of_every_symbol_are_accepted():
    kinked = Piecewise((k * x**2, x < 0), (k * x**3, True)) + m * x * t
    assert derive(replace(GOOD, potential_energy=kinked)).forces


def test_the_checks_do_not_depend_on_lists_or_tuples():
    assert replace(GOOD, coordinates=tuple(GOOD.coordinates)) == GOOD


@given(st.from_regex(r"[a-z]{1,6}(_[a-z0-9]{1,3})?", fullmatch=True))
def test_dotted_names_are_valid_differ_and_print_with_dots(name):
    once = dotted(Symbol(name))
    twice = dotted(once)
    assert len({name, once.name, twice.name}) == 3
    assert name_problem(once.name) is None
    assert "dot" in latex(once)


def test_dotted_names_of_the_shipped_models():
    assert dotted(Symbol("q_6")).name == "qdot_6"
    assert dotted(dotted(Symbol("q_6"))).name == "qddot_6"
    assert latex(dotted(dotted(Symbol("theta_1")))) == r"\ddot{\theta}_{1}"
