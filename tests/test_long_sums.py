"""Derivatives of products with long sums, taken term by term: those of the whole, whatever stands before the sum."""

import symengine as se
from hypothesis import given, settings
from hypothesis import strategies as st

from qddot.codegen.calculus import Definitions

SYMBOLS = se.symbols("a b c d e f")
FACTORS = st.sampled_from([se.Integer(2), SYMBOLS[0], SYMBOLS[1] ** 2, se.sin(SYMBOLS[2]), 1 / SYMBOLS[3]])
TERMS = st.builds(
    lambda number, left, right, wave: number * left * (se.cos(right) if wave else right),
    st.integers(1, 5),
    st.sampled_from(SYMBOLS),
    st.sampled_from(SYMBOLS),
    st.booleans(),
)


def product(factors, terms):
    """Factors times a sum."""
    return se.Mul(*factors, se.Add(*terms))


@settings(max_examples=60, deadline=None, print_blob=True)
@given(
    st.lists(
        st.tuples(st.lists(FACTORS, max_size=3), st.lists(TERMS, min_size=7, max_size=14)), min_size=1, max_size=3
    ),
    st.lists(FACTORS, max_size=2),
)
def test_the_gradient_of_sums_within_products_within_sums(parts, outer):
    expression = product(outer, [product(*part) for part in parts] + [se.Symbol(f"w_{k}") for k in range(8)])
    found = Definitions({}).gradient(expression, SYMBOLS)
    for symbol in SYMBOLS:
        assert se.expand(found.get(symbol, se.Integer(0)) - expression.diff(symbol)) == 0


def test_quantities_within_are_followed():
    a, b, w = se.symbols("a b w")
    others = se.symbols("s_1:9")
    total = se.Add(*(k * each for k, each in enumerate(others, 2)), w * a)
    found = Definitions({w: a * b}).gradient(b * total, (a, b, others[0]))
    expected = (b * total).subs({w: a * b})
    for symbol in (a, b, others[0]):
        assert se.expand(found[symbol].subs({w: a * b}) - expected.diff(symbol)) == 0
