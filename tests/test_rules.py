"""The generator's algebra: each rule as a table, and all of them as functions that keep every value."""

import math

import numpy as np
import pytest
import symengine as se
from hypothesis import given, settings
from hypothesis import strategies as st

from qddot.codegen.constants import hoist
from qddot.codegen.elimination import factorize, solve
from qddot.codegen.kernel import Kernel, KernelError, Slot
from qddot.codegen.lower import optimize
from qddot.codegen.nodes import forget
from qddot.codegen.ordering import ordering
from qddot.codegen.printer import Printer
from qddot.codegen.rewrite import Names, factors
from qddot.codegen.rules import collect, flatten, inline, prune, pythagoras, simplify
from qddot.codegen.sharing import share

SYMBOLS = a, b, c, d, x, y, z = se.symbols("a b c d x y z")


def kernel(*expressions, temporaries=()):
    writes = tuple((Slot("out", (k,)), se.sympify(e)) for k, e in enumerate(expressions))
    return Kernel(frozenset(SYMBOLS), tuple(temporaries), writes)


def shown(finished):
    printer = Printer({symbol: k for k, symbol in enumerate(SYMBOLS[::-1])})
    return [f"{symbol} = {printer(e)}" for symbol, e in finished.temporaries] + [printer(e) for _, e in finished.writes]


LOCAL = [
    (flatten, a - (b + 2 * (c + d)), a - b - 2 * c - 2 * d),
    (flatten, x * (a - (b - c)), x * (a - b + c)),
    (flatten, a * (b + c), a * (b + c)),
    (pythagoras, a * se.sin(x) ** 2 + a * se.cos(x) ** 2 + b, a + b),
    (pythagoras, a * se.sin(x) ** 2 + a * se.cos(y) ** 2, a * se.sin(x) ** 2 + a * se.cos(y) ** 2),
    (pythagoras, 3 * x * se.sin(y) ** 2 + 3 * x * se.cos(y) ** 2, 3 * x),
    (collect, a * x + a * y + b, a * (x + y) + b),
    (collect, a * x + a * y + b * x, a * (x + y) + b * x),
    (collect, a * c * x + a * c * y, a * c * (x + y)),
    (collect, a + b, a + b),
    (collect, x**2 * a - x**2 * b + c * x, x**2 * (a - b) + c * x),
]


@pytest.mark.parametrize(("rule", "before", "after"), LOCAL)
def test_local_rules(rule, before, after):
    assert simplify(kernel(before), (rule,)).writes[0][1] == after


def test_a_term_alone_is_collected_whatever_equal_node_was_asked_for_its_factors_before():
    forget()
    factors(se.Symbol("a"))
    assert collect(a * x + a + y) == a * (x + 1) + y


SHARED = [
    ("nothing twice", (a + b, c * d), ["b + a", "d * c"]),
    ("a whole sum", (x * (a + b), y * (a + b)), ["tmp_1 = b + a", "tmp_1 * x", "tmp_1 * y"]),
    ("part of a sum", (a + b + c, a + b + d), ["tmp_1 = b + a", "tmp_1 + c", "tmp_1 + d"]),
    ("part with opposite signs", (a + b + c, d - a - b), ["tmp_1 = b + a", "tmp_1 + c", "d - tmp_1"]),
    ("part of a product", (a * b * c, a * b * d), ["tmp_1 = b * a", "tmp_1 * c", "tmp_1 * d"]),
    ("a named function", (se.sin(x) * a, se.sin(x) * b), ["sin_x = math.sin(x)", "sin_x * a", "sin_x * b"]),
    ("a square", (x**2 + a, x**2 + b), ["x_squared = x * x", "x_squared + a", "x_squared + b"]),
    ("a sign is no operation", (-x, -x * y), ["-x", "-y * x"]),
]


