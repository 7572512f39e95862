"""Sums of products, and what makes them shorter: sin^2 + cos^2, angle sums, gathering what moves alike."""

from collections.abc import Callable, Iterator, Set
from itertools import combinations
from math import comb
from typing import Any

import symengine as se

from qddot.codegen.nodes import operands, remembered, symbols_of
from qddot.codegen.rewrite import ONE, ZERO, factors, is_number, split_number

#: A product of powers: base -> exponent as pairs; a sum is such products with their coefficients.
Product = frozenset[tuple[Any, Any]]
Polynomial = dict[Product, Any]

#: (partner of a product, its coefficient over that product's, what to multiply the coefficient by, what both make)
_Pair = tuple[Product, Any, Any, Product]


def polynomial(expression: Any) -> Polynomial:
    """An expanded expression as products with coefficients."""
    found: Polynomial = {}
    for term in operands(expression) if isinstance(expression, se.Add) else (expression,):
        number, rest = split_number(term)
        if number != ZERO:
            product = frozenset(map(_base_and_exponent, factors(rest)))
            found[product] = found.get(product, ZERO) + number
    return found


def _base_and_exponent(factor: Any) -> tuple[Any, Any]:
    if isinstance(factor, se.Pow) and is_number(operands(factor)[1]):
        return operands(factor)
    return factor, ONE


def without_squares(terms: Polynomial) -> Polynomial:
    """With a sin^2 x + a cos^2 x = a."""
    return _merged(terms, _square_partners)


def with_angle_sums(terms: Polynomial) -> Polynomial:
    """With cos x cos y + sin x sin y = cos(x - y), and the three others."""
    return _merged(terms, _sum_partners)


def _merged(terms: Polynomial, partners: Callable[[Product], Iterator[_Pair]]) -> Polynomial:
    """Replace pairs of products whose coefficients match, until there are none left."""
    left = dict(terms)
    waiting = list(terms)
    while waiting:
        product = waiting.pop(0)
        for partner, ratio, scale, result in partners(product) if product in left else ():
            if partner != product and partner in left and left[partner] == ratio * left[product]:
                number = scale * left.pop(product)
                del left[partner]
                left[result] = left.get(result, se.Integer(0)) + number
                waiting.append(result)
                break
    return {product: number for product, number in left.items() if number != ZERO}


def _square_partners(product: Product) -> Iterator[_Pair]:
    for wave in _in_order(product, 2):
        if isinstance(wave[0], se.sin):
            rest = product - {wave}
            yield rest | {(se.cos(operands(wave[0])[0]), wave[1])}, 1, 1, rest


def _sum_partners(product: Product) -> Iterator[_Pair]:
    for (first, one), (second, _) in combinations(_in_order(product, 1), 2):
        x, y = operands(first)[0], operands(second)[0]
        rest = product - {(first, one), (second, one)}
        swapped = rest | {(_other(first), one), (_other(second), one)}
        alike, sine_first = isinstance(first, se.sin) == isinstance(second, se.sin), isinstance(first, se.sin)
        for ratio in (1, -1):
            # r is 1 or -1: cos x cos y + r sin x sin y = cos(x - r y), sin x cos y + r cos x sin y = sin(x + r y)
            wave = se.cos(x - ratio * y) if alike else se.sin(x + ratio * y)
            number, result = split_number(wave)
            yield swapped, ratio, number * (ratio if alike == sine_first else 1), rest | {(result, one)}


def _other(wave: Any) -> Any:
    return se.cos(operands(wave)[0]) if isinstance(wave, se.sin) else se.sin(operands(wave)[0])


def _in_order(product: Product, exponent: int) -> list[tuple[Any, Any]]:
    return sorted((part for part in product if _is_wave(part[0]) and part[1] == exponent), key=str)


def _is_wave(base: Any) -> bool:
    return isinstance(base, se.sin | se.cos)


def total(terms: Polynomial) -> Any:
    """Products with coefficients as an expression."""
    return se.Add(*(number * _product(product) for product, number in terms.items()))


def _product(product: Product) -> Any:
    return se.Mul(*(base**exponent for base, exponent in product))


def gathered(terms: Polynomial, fixed: Set[Any]) -> Iterator[Any]:
    """Yield the sum with terms that move alike in one, m_1 g x + m_2 g x = g (m_1 + m_2) x; nothing where none do."""
    groups: dict[Product, Polynomial] = {}
    for product, number in terms.items():
        front = frozenset(part for part in product if symbols_of(part[0]) and symbols_of(part[0]) <= fixed)
        groups.setdefault(product - front, {})[front] = number
    if len(groups) == len(terms):
        return
    parts = []
    for moving, fronts in groups.items():
        common = frozenset.intersection(*fronts)
        inner = total({front - common: number for front, number in fronts.items()})
        parts.append(_product(common) * inner * _product(moving))
    yield se.Add(*parts)


@remembered
def spread(expression: Any) -> int:
    """How many terms an expression opens to, at most."""
    if isinstance(expression, se.Add):
        return sum(map(spread, operands(expression)))
    if isinstance(expression, se.Mul):
        count = 1
        for part in operands(expression):
            count *= spread(part)
        return count
    if (
        isinstance(expression, se.Pow)
        and isinstance(operands(expression)[1], se.Integer)
        and operands(expression)[1] > 0
    ):
        base, exponent = spread(operands(expression)[0]), int(operands(expression)[1])
        return comb(base + exponent - 1, exponent)
    return 1
