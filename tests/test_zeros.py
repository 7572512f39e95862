"""What vanishes is dropped where it is proven, what is negated is shared, and nothing that is done changes a value."""

import keyword

import mpmath
import pytest
import symengine as se
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from sympy import Rational, cos, sin, symbols

from qddot.codegen.canonical import canonical, open_wave
from qddot.codegen.constants import hoist, telling
from qddot.codegen.kernel import Kernel, Slot
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower, optimize
from qddot.codegen.rewrite import Names, rewrite
from qddot.codegen.rules import flatten, folded, front, inline, prune, pythagoras, simplify
from qddot.codegen.sharing import share
from qddot.codegen.zeros import Point, without_zeros
from qddot.model.system import Coordinate, Parameter, System

SYMBOLS = a, b, c, d, x, y, z = se.symbols("a b c d x y z")
p, q, K = se.symbols("p q K")


def kernel(*expressions, temporaries=()):
    writes = tuple((Slot("out", (k,)), se.sympify(e)) for k, e in enumerate(expressions))
    return Kernel(frozenset((*SYMBOLS, K)), tuple(temporaries), writes)


DROPPED = [
    ("a bracket", b - (x * (a * y - c) / 2 - (a * x * y - c * x) / 2), b),
    ("two terms of a sum", a + (x + y) ** 2 - (x**2 + 2 * x * y + y**2), a),
    ("an angle sum", se.cos(x - y) - se.cos(x) * se.cos(y) - se.sin(x) * se.sin(y), 0),
    ("squares of sine and cosine", a * (1 - se.sin(x) ** 2 - se.cos(x) ** 2) + b, b),
    ("within a function", se.exp(x * (y + z) - x * y - x * z), 1),
    ("what opens to many", a + (a + b + c + d + x + y) ** 12 - se.expand((a + b + c + d + x + y) ** 6) ** 2, a),
    ("an angle three times", a + b * (se.sin(3 * x) - 3 * se.sin(x) + 4 * se.sin(x) ** 3), a),
    ("half angles", se.sin(x / 2 - y / 2) + se.sin(y / 2) * se.cos(x / 2) - se.sin(x / 2) * se.cos(y / 2), 0),
    ("decimals", a + b * (0.25 * x - x * (y + se.Rational(1, 4)) + x * y), a),
    ("a tangent", a + se.tan(x) * se.cos(x) - se.sin(x), a),
    ("within a branch", se.Piecewise((x * (y + 1) - x * y - x, x > 0), (y, True)), se.Piecewise((0, x > 0), (y, True))),
]
KEPT = [
    ("what is small", x * (1 + se.Rational(1, 10**14)) - x),
    ("what is small in a decimal", x * (y + 0.1) - x * y - x * se.Rational(10**20 + 1, 10**21)),
    ("a root that may be of another sign", se.sqrt(x**2) - x),
    ("angles that are not equal", se.sin(x / 2) * se.cos(x / 2) - se.sin(x) / 3),
    ("what is zero for some only", se.Piecewise((x, x > 0), (-x, True)) - x),
    ("an identity that is not proven", se.cosh(x) ** 2 - se.sinh(x) ** 2 - 1),
]


@pytest.mark.parametrize(("case", "before", "after"), DROPPED)
def test_what_vanishes_is_dropped(case, before, after):
    assert without_zeros(kernel(before)).writes[0][1] == after


@pytest.mark.parametrize(("case", "before"), KEPT)
def test_what_is_not_proven_is_kept(case, before):
    assert without_zeros(kernel(before)).writes[0][1] == before


def test_zeros_are_seen_through_temporaries():
    before = kernel(a * p - a * q, temporaries=[(p, x * (y + 1)), (q, x * y + x)])
    assert without_zeros(before).writes[0][1] == 0


def test_angles_are_seen_through_temporaries_however_many():
    """The last holds the first as often as a Fibonacci number of 47 digits says."""
    angles = [x, y, *se.symbols("u_0:220")]
    temporaries = [(angle, angles[k] + angles[k + 1]) for k, angle in enumerate(angles[2:])]
    first, last = angles[2], angles[-1]
    opened = se.sin(x) * se.cos(y) + se.cos(x) * se.sin(y)
    expressions = (
        se.sin(first) - opened,
        a * (se.sin(last) ** 2 + se.cos(last) ** 2 - 1),
        se.sin(last) - se.sin(first),
    )
    found = [value for _, value in without_zeros(kernel(*expressions, temporaries=temporaries)).writes]
    assert found == [0, 0, expressions[2]]