@pytest.mark.parametrize(("case", "expressions", "expected"), SHARED)
def test_sharing(case, expressions, expected):
    found = shown(share(kernel(*expressions), Names(SYMBOLS)))
    assert sorted(map(sorted, found)) == sorted(map(sorted, expected))  # same symbols, whatever their order
    assert len(found) == len(expected)


def test_prune_drops_what_nothing_needs():
    before = kernel(y, temporaries=[(se.Symbol("p"), a + b), (se.Symbol("q"), se.Symbol("p") * 2)])
    assert prune(before).temporaries == ()


def test_inline_keeps_the_authors_names_and_what_is_used_twice():
    p, q, r = se.symbols("p q r")
    before = kernel(p * q + r * r, temporaries=[(p, a + b), (q, c), (r, a * b)])
    after = inline(before, frozenset({p}))
    assert [symbol for symbol, _ in after.temporaries] == [p, r]
    assert after.writes[0][1] == p * c + r * r


def test_hoist_leaves_no_parameter_arithmetic_and_no_division_by_parameters():
    constants, left = hoist(
        kernel(x * a / b + a * b, -y / (a + b), se.sin(a) * z + x), frozenset({a, b}), Names(SYMBOLS)
    )
    fixed = {a, b} | {symbol for symbol, _ in constants}
    for _, expression in left.writes:
        for node in walk(expression):
            compound = node.args and not all(part.is_Number for part in node.args)
            assert not (compound and node.free_symbols and node.free_symbols <= fixed)
    assert [str(symbol) for symbol, _ in constants][:2] == ["a_over_b", "a_times_b"]


def walk(expression):
    yield expression
    for part in expression.args:
        yield from walk(part)


def test_kernels_are_in_single_assignment_form():
    p = se.Symbol("p")
    with pytest.raises(KernelError, match="p is assigned twice"):
        kernel(p, temporaries=[(p, a), (p, b)])
    with pytest.raises(KernelError, match="before assignment"):
        kernel(p, temporaries=[(p, se.Symbol("q"))])
    with pytest.raises(KernelError, match="which nothing assigns"):
        kernel(p)
    with pytest.raises(KernelError, match="no value for"):
        kernel(a + b).evaluate({"a": 1.0})


STEPS = [
    (se.sign(x - se.pi), {"x": 3.0}, -1.0),
    (se.sign(x - se.sqrt(2)) * y, {"x": 1.5, "y": 4.0}, 4.0),
    (se.floor(x + se.pi), {"x": 0.3}, 3.0),
    (se.Max(se.pi, x, se.sin(x)), {"x": 0.3}, math.pi),
    (se.sign(se.sqrt(2) - se.pi), {}, -1.0),
    (se.atan2(x, y), {"x": 1.0, "y": -1.0}, 0.75 * math.pi),
    (se.atan2(x, y) * se.sign(x - se.pi), {"x": 1.0, "y": -1.0}, -0.75 * math.pi),
    (x**y, {"x": -2.0, "y": 3.0}, -8.0),
    (x**y, {"x": -2.0, "y": 0.5}, math.nan),
    (se.log(x), {"x": -1.0}, math.nan),
    (se.log(x), {"x": 0.0}, -math.inf),
]


@pytest.mark.parametrize(("expression", "values", "expected"), STEPS)
def test_a_kernel_has_the_values_that_real_numbers_have(expression, values, expected):
    assert kernel(expression).evaluate(values) == {"out[0]": pytest.approx(expected, rel=1e-12, nan_ok=True)}


def test_operations_are_counted():
    assert kernel(a + b * c - d).operations == 3
    assert kernel(-a).operations == 0
    assert kernel(se.sin(a) / b).operations == 3  # sine, reciprocal, product


leaves = st.sampled_from([*SYMBOLS, se.Integer(2), se.Rational(1, 2), se.Integer(-3)])
trees = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: p[0] + p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] - p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] * p[1]),
        inner.map(se.sin),
        inner.map(se.cos),
        inner.map(lambda e: e**2),
        inner.map(lambda e: 1 / (2 + e**2)),
        st.tuples(inner, inner).map(lambda p: se.Piecewise((p[0], p[1] > 0), (p[1], True))),
    ),
    max_leaves=12,
)


