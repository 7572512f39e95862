"""Walking and rebuilding SymEngine expressions."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from math import gcd, lcm
from typing import Any

import symengine as se
from symengine.lib.symengine_wrapper import Boolean

from qddot.codegen.nodes import one, operands, remembered
from qddot.codegen.symbols import named

Change = Callable[[Any], Any]

#: What builds a condition again; SymEngine's own conditions do not say.
_CONDITIONS = {
    **{"StrictLessThan": se.Lt, "LessThan": se.Le, "Equality": se.Eq, "Unequality": se.Ne},
    **{"And": se.And, "Or": se.Or, "Not": se.Not},
}

#: Numbers to compare with: SymEngine takes ten times as long to compare with one of Python's.
ZERO, ONE, MINUS_ONE = map(se.Integer, (0, 1, -1))
_ONE, _MINUS_ONE = type(ONE), type(MINUS_ONE)

_INEQUALITIES = ("StrictLessThan", "LessThan")


def rewrite(expression: Any, change: Change, memo: dict[Any, Any]) -> Any:
    """Rebuild an expression from the leaves up, `change` applied to each node once; memo is shared among calls."""
    known = memo.get(expression)
    if known is not None:
        return known
    before = operands(expression)
    if not before:
        return expression
    after = [rewrite(part, change, memo) for part in before]
    same = before == tuple(after)
    found = memo[expression] = change(expression if same else rebuild(expression, after))
    return found


def rebuild(expression: Any, arguments: list[Any]) -> Any:
    """The same node with other arguments."""
    if isinstance(expression, se.Piecewise):
        return se.Piecewise(*zip(arguments[::2], arguments[1::2], strict=True))
    condition = _CONDITIONS.get(type(expression).__name__)
    return condition(*arguments) if condition else expression.func(*arguments)


def replaced(expression: Any, found: Mapping[Any, Any], memo: dict[Any, Any] | None = None) -> Any:
    """An expression with the nodes in `found` replaced, from the outermost down; in what takes their place, too.

    memo: what became of nodes, shared among calls with the same `found`.
    """
    before = operands(expression)
    if expression in found:
        return replaced(found[expression], found, memo)
    if not before:
        return expression
    memo = {} if memo is None else memo
    if expression not in memo:
        after = [replaced(part, found, memo) for part in before]
        same = all(old is new for old, new in zip(before, after, strict=True))
        memo[expression] = expression if same else rebuild(expression, after)
    return memo[expression]


def inequalities(expression: Any) -> Iterator[Any]:
    """The inequalities in an expression, outermost first."""
    if type(expression).__name__ in _INEQUALITIES:
        yield expression
    else:
        for part in operands(expression):
            yield from inequalities(part)


def is_number(expression: Any) -> bool:
    """Whether it is a literal number, not pi or E."""
    return isinstance(expression, se.Number)


@remembered
def is_call(expression: Any) -> bool:
    """Whether it is a function that takes longer than arithmetic: no choice between values, no product, no root."""
    if isinstance(expression, se.Pow):
        return not isinstance(2 * operands(expression)[1], se.Integer)
    return isinstance(expression, se.Function) and not isinstance(expression, se.Piecewise)


@remembered
def holds_call(expression: Any) -> bool:
    """Whether such a function stands in an expression."""
    return is_call(expression) or any(map(holds_call, operands(expression)))


def is_one(expression: Any) -> bool:
    """Whether it is the number 1, of which SymEngine has a class: to compare takes four times as long."""
    return type(expression) is _ONE


def is_unit(expression: Any) -> bool:
    """Whether it is 1 or -1."""
    return type(expression) in (_ONE, _MINUS_ONE)


def is_condition(expression: Any) -> bool:
    """Whether it is true or false: no number, so never a temporary."""
    return isinstance(expression, Boolean)


@remembered
def is_signed_symbol(expression: Any) -> bool:
    """Whether it is a symbol or number, or the opposite of one, which costs nothing to write out."""
    parts = operands(expression)
    if not parts:
        return True
    return isinstance(expression, se.Mul) and len(parts) == 2 and type(parts[0]) is _MINUS_ONE and parts[1].is_Symbol


def opposite(total: Any) -> Any:
    """A sum with all signs changed."""
    return se.Add(*(-part for part in operands(total)))


def product(term: Any) -> Any:
    """A term as an expression."""
    return se.Mul(*term) if isinstance(term, tuple) else term


def is_square(expression: Any) -> bool:
    """Whether it is an integer power that is written as a product, its base standing there more than once."""
    if not isinstance(expression, se.Pow):
        return False
    power = operands(expression)[1]
    return isinstance(power, se.Integer) and abs(int(power)) > 1


@remembered
def split_number(term: Any) -> tuple[Any, Any]:
    """A term as (number, rest): -2*x*y -> (-2, x*y)."""
    if isinstance(term, se.Mul):
        number, *others = operands(term)
        if is_number(number):
            return number, one(se.Mul(*others)) if len(others) > 1 else others[0]
    return (term, ONE) if is_number(term) else (ONE, term)


def leading_number(term: Any) -> Any:
    """The number in front of a term: -2 of -2*x*y."""
    first = operands(term)[0] if isinstance(term, se.Mul) else term
    return first if is_number(first) else ONE


def fraction(number: Any) -> Fraction:
    """A literal number, a floating-point one as the decimal that it is written as; ValueError where it is not real."""
    return Fraction(repr(float(number)) if isinstance(number, se.RealDouble) else str(number))


def content(numbers: Sequence[Any]) -> Any:
    """The common divisor of numbers, negative where all of them are; 1 where one is no fraction."""
    if all(isinstance(number, se.Integer) for number in numbers):
        divisor, denominator = gcd(*map(int, numbers)), 1
    elif all(isinstance(number, se.Integer | se.Rational) for number in numbers):
        values = list(map(fraction, numbers))
        divisor = gcd(*(value.numerator for value in values))
        denominator = lcm(*(value.denominator for value in values))
    else:
        return se.Integer(1)
    return se.Rational(-divisor if all(number.is_negative for number in numbers) else divisor, denominator)


@remembered
def factors(term: Any) -> tuple[Any, ...]:
    """The factors of a term that are no numbers."""
    if isinstance(term, se.Mul):
        parts = operands(term)  # a number is the first of them
        return parts[1:] if is_number(parts[0]) else parts
    return () if is_number(term) else (one(term),)  # that of a sum, which `without` takes out


def without(term: Any, factor: Any) -> Any:
    """A term without one of its `factors`; dividing would leave x**(y - 1 - (y - 1)), which SymEngine keeps."""
    if term is factor:
        return ONE
    rest = [part for part in operands(term) if part is not factor]
    return se.Mul(*rest) if len(rest) > 1 else rest[0]


@remembered
def operations(expression: Any) -> int:
    """Additions, multiplications, divisions, powers and function calls, all counted as one; a sign is free."""
    return own_operations(expression) + sum(map(operations, operands(expression)))


def own_operations(node: Any) -> int:
    """Those of a node on what it is made of."""
    arguments = operands(node)
    if isinstance(node, se.Add):
        return len(arguments) - 1
    if isinstance(node, se.Mul):
        return len(arguments) - 1 - (type(arguments[0]) is _MINUS_ONE)
    return 1 if arguments else 0


class Names:
    """Gives names that nothing else has."""

    def __init__(self, taken: Iterable[Any]) -> None:
        self._taken = {name if isinstance(name, str) else name.name for name in taken}
        self._count: dict[str, int] = {}

    def fresh(self, wish: str) -> Any:
        """A symbol of the wished name, or of that name with a number behind it; a wish that ends in _ is numbered."""
        name = wish
        while name in self._taken or name.endswith("_"):
            self._count[wish] = self._count.get(wish, 0 if wish.endswith("_") else 1) + 1
            name = f"{wish.removesuffix('_')}_{self._count[wish]}"
        self._taken.add(name)
        return named(name)

    def __contains__(self, symbol: Any) -> bool:
        return str(symbol) in self._taken

    def join(self, others: "Names") -> None:
        """Have the names that others have given, too."""
        self._taken |= others._taken

    def copy(self, others: Iterable[Any] = ()) -> "Names":
        """Names for a room of its own, that has these others: what is given there does not count here."""
        return Names((*self._taken, *others))
