"""One form for all ways to write a sum: products with coefficients, angle sums opened, sin^2 written as 1 - cos^2."""

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import symengine as se
import symengine.lib.symengine_wrapper as wrapper

from qddot.codegen.identities import Polynomial, polynomial, spread
from qddot.codegen.nodes import holding, operands
from qddot.codegen.rewrite import fraction, rewrite, split_number

#: What is no real number, and what is none to all digits.
_holds_unreal = holding(
    wrapper.Infinity, wrapper.NegativeInfinity, wrapper.ComplexInfinity, wrapper.NaN, wrapper.Complex
)
_holds_floating = holding(se.RealDouble)

#: An expression that would open to more terms is refused.
_MOST_TERMS = 20000
#: A multiple of an angle beyond this stays closed.
MOST_TURNS = 8


class AlgebraError(ValueError):
    """What has no such form: too long, or no real number; the message says which."""


def canonical(expression: Any) -> Polynomial:
    """The products of an expression, none with the coefficient 0; floating-point numbers are taken as decimals."""
    opened = _expanded(rewrite(_exact(expression), open_wave, {}))
    opened = _expanded(rewrite(opened, _no_squared_sine, {}))
    return {product: number for product, number in polynomial(opened).items() if number != 0}


def combined(found: Iterable[tuple[int | Any, Polynomial]]) -> Polynomial:
    """A sum of multiples of polynomials."""
    total: Polynomial = {}
    for scale, terms in found:
        for product, number in terms.items():
            total[product] = total.get(product, se.Integer(0)) + scale * number
    return {product: number for product, number in total.items() if number != 0}


def _expanded(expression: Any) -> Any:
    if spread(expression) > _MOST_TERMS:
        raise AlgebraError(f"an expression opens to more than {_MOST_TERMS} terms, which is too many to compare")
    return se.expand(expression)


def _exact(expression: Any) -> Any:
    """An expression with decimals in place of floating-point numbers; AlgebraError for what is no real number."""
    if _holds_unreal(expression):
        raise AlgebraError("an expression divides by zero or takes the root of a negative number")
    if not _holds_floating(expression):
        return expression
    found = set(_nodes(expression))
    floats = {node: exact(fraction(node)) for node in found if isinstance(node, se.RealDouble)}
    return expression.xreplace(floats)


def exact(value: Fraction) -> Any:
    """A fraction as SymEngine's number."""
    return se.Rational(value.numerator, value.denominator)


def _nodes(expression: Any) -> Iterable[Any]:
    yield expression
    for part in operands(expression):
        yield from _nodes(part)


def open_wave(node: Any) -> Any:
    """Sine, cosine and tangent of a sum or a multiple in terms of those of what it is made of; others as they are."""
    if isinstance(node, se.tan):
        return open_wave(se.sin(operands(node)[0])) / open_wave(se.cos(operands(node)[0]))
    if not isinstance(node, se.sin | se.cos):
        return node
    sine, cosine = _sine_and_cosine(_expanded(operands(node)[0]))
    return sine if isinstance(node, se.sin) else cosine


def _sine_and_cosine(argument: Any) -> tuple[Any, Any]:
    if isinstance(argument, se.Add):
        first, rest = operands(argument)[0], se.Add(*operands(argument)[1:])
        (s, c), (t, d) = _sine_and_cosine(first), _sine_and_cosine(rest)
        return s * d + c * t, c * d - s * t
    number, rest = split_number(argument)
    if isinstance(number, se.Integer) and number != 1 and abs(int(number)) <= MOST_TURNS and rest != 1:
        s, c = _sine_and_cosine(rest)
        if number == -1:
            return -s, c
        t, d = _sine_and_cosine((abs(int(number)) - 1) * rest)
        turned = s * d + c * t, c * d - s * t
        return (-turned[0], turned[1]) if number < 0 else turned
    return se.sin(argument), se.cos(argument)


def _no_squared_sine(node: Any) -> Any:
    if isinstance(node, se.Pow) and isinstance(operands(node)[0], se.sin) and isinstance(operands(node)[1], se.Integer):
        power = int(operands(node)[1])
        if power > 1:
            cosine = se.cos(operands(operands(node)[0])[0])
            return operands(node)[0] ** (power % 2) * (1 - cosine**2) ** (power // 2)
    return node