@settings(deadline=None, max_examples=150)
@given(st.lists(trees, min_size=1, max_size=4), st.lists(st.floats(-2, 2), min_size=7, max_size=7))
def test_optimized_kernels_and_printed_code_keep_every_value(expressions, numbers):
    values = dict(zip(map(str, SYMBOLS), numbers, strict=True))
    before = kernel(*expressions)
    after = optimize(before, frozenset(), {}, Names(SYMBOLS))
    constants, hot = hoist(after, frozenset({a, b}), Names(SYMBOLS))
    truth = before.evaluate(values)
    assert after.evaluate(values) == pytest.approx(truth, rel=1e-9, abs=1e-9)
    room = dict(values)
    printer = Printer({symbol: k for k, symbol in enumerate(SYMBOLS)})
    for symbol, expression in (*constants, *hot.temporaries):
        room[str(symbol)] = eval(printer(expression), {"math": math}, room)
    printed = {str(slot): eval(printer(expression), {"math": math}, room) for slot, expression in hot.writes}
    assert printed == pytest.approx(truth, rel=1e-9, abs=1e-9)


@settings(deadline=None, max_examples=60)
@given(st.integers(1, 6), st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_unrolled_elimination_solves_sparse_positive_definite_systems(n, seed, density):
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(n, n)) * (rng.random((n, n)) < density)
    M = half @ half.T + n * np.eye(n)
    right = rng.normal(size=n) * (rng.random(n) < 0.7)
    entries = {(k, j): se.Symbol(f"M_{k}_{j}") for k in range(n) for j in range(k + 1) if M[k, j] != 0}
    values = {str(symbol): M[pair] for pair, symbol in entries.items()}
    loads = {k: se.Symbol(f"r_{k}") for k in range(n) if right[k] != 0}
    values |= {str(symbol): right[k] for k, symbol in loads.items()}
    names = Names(values)
    factors = factorize(entries, ordering(entries, n), names.fresh)
    steps, x = solve(factors, loads, names.fresh)
    reads = frozenset([*entries.values(), *loads.values()])
    writes = tuple((Slot("x", (k,)), x[k]) for k in sorted(x))
    found = Kernel(reads, (*factors.assignments, *steps), writes).evaluate(values)
    solution = np.zeros(n)
    for k in x:
        solution[k] = found[f"x[{k}]"]
    assert solution == pytest.approx(np.linalg.solve(M, right), rel=1e-9, abs=1e-10)


PRINTED = [
    (x / y, "x / y"),
    (1 / (x * y), "1.0 / y / x"),
    (x**3, "x * x * x"),
    (x**7, "x ** 7"),
    (se.sqrt(x), "math.sqrt(x)"),
    (1 / se.sqrt(x), "1.0 / math.sqrt(x)"),
    (x ** se.Rational(3, 2), "x * math.sqrt(x)"),
    (se.exp(x), "math.exp(x)"),
    (se.exp(-x), "math.exp(-x)"),
    (x - (y + z) / 2, "x - 0.5 * (y + z)"),
    (-(x + y) * z, "-z * (x + y)"),
    (se.atan2(x, y), "math.atan2(x, y)"),
    (se.pi * x, "math.pi * x"),
    (se.Piecewise((x, x > 0), (-x, True)), "(x if (x > 0.0) else -x)"),
    (se.Piecewise((x, se.And(x > 0, y < 1)), (0, True)), "(x if ((x > 0.0) and (y < 1.0)) else 0.0)"),
]


@pytest.mark.parametrize(("expression", "text"), PRINTED)
def test_printed_python(expression, text):
    assert Printer({symbol: k for k, symbol in enumerate(SYMBOLS)})(expression) == text
