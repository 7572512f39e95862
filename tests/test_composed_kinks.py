"""Kinks within kinks, in all places of a model, beside the same expressions computed by SymPy's lambdify."""

import random

import numpy as np
import pytest
from sympy import (
    ITE,
    Abs,
    Eq,
    Heaviside,
    Interval,
    Max,
    Min,
    Ne,
    Not,
    Piecewise,
    Union,
    lambdify,
    oo,
    sign,
    sin,
    symbols,
    sympify,
)

from qddot.codegen.generate import artefacts
from qddot.model import Coordinate, ModelError, Parameter, Quantity, System

x, v, d, a, b, m, s, sdot = symbols("x xdot d a b m s sdot")
VALUES = {d: 0.3, a: 0.5, b: 0.2, m: 1.3}
#: Dead zones, saturations, bump stops, lift-off, and whatever a condition may be made of.
EXPRESSIONS = {
    "dead zone": Max(0, Abs(x) - d) ** 2,
    "saturation": Min(Max(x, -a), a),
    "bump stops": Max(x - a, -x - b, 0),
    "jump beyond a play": Heaviside(Abs(x) - d),
    "sign of a lift-off": sign(Max(x, 0)),
    "abs of abs": Abs(Abs(x) - d),
    "and": Piecewise((x, (x > a) & (x < 2 * a)), (0, True)),
    "or": Piecewise((x, (x > a) | (x < -a)), (x**2, True)),
    "interval": Piecewise((x, Interval(-a, a).contains(x)), (x**2 / a, True)),
    "half line": Piecewise((x, Interval(0, oo).contains(x)), (-2 * x, True)),
    "open half line": Piecewise((x, Interval.open(-oo, b).contains(x)), (b, True)),
    "union": Piecewise((x, Union(Interval(0, a), Interval(2 * a, oo)).contains(x)), (0, True)),
    "not equal": Piecewise((sin(x) / x, Ne(x, 0)), (1, True)),
    "equal": Piecewise((1, Eq(x, 0)), (x, True)),
    "not": Piecewise((x, Not((x > a) & (x < 1))), (x**2, True)),
    "if then else": Piecewise((x, ITE(x > 0, x < a, x > -b)), (0, True)),
    "play and direction": Max(0, Abs(x) - d) * sign(v),
    "three deep": Max(0, Abs(Max(x, -b) - d) - 0.1) ** 2,
}
JUMPING = {
    *("jump beyond a play", "sign of a lift-off", "and", "or", "interval", "union", "not", "if then else"),
    "play and direction",
}
H = 1e-6


def model(place, expression):
    """A mass with the expression as its force, as a quantity with its rate, as Pi, or within Phi."""
    of_speed = expression.has(v)
    given = {"generalized_forces": {}}
    if place == "Q":
        given["generalized_forces"] = {x: expression}
    elif place == "quantity":
        rate = None if of_speed else sdot
        given["quantities"] = [Quantity(s, expression, "m", "s", rate=rate)]
        given["generalized_forces"] = {x: -s - (0 if of_speed else sdot)}
    elif place == "Pi":
        given["potential_energy"] = expression
    else:
        given["dissipation"] = v * expression if of_speed else v**2 * expression
    used = {m} | expression.free_symbols
    parameters = [Parameter(each, value, "1", f"number {each}") for each, value in VALUES.items() if each in used]
    return System("kinked", "Kinks", [Coordinate(x, "m", "x")], parameters, m * v**2 / 2, **given)


def force(place, value, X, V, of_speed):
    """The force that the model has at a state, by differences of what lambdify gives."""
    if place == "Q":
        return value(X, V)
    if place == "quantity":
        return -value(X, V) - (0 if of_speed else (value(X + H * V, V) - value(X - H * V, V)) / (2 * H))
    if place == "Pi":
        return -(value(X + H, V) - value(X - H, V)) / (2 * H)

    def phi(V):
        return value(X, V) * (V if of_speed else V**2)

    return -(phi(V + H) - phi(V - H)) / (2 * H)


def right_hand_side(system):
    """The function rhs of the generated module, run as Python."""
    names = {}
    text = next(text for name, text in artefacts(system, "test.py").items() if name.endswith(".py"))
    exec(text.replace("from numba import njit", "njit = lambda **options: lambda function: function"), names)
    constants = np.zeros(60)
    names["constants"]([float(each.default) for each in system.parameters], constants)

    def acceleration(X, V):
        rates = [0.0, 0.0]
        names["rhs"](0.0, [X, V], np.zeros(len(names["INPUT"])), constants, rates)
        return rates[1]

    return acceleration


@pytest.mark.parametrize("place", ["Q", "quantity", "Pi", "Phi"])
@pytest.mark.parametrize("name", EXPRESSIONS)
def test_kinks_are_differentiated_piece_by_piece_wherever_they_stand(name, place):
    expression = sympify(EXPRESSIONS[name])
    if place == "Pi" and name in JUMPING:
        with pytest.raises(ModelError, match=r"potential energy jumps where .*: its force would be an impulse"):
            model(place, expression)
        return
    system = model(place, expression)
    acceleration = right_hand_side(system)
    finite = expression.replace(oo, 1e300) if expression.has(oo) else expression
    value = lambdify((x, v), finite.subs(VALUES), "math")
    chance = random.Random(f"{name} {place}")
    for _ in range(60):
        X, V = chance.uniform(-1.4, 1.4), chance.uniform(-1, 1)
        expected = force(place, value, X, V, expression.has(v)) / VALUES[m]
        assert acceleration(X, V) == pytest.approx(expected, rel=1e-7, abs=1e-7), (X, V)


def test_infinity_beyond_a_comparison_is_still_refused():
    with pytest.raises(ModelError, match="it is infinite"):
        model("Q", Piecewise((oo, x > 0), (x, True)))