WAVES = [se.sin(x), se.cos(x), se.sin(x + y), se.cos(x - 2 * y), se.sin(y / 2), se.cos(3 * x), a, b, se.Rational(2, 3)]
PRODUCTS = st.lists(st.sampled_from(WAVES), min_size=1, max_size=4).map(lambda parts: se.Mul(*parts))
SUMS = st.lists(PRODUCTS, min_size=1, max_size=4).map(lambda terms: se.Add(*terms))


@settings(deadline=None, max_examples=100)
@given(SUMS, SUMS, st.sampled_from((0, se.Rational(1, 10**9))))
def test_a_point_of_the_field_finds_zero_where_the_canonical_form_is_empty(one, other, rest):
    """Against another way to prove it: a product of sums less the same opened, and that beside something small."""
    opened = se.expand(rewrite(one, open_wave, {}) * rewrite(other, open_wave, {}))
    for difference in (one * other - opened + rest * a, one - other):
        assert (Point().at(difference) == 0) == (not canonical(difference))


SHARED = [
    ("a negated sum", (x * (a + b), y * (-a - b)), [("tmp_1", a + b)]),
    ("a negated sum alone", (a * x + b * y, -a * x - b * y), [("tmp_1", a * x + b * y)]),
    ("in three, one negated", (a + b + c, a + b - d, y - a - b), [("tmp_1", a + b)]),
    ("all negative", (x * (-a - b), y * (-a - b)), [("tmp_1", a + b)]),
    ("what a constant has", (x * a * b, y * a * b * c), []),
]


@pytest.mark.parametrize(("case", "expressions", "expected"), SHARED)
def test_sharing_with_opposite_signs(case, expressions, expected):
    found = inline(share(kernel(*expressions), Names((*SYMBOLS, K)), {a * b: K}), frozenset())
    assert [(str(symbol), value) for symbol, value in found.temporaries] == expected
    if not expected:
        assert [value for _, value in found.writes] == [K * x, K * y * c]


NUMBERS = [
    (front, 4 * a - 2 * b - 2 * c, 2 * (2 * a - b - c)),
    (front, -a - b, -(a + b)),
    (front, a / 2 + b / 2, (a + b) / 2),
    (front, a / 2 + b / 24, a / 2 + b / 24),
    (front, 2 * a + b, 2 * a + b),
    (front, x * (2 * a + 2 * b), 2 * x * (a + b)),
    (folded({a / 2: K}), x * a / 2, K * x),
    (folded({a / 2: K}), -x * a / 2 + b, b - K * x),
    (folded({a / 2: K}), x * a, x * a),
]


@pytest.mark.parametrize(("rule", "before", "after"), NUMBERS)
def test_numbers(rule, before, after):
    assert simplify(kernel(before), (rule,)).writes[0][1] == after


NAMES = [
    (a**2, "a_squared"),
    (se.Symbol("g") * se.Symbol("L") / 2, "half_g_times_L"),
    (se.Symbol("g") * se.Symbol("m_2"), "g_times_m_2"),
    (1 / se.Symbol("m_1"), "inverse_m_1"),
    (a / (b * c), "a_over_b_and_c"),
    (a / (2 * b), "half_a_over_b"),
    (3 * a * b**2, "three_times_a_times_b_squared"),
    (se.sqrt(a), "root_of_a"),
    (a + b, "a_plus_b"),
    (b - a, "b_minus_a"),
    (-a - b, None),
    (a + b + c, None),
    (5 * a, None),
    (a * (b + c), None),
    (se.sin(a), None),
    (se.Symbol("stiffness_of_the_spring") * se.Symbol("mass_of_the_hull"), None),
]


@pytest.mark.parametrize(("expression", "name"), NAMES)
def test_constants_are_named_by_what_they_are(expression, name):
    assert telling(expression) == name


