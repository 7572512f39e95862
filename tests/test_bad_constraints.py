"""What is wrong with constraints is told by name, before anything is derived."""

import re

import pytest
from sympy import Abs, Heaviside, Max, Piecewise, Symbol, cos, log, sign, sin, sqrt, symbols

from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.model import (
    Constraint,
    Coordinate,
    Input,
    ModelError,
    Output,
    Parameter,
    Quantity,
    Rolling,
    System,
    Table,
    t,
)

x, y, phi, xdot, ydot, phidot = symbols("x y phi xdot ydot phidot")
m, L, g, lam, mu, w, wdot = symbols("m L g lam mu w wdot")


def system(**changes):
    """A mass on a rod in Cartesian coordinates, with changes."""
    given = {
        "name": "rod",
        "title": "Mass on a rod",
        "coordinates": [Coordinate(x, "m", "to the right"), Coordinate(y, "m", "up")],
        "parameters": [
            Parameter(m, 1.0, "kg", "mass"),
            Parameter(L, 1.0, "m", "length"),
            Parameter(g, 9.81, "m/s^2", "g"),
        ],
        "kinetic_energy": m * (xdot**2 + ydot**2) / 2,
        "potential_energy": m * g * y,
        "constraints": [Constraint(lam, x**2 + y**2 - L**2, "N/m", "the rod")],
    }
    return System(**given | changes)


def rod(expression, unit="N/m", symbol=lam, meaning="the rod"):
    return {"constraints": [Constraint(symbol, expression, unit, meaning)]}


def blade(expression, unit="N", **changes):
    """A constraint on velocities beside the rod, of which L is a parameter."""
    return {
        "constraints": [Rolling(mu, expression, unit, "a blade"), Constraint(lam, x**2 + y**2 - L**2, "N/m", "rod")]
    } | changes


WHEEL = [Coordinate(x, "m", "way"), Coordinate(phi, "rad", "angle")]
MOVED = [Input(w, "m", "foot")]

