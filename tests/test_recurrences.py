"""The nodes of Taylor series against mpmath at 50 digits, and their machine code against the nodes."""

import ctypes
from functools import cache

import mpmath
import numpy as np
import pytest
import symengine as se
from series_reference import coefficients
from series_runs import run

import qddot
from qddot.codegen.recurrences import NoRecurrenceError, Recurrences, factor_text
from qddot.codegen.rewrite import Names
from qddot.runner.load import available
from qddot.runner.machine import series_code as machine
from qddot.runner.machine import series_integrals
from qddot.runner.machine.memory import on_cache_line
from qddot.runner.machine.recurrences import RecurrenceError, read_recurrences
from qddot.runner.machine.series_code import series_code

A, B, K, T = se.symbols("a b k t")
#: Series of the two arguments about 0, and the constant.
ARGUMENTS = {"a": [0.4, -0.7, 0.3], "b": [1.3, 0.5, -0.2, 0.1]}
CONSTANT, ORDER = 1.7, 9

EXPRESSIONS = {
    "sum": (3 * A - K * B + 2, lambda a, b, k, t: 3 * a - k * b + 2),
    "product": (A * B * (A + B), lambda a, b, k, t: a * b * (a + b)),
    "square": (K * A**2, lambda a, b, k, t: k * a**2),
    "quotient": (A / B, lambda a, b, k, t: a / b),
    "quotient of products": (K * A * B / (A**2 + B), lambda a, b, k, t: k * a * b / (a**2 + b)),
    "whole power": (B**5, lambda a, b, k, t: b**5),
    "negative power": (B**-3, lambda a, b, k, t: b**-3),
    "root": (se.sqrt(B), lambda a, b, k, t: mpmath.sqrt(b)),
    "inverse root": (A / se.sqrt(B), lambda a, b, k, t: a / mpmath.sqrt(b)),
    "power of a constant": (B**K, lambda a, b, k, t: b**k),
    "power of three halves": (B ** se.Rational(3, 2), lambda a, b, k, t: b ** mpmath.mpf("1.5")),
    "moving power": (B**A, lambda a, b, k, t: b**a),
    "exponential": (se.exp(-A * B), lambda a, b, k, t: mpmath.exp(-a * b)),
    "logarithm": (se.log(B), lambda a, b, k, t: mpmath.log(b)),
    "sine": (se.sin(A * B), lambda a, b, k, t: mpmath.sin(a * b)),
    "cosine": (se.cos(A * B), lambda a, b, k, t: mpmath.cos(a * b)),
    "sine of time": (A * se.sin(K * T + 1), lambda a, b, k, t: a * mpmath.sin(k * t + 1)),
    "tangent": (se.tan(A), lambda a, b, k, t: mpmath.tan(a)),
    "arcsine": (se.asin(A), lambda a, b, k, t: mpmath.asin(a)),
    "arccosine": (se.acos(A), lambda a, b, k, t: mpmath.acos(a)),
    "arctangent": (se.atan(A * B), lambda a, b, k, t: mpmath.atan(a * b)),
    "angle": (se.atan2(A, B), lambda a, b, k, t: mpmath.atan2(a, b)),
    "hyperbolic sine": (se.sinh(A), lambda a, b, k, t: mpmath.sinh(a)),
    "hyperbolic cosine": (se.cosh(A), lambda a, b, k, t: mpmath.cosh(a)),
    "hyperbolic tangent": (se.tanh(K * A), lambda a, b, k, t: mpmath.tanh(k * a)),
    "inverse hyperbolic sine": (se.asinh(A), lambda a, b, k, t: mpmath.asinh(a)),
    "inverse hyperbolic cosine": (se.acosh(B), lambda a, b, k, t: mpmath.acosh(b)),
    "inverse hyperbolic tangent": (se.atanh(A), lambda a, b, k, t: mpmath.atanh(a)),
    "error function": (se.erf(A), lambda a, b, k, t: mpmath.erf(a)),
    "branch that holds": (
        se.Piecewise((A**2, se.And(A < B, se.Not(B < 0))), (A * B, True)),
        lambda a, b, k, t: a**2,
    ),
    "branch that does not": (
        se.Piecewise((se.sqrt(A - B), se.Or(B < A, B < 0)), (A * B, True)),
        lambda a, b, k, t: a * b,
    ),
}
#: Those with a number that no double holds: 2 over the root of pi.
ROUNDED = {"error function"}