def test_a_constants_name_is_nobody_elses():
    squared = se.Symbol("a_squared")
    reads = frozenset((a, x, squared))
    before = Kernel(reads, (), ((Slot("out", (0,)), x * a**2 + x * squared), (Slot("out", (1,)), x * (a**2 + a**5))))
    constants, _ = hoist(before, frozenset((a, squared)), Names(reads))
    names = [str(symbol) for symbol, _ in constants]
    assert "a_squared_2" in names
    assert len({*names, "a", "x", "a_squared"}) == len(names) + 3
    assert all(name.isidentifier() and not keyword.iskeyword(name) for name in names)


def test_a_mass_matrix_that_is_diagonal_but_for_an_identity_is_diagonal():
    x, y, xdot, ydot, angle, m, k = symbols("x y xdot ydot angle m k")
    u, w = xdot * cos(angle) - ydot * sin(angle), xdot * sin(angle) + ydot * cos(angle)
    system = System(
        name="turned",
        title="A mass seen from axes that are turned",
        coordinates=(Coordinate(x, "m", "x"), Coordinate(y, "m", "y")),
        parameters=(Parameter(m, 1.0, "kg", "m"), Parameter(k, 1.0, "N/m", "k"), Parameter(angle, 0.3, "rad", "angle")),
        kinetic_energy=m * (u**2 + w**2) / 2,
        potential_energy=k * (x**2 + y**2) / 2,
    )
    equations = derive(system)
    assert equations.mass_matrix == "diagonal"
    assert set(equations.mass.values()) == {se.Symbol("m")}


def test_a_potential_that_is_quadratic_in_a_velocity_takes_part_in_the_balance_of_power():
    """L = m v^2/2 - k x^2/2 + mu x^2 v^2/2: (m + mu x^2) a + mu x v^2 + k x = 0, and T + Pi is not conserved."""
    x, xdot, m, mu, k = symbols("x xdot m mu k")
    half = Rational(1, 2)
    system = System(
        name="loaded",
        title="A potential with a velocity",
        coordinates=(Coordinate(x, "m", "x"),),
        parameters=(Parameter(m, 2.0, "kg", "m"), Parameter(mu, 0.7, "kg/m^2", "mu"), Parameter(k, 3.0, "N/m", "k")),
        kinetic_energy=half * m * xdot**2,
        potential_energy=half * k * x**2 - half * mu * x**2 * xdot**2,
    )
    program = lower(derive(system))
    given = {"m": 2.0, "mu": 0.7, "k": 3.0}
    constants = program.kernels["constants"].evaluate(given)
    named = {str(symbol): constants[f"constants[{i}]"] for i, symbol in enumerate(program.constants)}
    at, v = 0.3, 1.1
    acceleration = -(3.0 * at + 0.7 * at * v**2) / (2.0 + 0.7 * at**2)
    point = {"x": at, "xdot": v} | named
    assert program.kernels["rhs"].evaluate(point)["derivative[1]"] == pytest.approx(acceleration, rel=1e-12)
    change = 2.0 * v * acceleration + 3.0 * at * v - 0.7 * (at * v**3 + at**2 * v * acceleration)
    assert program.kernels["energy"].evaluate(point)["values[3]"] == pytest.approx(change, rel=1e-12)


def trees():
    """Expressions of which some parts vanish, some are opposites, and some are the same written otherwise."""
    leaves = st.sampled_from([*SYMBOLS, se.Integer(2), se.Rational(1, 2), se.Integer(-3)])

    def grown(inner):
        pairs = st.tuples(inner, inner)
        return st.one_of(
            pairs.map(lambda e: e[0] + e[1]),
            pairs.map(lambda e: e[0] - e[1]),
            pairs.map(lambda e: e[0] * e[1]),
            pairs.map(lambda e: e[0] - e[1] * (e[0] + 1) + e[1] + se.expand(e[0] * e[1])),
            pairs.map(lambda e: se.cos(e[0] - e[1]) - se.cos(e[0]) * se.cos(e[1]) - se.sin(e[0]) * se.sin(e[1])),
            inner.map(lambda e: -se.expand(e)),
            inner.map(se.sin),
            inner.map(se.cos),
            inner.map(lambda e: e**2),
            inner.map(lambda e: 1 / (2 + e**2)),
            pairs.map(lambda e: se.Piecewise((e[0], e[1] > 0), (e[1], True))),
        )

    return st.recursive(leaves, grown, max_leaves=10)