BAD = {
    "no_constraint": (lambda: {"constraints": [lam]}, "constraints holds lam, expected Constraint or Rolling"),
    "no_symbol": (lambda: rod(x - L, symbol="lam"), "constraint 'lam' is a str, expected a SymPy Symbol"),
    "text": (lambda: rod("x - L"), "constraint lam is a str, expected a SymPy expression"),
    "unknown": (lambda: rod(x**2 + y**2 - Symbol("l") ** 2), "constraint lam uses l, which is not declared"),
    "taken": (lambda: rod(x - L, "N", symbol=m), "m is used twice, as parameter and as multiplier"),
    "reaction_taken": (
        lambda: {"outputs": [Output(Symbol("reaction_x"), x, "m", "mine")]},
        "output reaction_x has the name of the reaction on x; choose another name",
    ),
    "no_unit": (lambda: rod(x - L, ""), "lam has no unit"),
    "strange_unit": (lambda: rod(x - L, "Newt"), "the unit of lam is 'Newt'"),
    "no_meaning": (lambda: rod(x - L, "N", meaning=" "), "lam has no meaning"),
    "wrong_unit": (
        lambda: rod(x**2 + y**2 - L**2, "N"),
        "the multiplier lam is in N, expected kg/s^2: what it multiplies is in m^2",
    ),
    "wrong_unit_of_rolling": (
        lambda: blade(xdot - 2 * ydot, "N s/m"),
        "the multiplier mu is in N s/m, expected kg m/s^2: what it multiplies is in m/s",
    ),
    "velocity": (
        lambda: rod(x * xdot, "N s"),
        "constraint lam depends on xdot; what is linear in the velocities is written as Rolling",
    ),
    "constant": (lambda: {**rod(L - 1, "N")}, "constraint lam constrains no coordinate: it says L - 1 = 0"),
    "time_alone": (lambda: rod(sin(t) * L, "N"), "constraint lam constrains no coordinate"),
    "cancels": (
        lambda: rod((x + y) ** 2 - x**2 - 2 * x * y - y**2 + L**2, "N"),
        "constraint lam constrains no coordinate: it says L**2 = 0",
    ),
    "input": (
        lambda: {"inputs": MOVED, **rod(x - w - L, "N")},
        "constraint lam depends on the input w, whose second derivative the equations need",
    ),
    "acceleration": (
        lambda: rod(Symbol("xddot") - L, "N"),
        "constraint lam uses xddot, an acceleration, which is not known yet there",
    ),
    "its_multiplier": (
        lambda: rod(x - lam * L, "N"),
        "constraint lam uses lam, a multiplier, which is not known yet there",
    ),
    "kink": (lambda: rod(Abs(x) - L, "N"), "constraint lam has a kink where x passes 0, as at x = "),
    "kink_in_a_quantity": (
        lambda: {"quantities": [Quantity(Symbol("s"), Max(x, y), "m", "larger")], **rod(Symbol("s") - L, "N")},
        "constraint lam has a kink where x passes y, as at x = ",
    ),
    "kink_in_time": (lambda: rod(x - L - Max(t - 1, 0), "N"), "constraint lam has a kink where t passes 1"),
    "piecewise": (
        lambda: rod(Piecewise((x, x > L), (y, True)), "N"),
        "constraint lam jumps where L passes x",
    ),
    "step": (
        lambda: blade(xdot * Heaviside(y) + ydot, "N"),
        "constraint mu jumps where y passes 0, as at y = ",
    ),
    "linear_table": (
        lambda: rod(y - L * Table("track", "1", [0, 1, 2], [0, 1, 0])(x), "N"),
        "constraint lam has a kink at the points of the table track, at which velocities would jump",
    ),
    "held_table": (
        lambda: rod(y - L * Table("track", "1", [0, 1, 2], [0, 1, 0], interpolation="cubic")(x), "N"),
        "constraint lam has a kink at the ends of the table track, at which velocities would jump",
    ),
    "complex": (lambda: rod(x - L * sqrt(-1), "N"), "it is complex"),
    "complex_in_a_case": (
        lambda: {"quantities": [Quantity(Symbol("s"), log(sign(x)), "1", "log")], **rod(y - L * Abs(Symbol("s")), "N")},
        "constraint lam uses Abs(log(sign(x))): in one of its cases it compares what is complex",
    ),
    "not_linear": (
        lambda: blade(xdot**2 - ydot * L, "N"),
        "constraint mu is not linear in the velocities: the factor of xdot depends on xdot",
    ),
    "product": (
        lambda: blade(xdot * ydot, "N"),
        "constraint mu is not linear in the velocities: the factor of xdot depends on ydot",
    ),
    "no_velocity": (
        lambda: blade(x - L * cos(y / L), "N"),
        "constraint mu depends on no velocity; write it as Constraint",
    ),
    "rate_of_input": (
        lambda: blade(xdot - wdot, "N", inputs=MOVED),
        "constraint mu depends on wdot, the rate of an input, so the equations need its second derivative",
    ),
    "twice": (
        lambda: {"constraints": [Constraint(lam, x - y - L, "N", "one"), Constraint(mu, y - x + L, "N", "other")]},
        "constraints lam and mu say the same; leave one of them out",
    ),
    "contradictory": (
        lambda: {"constraints": [Constraint(lam, x - y - L, "N", "one"), Constraint(mu, x - y + L, "N", "other")]},
        "constraints lam and mu contradict each other: they differ by 2*L",
    ),
    "no_inertia": (
        lambda: {"kinetic_energy": m * xdot**2 / 2, **rod(x - L, "N")},
        "coordinate y has no inertia: the kinetic energy does not depend on ydot, and no constraint acts on it",
    ),
    "no_inertia_together": (
        lambda: {
            "kinetic_energy": m * xdot**2 / 2,
            "coordinates": [*WHEEL, Coordinate(y, "m", "up")],
            **rod(y - L * phi, "N"),
        },
        "a motion of phi, y together, which the constraints allow, has no kinetic energy",
    ),
    "reaction_on_none": (
        lambda: {**rod(x - L, "N"), "outputs": [Output(Symbol("pull"), Symbol("reaction_y"), "N", "pull")]},
        "output pull uses reaction_y, and no constraint acts on y",
    ),
    "baumgarte_alone": (
        lambda: {"constraints": [], "baumgarte": (1, 1), "potential_energy": m * g * L},
        "baumgarte is given, and there are no constraints",
    ),
    "baumgarte_of_one": (lambda: {"baumgarte": (1,)}, "baumgarte has 1 entries, expected two, alpha and beta"),
    "baumgarte_moves": (
        lambda: {"baumgarte": (x, 1)},
        "baumgarte: alpha depends on x; it may depend on parameters alone",
    ),
    "multiplier_in_a_quantity": (
        lambda: {"quantities": [Quantity(Symbol("s"), lam * x, "N", "pull")]},
        "quantity s uses lam, a multiplier, which is not known yet there",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_constraints_are_refused_by_name(case):
    changes, message = BAD[case]
    with pytest.raises(ModelError, match=re.escape(message)) as refused:
        system(**changes())
    assert str(refused.value).startswith("model rod: ")


def test_good_ones_are_taken():
    system()
    system(baumgarte=(5, 5))
    system(outputs=[Output(Symbol("pull"), lam * x + Symbol("reaction_y"), "N", "pull")])
    system(**blade(sin(x / L) * xdot - cos(x / L) * ydot))


def test_a_symbol_that_a_kernel_uses_itself():
    for name in ("residuals", "right_side"):
        with pytest.raises(ModelError, match=f"quantity '{name}' would shadow a name"):
            used = [Output(Symbol("o"), Symbol(name), "m", "o")]
            lower(derive(system(quantities=[Quantity(Symbol(name), x, "m", "mine")], outputs=used)))


def test_too_many():
    many = symbols("q_1:202")
    coordinates = [Coordinate(q, "m", "position") for q in many]
    speeds = [c.rate for c in coordinates]
    with pytest.raises(ModelError, match="201 coordinates and 1 constraints are too many: 200 together"):
        many_masses = {"kinetic_energy": m * sum(v**2 for v in speeds) / 2, "potential_energy": g * m * many[0]}
        lower(derive(system(coordinates=coordinates, **many_masses, **rod(many[0] - many[1] - L, "N"))))
