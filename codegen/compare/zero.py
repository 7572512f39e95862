"""Whether an expression vanishes: tried at points, in as many digits as the numbers met there ask for.

An analytic function that is zero at random points is zero, but for a chance nobody meets (Schwartz, J. ACM 27 (1980)
701, for the rational ones). That holds for real numbers, not for doubles, in which exp(-1000*q) is nothing beside 1
and exp(1000*q) is infinite: so mpmath's numbers, whose exponents have no end, and a precision that grows with the
largest and the smallest number met on the way.
"""

from collections.abc import Iterator, Mapping
from fractions import Fraction
from random import Random
from typing import Any

import mpmath
import symengine as se

from qddot.codegen.convert import MATH_NAMES
from qddot.codegen.rewrite import is_number

Values = Mapping[Any, Fraction]
Forced = Mapping[Any, bool]

#: Valid points that a smooth expression is tried at, and how many are tried to find them, or to cross its kinks.
_ENOUGH, _TRIALS = 3, 48
#: How large the symbols are that have no typical value: no author means all of them to be beyond a kink.
_SCALES = (1.0, 1e-2, 1e2, 1e-4, 1e4, 1e-1)
_NUMBERS = mpmath.MPContext()
#: An argument beyond 2**_LARGEST, or a precision beyond _FINEST bits, is given up: its function cannot be told.
_LARGEST, _FINEST = 20_000, 400_000


def vanishes(expression: Any, typical: Mapping[Any, float]) -> bool:
    """Whether a SymEngine expression of exact numbers is zero wherever it is real.

    typical: values of the symbols that are constant in a run; these keep their signs and magnitudes, the others take
    both signs and many magnitudes. What can be evaluated at none of the points is not taken for zero, nor is what
    depends on a condition that held at all of the points, or at none, where it would not be zero otherwise.
    """
    moving = expression.free_symbols - typical.keys()
    points: list[Values] = []
    met: dict[Any, set[bool]] = {}
    for point in _points(sorted(expression.free_symbols, key=str), typical):
        zero = _vanishes_at(expression, point, {}, met)
        if zero is False:
            return False
        points += [point] if zero else []
        if len(points) >= _ENOUGH and all(len(found) == 2 for found in met.values()):
            break
    one_sided = {condition: found for condition, found in met.items() if len(found) == 1}
    return len(points) >= _ENOUGH and all(
        _vanishes_at(expression, points[0], {condition: not found.copy().pop()}, {}) is True
        for condition, found in one_sided.items()
        if condition.free_symbols & moving
    )


def _points(symbols: list[Any], typical: Mapping[Any, float]) -> Iterator[Values]:
    chance = Random(701)
    for trial in range(_TRIALS):
        scale = _SCALES[trial % len(_SCALES)]

        def value(symbol: Any, scale: float = scale) -> Fraction:
            usual = typical.get(symbol)
            if usual is None:
                return Fraction(chance.choice((-1, 1)) * scale * chance.uniform(0.2, 1.2))
            return Fraction((usual or 1.0) * chance.uniform(0.5, 2.0))

        yield {symbol: value(symbol) for symbol in symbols}


def _vanishes_at(expression: Any, point: Values, forced: Forced, met: dict[Any, set[bool]]) -> bool | None:
    """Whether it is zero at a point, with some conditions forced; None where it is no real number there.

    met: condition -> the truths it had so far, to be added to.
    """
    try:
        with _NUMBERS.workprec(64):
            size = _Evaluation(point, forced).size(expression)
        if 256 + 8 * size > _FINEST:
            return None
        evaluation = _Evaluation(point, forced)
        with _NUMBERS.workprec(256 + 8 * size):
            value = evaluation.real(expression)
    except (ArithmeticError, ValueError):
        return None
    for condition, truth in evaluation.truths.items():
        met.setdefault(condition, set()).add(truth)
    return bool(value == 0 or _NUMBERS.mag(value) < -64 - 4 * size)