@cache
def table():
    """All expressions in one table, a state each that is its integral; and the names of the states in order."""
    states = [f"y_{i}" for i in range(len(EXPRESSIONS))]
    recurrences = Recurrences([K], {T: se.Integer(1)}, Names(["a", "b", "k", "t", *states]))
    nodes = [recurrences.node(expression) for expression, _ in EXPRESSIONS.values()]
    rows = {state: ("integral", "1", node) for state, node in zip(states, nodes, strict=True)} | recurrences.rows
    return "\n".join(" ".join((name, *row)) for name, row in rows.items()), tuple(states)


def sides_of(read, constants, values, t=0.0):
    """Which of what conditions compare is below zero at the start, by name, other conditions being so."""
    sides = dict.fromkeys(read.sides, 0.0)
    for _ in read.sides:
        first = coefficients(read, constants, values, 1, t=t, sides=sides)
        sides = {name: float(first[read.nodes[name].arguments[0]][0] < 0) for name in read.sides}
    return sides


def given(read):
    return {**ARGUMENTS, **dict.fromkeys(read.states, 0.0)}


@cache
def reference():
    text, states = table()
    with mpmath.workdps(50):
        read = read_recurrences(text, states, ("a", "b"), ("k",))
        return coefficients(
            read,
            [mpmath.mpf(CONSTANT)],
            given(read),
            ORDER,
            t=0.25,
            sides=sides_of(read, [CONSTANT], given(read), 0.25),
        )


def polynomial(values, x):
    return mpmath.polyval([mpmath.mpf(value) for value in reversed(values)], x)


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_the_rows_of_an_expression_are_its_series_to_50_digits(name):
    _, states = table()
    function = EXPRESSIONS[name][1]
    found = reference()
    place = list(EXPRESSIONS).index(name)
    with mpmath.workdps(50):

        def value(x):
            a, b = (polynomial(ARGUMENTS[each], x) for each in "ab")
            return function(a, b, mpmath.mpf(CONSTANT), mpmath.mpf("0.25") + x)

        expected = mpmath.taylor(value, 0, ORDER - 1)
        for k in range(ORDER):
            error = abs(found[states[place]][k + 1] * (k + 1) - expected[k])
            assert error < mpmath.mpf(10) ** (-15 if name in ROUNDED else -40) * (1 + abs(expected[k]))


def test_the_machine_code_agrees_with_the_rows():
    text, states = table()
    code = series_code(text, states, ("a", "b"), ("k",))
    found = sides_of(code.table, [CONSTANT], given(code.table), 0.25)
    sides = [found[name] for name in code.table.sides]
    inputs = [[ARGUMENTS[name][k] if k < len(ARGUMENTS[name]) else 0.0 for name in "ab"] for k in range(5)]
    found = run(code, [CONSTANT], np.zeros(len(states)), inputs, ORDER, t=0.25, sides=sides)
    for i, name in enumerate(states):
        expected = np.array([float(value) for value in reference()[name]])
        np.testing.assert_allclose(found[:, i], expected, rtol=1e-11, atol=1e-13, err_msg=list(EXPRESSIONS)[i])