def value(expression, at):
    """An expression by mpmath's arithmetic."""
    kind = type(expression).__name__
    if not expression.args:
        return (
            at[expression]
            if expression.is_Symbol
            else mpmath.mpf(str(expression).partition("/")[0]) / int(str(expression).partition("/")[2] or 1)
        )
    if kind == "Piecewise":
        branches = zip(expression.args[::2], expression.args[1::2], strict=True)
        return next(value(e, at) for e, condition in branches if holds(condition, at))
    parts = [value(part, at) for part in expression.args]
    folds = {"Add": mpmath.fsum, "Mul": mpmath.fprod, "Pow": lambda of: mpmath.power(*of)}
    return folds[kind](parts) if kind in folds else getattr(mpmath, kind)(*parts)


def holds(condition, at):
    kind = type(condition).__name__
    if kind in ("BooleanTrue", "BooleanFalse"):
        return kind == "BooleanTrue"
    left, right = (value(part, at) for part in condition.args)
    assume(abs(left - right) > mpmath.mpf(10) ** -30)  # else the last digit would choose the branch
    return left < right if kind == "StrictLessThan" else left <= right


def written(finished, at):
    """What a kernel writes, in 50 digits."""
    known = dict(at)
    for symbol, expression in finished.temporaries:
        known[symbol] = value(expression, known)
    return [value(expression, known) for _, expression in finished.writes]


RULES = {
    "prune": prune,
    "inline": lambda before: inline(before, frozenset({p})),
    "zeros": without_zeros,
    "flatten": lambda before: simplify(before, (flatten,)),
    "pythagoras": lambda before: simplify(before, (pythagoras,)),
    "front": lambda before: simplify(before, (front,)),
    "share": lambda before: share(before, Names((*SYMBOLS, K, p, q)), {a * b: K}),
    "all": lambda before: optimize(before, frozenset({p}), {a * b: K, a / 2: q}, Names((*SYMBOLS, K, p, q))),
}


@settings(deadline=None, max_examples=60)
@given(st.lists(trees(), min_size=3, max_size=4), st.lists(st.fractions(-2, 2), min_size=7, max_size=7))
def test_no_rule_changes_a_value(expressions, numbers):
    with mpmath.workdps(50):
        at = {s: mpmath.mpf(n.numerator) / n.denominator for s, n in zip(SYMBOLS, numbers, strict=True)}
        at |= {K: at[a] * at[b], q: at[a] / 2}
        assigned, first, *others = expressions
        writes = tuple((Slot("out", (k,)), e) for k, e in enumerate((first * p, first + p, *others)))
        before = Kernel(frozenset((*SYMBOLS, K, q)), ((p, assigned),), writes)
        truth = written(before, at)
        for name, rule in RULES.items():
            for found, expected in zip(written(rule(before), at), truth, strict=True):
                assert abs(found - expected) <= mpmath.mpf(10) ** -40 * (1 + abs(expected)), name


@pytest.mark.parametrize("factor", [-3, -2, -1, 1, 2])
def test_a_sum_that_holds_another_and_its_terms_keeps_its_value(factor):
    """2 + a is a term of the sum and what the rest of it is made of: both stand for one symbol, and add up."""
    whole = 2 + a
    held = 2 + a + factor * whole if factor != 1 else 2 + a + se.sin(whole)
    writes = tuple((Slot("out", (k,)), e) for k, e in enumerate((se.cos(whole), se.sin(held))))
    before = Kernel(frozenset(SYMBOLS), (), writes)
    with mpmath.workdps(50):
        at = {symbol: mpmath.mpf(k + 1) / 7 for k, symbol in enumerate(SYMBOLS)}
        after = share(before, Names(SYMBOLS), {})
        for found, expected in zip(written(after, at), written(before, at), strict=True):
            assert abs(found - expected) < mpmath.mpf(10) ** -40
