"""What `generate` writes compiles, and no expression keeps it for ever."""

import time

import mpmath
import pytest
import symengine as se
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Rational, exp, lambdify, log, symbols

from codegen.lagrange import derive
from codegen.lower import lower
from codegen.rules import collect
from model.system import Coordinate, Parameter, System

x, xdot, y, ydot, k, m = symbols("x xdot y ydot k m")


def model(potential, kinetic=m * (xdot**2 + ydot**2) / 2, **more):
    coordinates = (Coordinate(x, "m", "x"), Coordinate(y, "m", "y"))
    parameters = (Parameter(k, 1.0, "N", "k"), Parameter(m, 1.0, "kg", "mass"))
    return System("own", "Own", coordinates, parameters, kinetic, potential, **more)


SYMBOLIC_POWERS = [
    k * (x + 2) ** y,
    k * (x + 2) ** (x + y + 1),
    k * (x + 2) ** y * (y + 3) ** x,
    k * (x + k) ** (y + k) * log(x + k),
    k * (x + 2) ** (y * x),
    k * (1 + x) ** exp(y),
    k * x ** (x**y),
]


@pytest.mark.parametrize("potential", SYMBOLIC_POWERS, ids=str)
def test_powers_of_symbols_are_generated_in_a_second_and_right(potential):
    started = time.monotonic()
    program = lower(derive(model(potential)))
    assert time.monotonic() - started < 5
    point = {"x": 0.7, "y": 0.4, "xdot": 0.3, "ydot": -0.2, "k": 1.3, "m": 2.5, "t": 0.0}
    constants = program.kernels["constants"].evaluate(point)
    named = {str(symbol): constants[f"constants[{i}]"] for i, symbol in enumerate(program.constants)}
    slopes = program.kernels["jacobian"].evaluate(point | named)

    energy = lambdify((x, y), potential.subs(k, Rational(13, 10)), "mpmath")
    with mpmath.workdps(40):
        for orders, place in (((2, 0), "matrix[2, 0]"), ((1, 1), "matrix[3, 0]"), ((0, 2), "matrix[3, 1]")):
            expected = -mpmath.diff(energy, (0.7, 0.4), orders) / point["m"]
            assert slopes[place] == pytest.approx(float(expected), rel=1e-8)


SE = se.symbols("a b c")


@given(
    st.lists(
        st.tuples(st.integers(-3, 3), st.sampled_from(SE), st.integers(-2, 2), st.sampled_from(SE)),
        min_size=2,
        max_size=6,
    )
)
@settings(max_examples=100, deadline=None)
def test_collecting_factors_keeps_the_value_where_exponents_are_sums(terms):
    base = SE[0] + 2
    total = se.Add(*(number * first * base ** (SE[1] + power) * second for number, first, power, second in terms))
    point = dict(zip(SE, (0.7, 1.1, 1.9), strict=True))
    assert float(collect(total).subs(point)) == pytest.approx(float(total.subs(point)), rel=1e-9, abs=1e-9)
