"""From SymEngine expressions to phrases: terms with signs, factors in order, fractions."""

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import symengine as se

from qddot.codegen.calculus import terms
from qddot.codegen.convert import arguments, looked_up
from qddot.codegen.equations.order import Order
from qddot.codegen.equations.phrases import (
    Call,
    Cases,
    Constant,
    Factor,
    Lookup,
    Name,
    Number,
    Power,
    Relation,
    Sum,
    Summation,
    Term,
    Value,
)
from qddot.codegen.equations.repeating import Repeating, Series
from qddot.codegen.rewrite import ONE, ZERO, Change, content, factors, is_number, leading_number, split_number

_EVEN, _ODD = {"cos", "cosh"}, {"sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "erf"}
_COMPARISONS = {
    **{"StrictLessThan": ("<", ">"), "LessThan": ("<=", ">=")},
    **{"Equality": ("=", "="), "Unequality": ("!=", "!=")},
}
_ONE = Fraction(1)


class Reader:
    """Reads expressions. With `turn`, -k*(a - b) is read as k*(b - a): for what was derived, not for the author's.

    conditions: by the symbols of sides, or by what is written with a mode, which stand for them.
    """

    def __init__(
        self,
        order: Order,
        *,
        turn: bool,
        conditions: Mapping[Any, Any] = MappingProxyType({}),
        repeating: Repeating | None = None,
    ) -> None:
        self._order = order
        self._repeating = repeating
        self._turn = turn
        self._conditions = conditions
        self._names: dict[Any, Name] = {}

    def sum(self, expression: Any, *, positive_first: bool = True, legible: Change | None = None) -> Sum:
        """Read an expression; its terms in order of their parameters, then of what moves.

        legible: how what repeats in no way is written before.
        """
        parts, series = self._repeating.terms(_parts(expression)) if self._repeating else (_parts(expression), ())
        if legible is not None:
            parts = _parts(legible(se.Add(*parts)))
        found = [*((part, None) for part in parts), *((each.begins, each) for each in series)]
        ordered = sorted(found, key=lambda pair: self._order.term(pair[0]))
        read = [self.term(part) if each is None else self._series(each) for part, each in ordered]
        if positive_first:
            read.sort(key=lambda part: part.negative)
        return Sum(tuple(read))

    def _series(self, series: Series) -> Term:
        """A sum over an index; within it sums are written out, as they would have the same index."""
        alone = Reader(self._order, turn=self._turn, conditions=self._conditions)
        read, span = alone.term(series.term), series.range
        inside = Term(False, read.coefficient, read.above, read.below)
        return Term(read.negative, _ONE, (Summation(span.index, span.first, span.last, inside),))

    def term(self, expression: Any) -> Term:
        """Read one term of a sum."""
        number, rest = split_number(expression)
        value = _value(number)
        above: list[tuple[Any, Factor]] = []
        below: list[tuple[Any, Factor]] = []
        for part in factors(rest):
            if part.is_Symbol:
                above.append(((self._order.symbol(part), ""), self._name(part)))
                continue
            place = (self._order.factor(part), str(part))
            base, exponent = part.args if isinstance(part, se.Pow) else (part, se.Integer(1))
            if is_number(exponent):
                power = _value(exponent)
                factor, scale = self._scaled(base, power)
                value = value if scale == 1 else value * scale
                (above if power > 0 else below).append((place, _power(factor, power if power > 0 else -power)))
            else:
                above.append((place, Power(self._factor(base), self.sum(exponent))))
        read = Term(value < 0, -value if value < 0 else value, _sorted(above), _sorted(below))
        return _turned(read) if self._turn else read

    def _scaled(self, base: Any, power: Value) -> tuple[Factor, Value]:
        """A factor whose power is taken, and the number that comes out: (2*a + 2*b)**2 = 4*(a + b)**2."""
        if not isinstance(power, Fraction) or power.denominator != 1:
            return self._factor(base), _ONE
        if isinstance(base, se.Add):
            number = content([leading_number(part) for part in base.args])
            inner = base if number == ONE else se.Add(*(part / number for part in base.args))
            return self.sum(inner), _value(number) ** int(power)
        name = type(base).__name__
        if name in _EVEN | _ODD and self._backwards(base.args[0]):
            sign = -1 if name in _ODD and power.numerator % 2 else 1
            return Call(name, (self.sum(_opposite(base.args[0])),)), Fraction(sign)
        return self._factor(base), _ONE

    def _factor(self, base: Any) -> Factor:
        if base.is_Symbol:
            return self._name(base)
        if not base.args:
            return _number(base)
        if isinstance(base, se.Add | se.Mul | se.Pow):
            return self.sum(base)
        if isinstance(base, se.Piecewise):
            return self._cases(base)
        if isinstance(base, se.FunctionSymbol):
            return Lookup(*looked_up(base), tuple(map(self.sum, arguments(base))))
        return Call(type(base).__name__, tuple(self.sum(argument) for argument in base.args))

    def _name(self, symbol: Any) -> Name:
        return self._names.get(symbol) or self._names.setdefault(symbol, Name(str(symbol)))

    def _backwards(self, argument: Any) -> bool:
        """Whether an argument begins with a minus when read in order: theta_2 - theta_1 does."""
        first = min(argument.args if isinstance(argument, se.Add) else (argument,), key=self._order.term)
        return _value(split_number(first)[0]) < 0

    def _cases(self, piecewise: Any) -> Factor:
        """Cases; those that are |x| or the sign of x as functions."""
        values, conditions = piecewise.args[::2], tuple(map(self._stated, piecewise.args[1::2]))
        x = _not_negative(conditions[0])
        if x is not None and values[0] == x and len(values) == 2 and se.expand(values[0] + values[1]) == 0:
            return Call("abs", (self.sum(x),))
        if x is not None and (values == (1, -1) or (values == (1, -1, 0) and _negative(conditions[1]) == x)):
            return Call("sgn", (self.sum(x),))
        branches = zip(values, conditions, strict=True)
        return Cases(tuple((self.sum(value), self._condition(condition)) for value, condition in branches))

    def _stated(self, condition: Any) -> Any:
        """The condition that one of a side, or with a mode, stands for."""
        if condition in self._conditions:
            return self._conditions[condition]
        compares = type(condition).__name__ in _COMPARISONS
        left, right = condition.args if compares else (None, None)
        if right in self._conditions:  # 1/2 < side
            return self._conditions[right]
        return _contrary(self._conditions[left]) if left in self._conditions else condition

    def _condition(self, condition: Any) -> Relation | None:
        return None if type(condition).__name__ == "BooleanTrue" else self._relation(condition)

    def _relation(self, condition: Any) -> Relation:
        kind = type(condition).__name__
        if kind in ("And", "Or"):
            read, *others = map(self._relation, sorted(map(self._stated, condition.args), key=str))
            for other in others:
                read = Relation(read, kind.lower(), other)
            return read
        condition = self._stated(condition)
        (left, right), (sign, mirrored) = condition.args, _COMPARISONS[type(condition).__name__]
        if is_number(left):
            return Relation(self.sum(right), mirrored, self.sum(left))
        return Relation(self.sum(left), sign, self.sum(right))


def _parts(total: Any) -> Sequence[Any]:
    """The terms of a sum, none of zero."""
    return () if total == ZERO else terms(total)


def _contrary(condition: Any) -> Any:
    below, above = condition.args
    return se.Le(above, below) if type(condition).__name__ == "StrictLessThan" else se.Lt(above, below)


def _turned(read: Term) -> Term:
    """-k*(a - b) as k*(b - a)."""
    if read.negative:
        for k, factor in enumerate(read.above):
            if isinstance(factor, Sum) and factor.terms[-1].negative:
                flipped = sorted((part.opposite() for part in factor.terms), key=lambda part: part.negative)
                above = (*read.above[:k], Sum(tuple(flipped)), *read.above[k + 1 :])
                return Term(False, read.coefficient, above, read.below)
    return read


def _opposite(expression: Any) -> Any:
    return se.Add(*(-part for part in expression.args)) if isinstance(expression, se.Add) else -expression


def _power(factor: Factor, power: Value) -> Factor:
    if power == 1:
        return factor
    return Power(factor, power if isinstance(power, Fraction) else Sum((Term(False, power),)))


def _number(expression: Any) -> Factor:
    if is_number(expression):
        value = _value(expression)
        return Number(value) if value >= 0 else Sum((Term(True, -value),))
    return Constant({"Pi": "pi", "Exp1": "e"}[type(expression).__name__])


def _value(number: Any) -> Value:
    return _fraction(str(number)) if isinstance(number, se.Rational) else float(number)


_fraction = lru_cache(1000)(Fraction)


def _not_negative(condition: Any) -> Any:
    """The x of a condition 0 <= x or 0 < x, also where it is written -x <= 0, else None."""
    below, above = condition.args if type(condition).__name__ in ("LessThan", "StrictLessThan") else (None, None)
    if below == 0:
        return above
    return _opposite(below) if above == 0 and isinstance(below, se.Add) else None


def _negative(condition: Any) -> Any:
    """The x of a condition x < 0 that is written so, or 0 < -x; else None."""
    below, above = condition.args if type(condition).__name__ == "StrictLessThan" else (None, None)
    return below if above == 0 else _opposite(above) if below == 0 else None


def _sorted(found: Iterable[tuple[Any, Factor]]) -> tuple[Factor, ...]:
    return tuple(factor for _, factor in sorted(found, key=lambda pair: pair[0]))