@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_each_lane_of_the_machine_code_is_what_the_run_alone_is(lanes, monkeypatch):
    """Every rule, with constants, inputs and times of its own in each lane, rows in parts of any number of lanes."""
    monkeypatch.setattr(machine, "_register", lambda: lanes)
    text, states = table()
    alone, rows = (
        series_code(text, states, ("a", "b"), ("k",)),
        series_code.__wrapped__(text, states, ("a", "b"), ("k",), 8),
    )
    found = sides_of(alone.table, [CONSTANT], given(alone.table), 0.25)
    sides = [found[name] for name in alone.table.sides]
    scale, places = np.random.default_rng(2).uniform(0.98, 1.02, (3, 8)), rows.memory
    inputs = np.array([[ARGUMENTS[name][k] if k < len(ARGUMENTS[name]) else 0.0 for name in "ab"] for k in range(5)])
    memory = on_cache_line(places.size)
    memory[:16] = *np.ones(8), *0.25 * scale[2]
    for place, number, constants in places.factors:
        memory[place : place + 8] = number * (CONSTANT * scale[0]) ** len(constants)
    for i, side in enumerate(sides):
        memory[places.sides + 8 * i :][:8] = side
    for k, i in np.ndindex(inputs.shape):
        memory[places.inputs + k * places.input_stride + 8 * i :][:8] = inputs[k, i] * scale[1]
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64)(rows.series)(memory.ctypes.data, ORDER)
    series = memory[places.states :][: (ORDER + 1) * places.state_stride].reshape(ORDER + 1, -1, 8)
    times, target = 0.1 * scale[2], np.zeros(places.state_stride)
    sum_up = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)(rows.polynomial)
    sum_up(memory.ctypes.data, ORDER, times.ctypes.data, target.ctypes.data)
    for lane in range(8):
        given_lane = [CONSTANT * scale[0, lane]], np.zeros(len(states)), inputs * scale[1, lane], ORDER
        expected = run(alone, *given_lane, t=0.25 * scale[2, lane], sides=sides)
        np.testing.assert_allclose(series[:, :, lane], expected, rtol=1e-10, atol=1e-12)
        summed = sum(expected[k] * times[lane] ** k for k in range(ORDER + 1))
        np.testing.assert_allclose(target.reshape(-1, 8)[:, lane], summed, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize(
    ("sense", "width", "in_registers", "register", "few"),
    [(1, 2, 8, 8, 4), (-1, 4, 0, 4, 0), (1, 8, 8, 8, 4), (-1, 2, 8, 4, 0), (1, 2, 8, 2, 4)],
)
@pytest.mark.parametrize("name", [name for name in available() if qddot.load(name).tables.recurrence])
def test_the_series_of_a_model_is_that_of_its_table(name, sense, width, in_registers, register, few, monkeypatch):
    monkeypatch.setattr(machine, "_WIDTHS", ((width, 0),))
    monkeypatch.setattr(machine, "_register", lambda: register)
    monkeypatch.setattr(machine, "_FEW", few)
    monkeypatch.setattr(series_integrals, "_IN_REGISTERS", in_registers)
    model = qddot.load(name)
    tables, n = model.tables, len(model.state_names)
    channels = tuple(channel.name for channel in tables.inputs[: tables.rhs_inputs])
    code = series_code.__wrapped__(tables.recurrence, model.state_names, channels, tables.constant_names)
    random = np.random.default_rng(3)
    x, u = random.uniform(-1, 1, n), random.uniform(-1, 1, (4, model.tables.rhs_inputs))
    c = model.constants(model.parameter_values())
    values = dict(zip(model.state_names, x, strict=True))
    values |= {channel: list(u[:, i]) for i, channel in enumerate(code.table.inputs)}
    sides = sides_of(code.table, list(c), values)
    found = run(code, c, x, u, 10, sides=list(sides.values()), sense=sense)
    with mpmath.workdps(50):
        expected = coefficients(code.table, [mpmath.mpf(each) for each in c], values, 10, sides=sides, sense=sense)
        slopes = np.array([float(expected[state][1]) for state in model.state_names])
        wanted = np.array([[float(each) for each in expected[state]] for state in model.state_names]).T
    size = np.abs(wanted).max(axis=1, keepdims=True)  # rounding grows with the order where a divisor is small
    assert (np.abs(found - wanted) <= 1e-13 * 4.0 ** np.arange(11)[:, None] * size).all()
    dx = np.zeros(n)
    channels = np.zeros(max(1, len(model.tables.inputs)))
    channels[: u.shape[1]] = u[0]
    model.kernel("rhs")(0.0, x, channels, c, dx)
    np.testing.assert_allclose(sense * slopes, dx, rtol=1e-10, atol=1e-12 * np.abs(dx).max())


def test_a_row_that_is_wrong_is_named():
    for row, said in (
        ("x integral 1 y", "made of 'y', which is no node"),
        ("x integral 1 x\ny twisted x", "there is no rule 'twisted'"),
        ("x integral 1 x\ny product x", "1 operands, expected 2"),
        ("x integral 1 x\ny linear q*2 x", "could not convert"),
        ("y product 1 1", "no row of the state x"),
        ("x integral 1 x\nx integral 1 x", "x stands twice"),
    ):
        with pytest.raises(RecurrenceError, match=said):
            read_recurrences(row, ("x",), (), ("k",))


def test_a_function_without_a_recurrence_is_named():
    with pytest.raises(NoRecurrenceError, match="=="):
        Recurrences([], {}, Names([])).node(se.Piecewise((A, se.Eq(A, B)), (B, True)))


def test_factors_are_written_short():
    assert [factor_text(*each) for each in ((1.0, ()), (-1.0, ("k",)), (0.5, ("k", "k")), (2.0, ("m",)))] == [
        *("1", "-k", "0.5*k*k", "2*m")
    ]