class _Evaluation:
    """The values of an expression's nodes at a point, to the precision of `_NUMBERS`; ArithmeticError for none."""

    def __init__(self, point: Values, forced: Forced) -> None:
        self._point, self._forced = point, forced
        self._known: dict[Any, Any] = {}
        self.truths: dict[Any, bool] = {}

    def size(self, expression: Any) -> int:
        """Bits between 1 and the largest or smallest number met, and those of the numbers that are written there."""
        self.real(expression)
        magnitudes = [abs(int(_NUMBERS.mag(value))) for value in self._known.values() if value]
        return max(magnitudes, default=0) + sum(map(_length, filter(is_number, self._known)))

    def real(self, node: Any) -> Any:
        """The value of a node."""
        if node not in self._known:
            value = self._value(node)
            if not _NUMBERS.isfinite(value) or not isinstance(value, _NUMBERS.mpf):
                raise ArithmeticError(f"{node} is no real number")
            self._known[node] = value
        return self._known[node]

    def _value(self, node: Any) -> Any:  # noqa: PLR0911 - one for each kind of node
        kind = type(node).__name__
        if is_number(node):
            fraction = Fraction(str(node))
            return _NUMBERS.mpf(fraction.numerator) / fraction.denominator
        if node.is_Symbol:
            return _NUMBERS.mpf(self._point[node].numerator) / self._point[node].denominator
        if kind in ("Pi", "Exp1"):
            return +(_NUMBERS.pi if kind == "Pi" else _NUMBERS.e)
        if kind == "Piecewise":
            return self._piecewise(node.args)
        values = [self.real(part) for part in node.args]
        if isinstance(node, se.Add):
            return _NUMBERS.fsum(values)
        if isinstance(node, se.Mul):
            return _NUMBERS.fprod(values)
        if _NUMBERS.mag(values[-1] or 1) > _LARGEST:
            raise ArithmeticError(f"{node} has too large an argument")
        if isinstance(node, se.Pow):
            return _NUMBERS.exp(values[1]) if node.args[0] == se.E else _NUMBERS.power(*values)
        if isinstance(node, se.FunctionSymbol):
            return self._table(node.get_name(), values)
        return self._function(kind, values)

    def _function(self, kind: str, values: list[Any]) -> Any:
        if kind in ("Abs", "sign"):
            return _NUMBERS.fabs(*values) if kind == "Abs" else _NUMBERS.sign(*values)
        if kind not in MATH_NAMES:
            raise ArithmeticError(f"{kind} has no value here")
        return getattr(_NUMBERS, MATH_NAMES[kind])(*values)

    @staticmethod
    def _table(name: str, values: list[Any]) -> Any:
        """Any function will do for a table, or a derivative of one, which is known by its name alone."""
        phase = sum((k + 1) * ord(letter) for k, letter in enumerate(name))
        return _NUMBERS.cos(_NUMBERS.fsum((k + 1) * value for k, value in enumerate(values)) + phase)

    def _piecewise(self, arguments: tuple[Any, ...]) -> Any:
        truths = [self._holds(condition) for condition in arguments[1::2]]  # all of them, so that each is met
        for value, truth in zip(arguments[::2], truths, strict=True):
            if truth:
                return self.real(value)
        raise ArithmeticError("no branch holds here")

    def _holds(self, condition: Any) -> bool:
        kind = type(condition).__name__
        if kind in ("BooleanTrue", "BooleanFalse"):
            return kind == "BooleanTrue"
        if kind in ("And", "Or"):
            return (all if kind == "And" else any)([self._holds(part) for part in condition.args])
        if kind == "Not":
            return not self._holds(condition.args[0])
        if condition not in self.truths:
            left, right = map(self.real, condition.args)
            compared = {"StrictLessThan": left < right, "LessThan": left <= right}
            compared |= {"Equality": left == right, "Unequality": left != right}
            self.truths[condition] = self._forced.get(condition, compared[kind])
        return self.truths[condition]


def _length(number: Any) -> int:
    value = Fraction(str(number))
    return value.numerator.bit_length() + value.denominator.bit_length()
