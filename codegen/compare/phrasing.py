"""The author's expressions as phrases, to be written by any script in the author's own order."""

from fractions import Fraction
from sys import float_info

from qddot.codegen.compare.tree import Addend, Call, Lookup, Node, Number, Power, Product, Sum, Symbol, addends
from qddot.codegen.equations import phrases
from qddot.codegen.equations.phrases import Formula, Term

_FUNCTIONS = {"sign": "sgn"}
#: Denominators up to here are written as fractions, larger ones as decimals.
_LARGEST_DENOMINATOR = 12


def formula(left: Node, right: Node) -> Formula:
    """Both sides of an equation."""
    return Formula(total(left), total(right))


def total(node: Node) -> phrases.Sum:
    """An expression as a sum; a lone 0 has no terms."""
    found = tuple(term(addend) for addend in addends(node))
    return phrases.Sum(tuple(part for part in found if part.coefficient != 0))


def term(addend: Addend) -> Term:
    """An addend with its sign."""
    node, negative = addend.node, addend.negative
    while isinstance(node, Sum) and len(node.addends) == 1:  # a sign in brackets
        negative, node = negative != node.addends[0].negative, node.addends[0].node
    above, below = (node.above, node.below) if isinstance(node, Product) else ((node,), ())
    coefficient = Fraction(1)
    for part in above:
        coefficient *= part.value if isinstance(part, Number) else 1
    for part in below:
        coefficient /= part.value if isinstance(part, Number) and part.value else 1
    factors = tuple(_factor(part) for part in above if not isinstance(part, Number))
    divisors = tuple(_factor(part) for part in below if not isinstance(part, Number))
    return Term(negative, _shown(coefficient), factors, divisors)


def _factor(node: Node) -> phrases.Factor:  # noqa: PLR0911 - one for each kind of node
    match node:
        case Number(value, _):
            return phrases.Number(_shown(value))
        case Symbol("pi", _):
            return phrases.Constant("pi")
        case Symbol(name, _):
            return phrases.Name(name)
        case Power(base, Number(value, _), _):
            return phrases.Power(_factor(base), value)
        case Power(base, exponent, _):
            return phrases.Power(_factor(base), total(exponent))
        case Call("sqrt", (argument,), _):
            return phrases.Power(total(argument), Fraction(1, 2))
        case Call(function, arguments, _):
            return phrases.Call(_FUNCTIONS.get(function, function), tuple(total(each) for each in arguments))
        case Lookup(table, orders, arguments, _):
            return phrases.Lookup(table, orders, tuple(map(total, arguments)))
        case Sum() | Product():
            return total(node)


def _shown(value: Fraction) -> phrases.Value:
    """As a fraction or as a decimal; what no double holds stays a fraction, with all its digits."""
    if value.denominator <= _LARGEST_DENOMINATOR or not (float_info.min <= abs(value) <= float_info.max):
        return value
    return float(value)
