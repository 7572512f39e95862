"""Expressions as a person reads them: terms with a sign, factors in order, fractions. What every script prints."""

from dataclasses import dataclass
from fractions import Fraction

Value = Fraction | float


@dataclass(frozen=True, slots=True)
class Number:
    """A literal number, never negative."""

    value: Value


@dataclass(frozen=True, slots=True)
class Name:
    """A symbol, spelled by each script."""

    name: str


@dataclass(frozen=True, slots=True)
class Indexed:
    """A symbol of the theory with what it is indexed by: Q of q_6, M of 2 and 1."""

    letter: str
    indices: tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Constant:
    """A number with a name of its own: pi or e."""

    name: str


@dataclass(frozen=True, slots=True)
class Power:
    """A factor raised to a number, or to an expression."""

    base: "Factor"
    exponent: "Fraction | Sum"


@dataclass(frozen=True, slots=True)
class Call:
    """A function of arguments; abs is printed by bars."""

    function: str
    arguments: tuple["Sum", ...]


@dataclass(frozen=True, slots=True)
class Lookup:
    """The value of a table, or its derivative of these orders by its arguments."""

    table: str
    orders: tuple[int, ...]
    arguments: tuple["Sum", ...]


@dataclass(frozen=True, slots=True)
class Relation:
    """A condition: comparisons chained by `and` or `or`."""

    left: "Sum | Relation"
    sign: str
    right: "Sum | Relation"


@dataclass(frozen=True, slots=True)
class Cases:
    """Values with the condition of each; None is otherwise."""

    branches: tuple[tuple["Sum", Relation | None], ...]


@dataclass(frozen=True, slots=True)
class Term:
    """A signed product: coefficient (positive), factors above and below the fraction line."""

    negative: bool
    coefficient: Value
    above: tuple["Factor", ...] = ()
    below: tuple["Factor", ...] = ()

    def opposite(self) -> "Term":
        """The same with the other sign."""
        return Term(not self.negative, self.coefficient, self.above, self.below)


@dataclass(frozen=True, slots=True)
class Summation:
    """Terms that are alike: one for each number from first to last that its index takes."""

    index: str
    first: int
    last: int
    term: Term


@dataclass(frozen=True, slots=True)
class Sum:
    """Terms in the order of reading; none is zero."""

    terms: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Formula:
    """Two sides of an equation; lines may break between their terms."""

    left: Sum
    right: Sum


Factor = Number | Name | Indexed | Constant | Power | Call | Lookup | Cases | Sum | Summation


def term(factor: Factor) -> Term:
    """A factor as a term of its own."""
    return Term(False, Fraction(1), (factor,))


def alone(factor: Factor) -> Sum:
    """A factor as a sum of its own."""
    return Sum((term(factor),))
