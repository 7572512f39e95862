"""From phrases to boxes of text: what all scripts share; a script says how the smallest things are written."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

from qddot.codegen.equations.layout import Box, beside, joined, times
from qddot.codegen.equations.phrases import (
    Call,
    Cases,
    Constant,
    Factor,
    Formula,
    Indexed,
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
from qddot.codegen.equations.script import Script

_POWERED = {"sin", "cos", "tan", "sinh", "cosh", "tanh"}
_HALF = Fraction(1, 2)


class Typesetter:
    """Writes sums, terms and factors in one script; `flat`: with a slash for fractions, as in exponents."""

    def __init__(self, script: Script, *, flat: bool = False) -> None:
        self.script = script
        self._flat = flat or script.is_flat

    def terms(self, total: Sum, *, inner: bool = False) -> list[Box]:
        """One box per term, its sign in front."""
        if not total.terms:
            return [self.script.number(Fraction(0), inner)]
        boxes = []
        for k, term in enumerate(total.terms):
            body = self._term(term, inner)
            if k:
                body = beside(self.script.minus if term.negative else self.script.plus, body)
            elif term.negative:
                body = beside(self.script.negative, body)
            boxes.append(body)
        return boxes

    def formula(self, formula: Formula) -> list[Box]:
        """Both sides, the relation with the first term of the right one; a lone zero is not worth a line."""
        left, right = self.terms(formula.left), self.terms(formula.right)
        right[0] = beside(self.script.equals, right[0])
        if not formula.right.terms or len(left) == 1:
            right[0] = beside(left.pop(), right[0])
        return left + right

    def factor(self, factor: Factor, *, inner: bool = False) -> Box:
        """A factor, in brackets where it is a sum."""
        match factor:
            case Name(name):
                box = self.script.name(name)
            case Indexed(letter, indices):
                box = self.script.indexed(letter, indices)
            case Number(value):
                box = self.script.number(value, inner)
            case Constant(name):
                box = self.script.constant(name)
            case Sum():
                box = self._bracket(self._inside((factor,)))
            case Summation(index, first, last, term):
                box = beside(self.script.summation(index, first, last), self._term(term, inner))
            case Power(base, exponent):
                box = self._power(base, exponent)
            case Call("abs", arguments):
                box = self._between(self._inside(arguments), self.script.bars)
            case Call(function, arguments):
                box = beside(self.script.function(function), self._bracket(self._inside(arguments)))
            case Lookup(table, orders, arguments):
                box = beside(self._looked_up(table, orders), self._bracket(self._inside(arguments)))
            case Cases(branches):
                box = self.script.cases([(self._inside((value,)), self._condition(when)) for value, when in branches])
        return box

    def _looked_up(self, table: str, orders: Sequence[int]) -> Box:
        """A table's name: with primes for derivatives, or, of two arguments, behind the signs of partial ones."""
        name = self.script.name(table)
        if len(orders) == 1:
            return beside(name, self.script.primes(*orders))
        for argument, order in reversed(list(enumerate(orders, 1))):
            sign, number = self.script.partial(argument), self.script.number(Fraction(order), True)
            name = beside(self.script.raised(sign, number) if order > 1 else sign, name) if order else name
        return name

    def _term(self, term: Term, inner: bool) -> Box:
        if not term.below:
            return self._product(term.coefficient, term.above, inner)
        bulky = [factor for factor in term.above if isinstance(factor, Sum | Call | Lookup | Cases)]
        outside = [] if self._flat or len(bulky) == len(term.above) else bulky
        above = [factor for factor in term.above if factor not in outside]
        numerator, denominator = _split(term.coefficient)
        fraction = self._fraction(numerator, above, denominator, term.below)
        return self._row([fraction, *(self.factor(f, inner=inner) for f in outside)])

    def _fraction(self, numerator: Value, above: Sequence[Factor], denominator: Value, below: Sequence[Factor]) -> Box:
        top, bottom = self._product(numerator, above, True), self._product(denominator, below, True)
        single = denominator == 1 and len(below) == 1
        line = beside(beside(top, self.script.slash), bottom if single else self._bracket(bottom))
        if self._flat:
            return line
        drawn = self.script.fraction(self._bare(numerator, above), self._bare(denominator, below))
        return replace(drawn, last_cut=lambda: (line,))

    def _bare(self, coefficient: Value, factors: Sequence[Factor]) -> Box:
        """A product without the brackets that a fraction's line makes needless."""
        if coefficient == 1 and len(factors) == 1 and isinstance(factors[0], Sum):
            return self._inside((factors[0],))
        return self._product(coefficient, factors, True)

    def _product(self, coefficient: Value, factors: Iterable[Factor], inner: bool) -> Box:
        boxes = [self.factor(factor, inner=inner) for factor in factors]
        if coefficient == 1 and boxes:
            return self._row(boxes)
        number = self.script.number(coefficient, inner)
        if boxes and boxes[0].text[:1].isdigit():
            boxes[0] = beside(self.script.times, boxes[0])
        return self._row([number, *boxes])

    def _row(self, boxes: Sequence[Box]) -> Box:
        whole = boxes[0]
        for left, right in pairwise(boxes):
            whole = times(whole, right, self.script.between(left, right), self.script.times)
        return whole

    def _power(self, base: Factor, exponent: Fraction | Sum) -> Box:
        if exponent == _HALF:
            return self._root(base)
        small = self._exponent(exponent)
        if isinstance(base, Call) and base.function in _POWERED and isinstance(exponent, Fraction):
            head = self.script.raised(self.script.function(base.function), small)
            return beside(head, self._bracket(self._inside(base.arguments)))
        box = self.factor(base, inner=True)
        if isinstance(base, Cases | Power | Lookup) or (isinstance(base, Call) and base.function != "abs"):
            box = self._bracket(box)
        raised = self.script.raised(Box("", 0.0), small)
        return beside(box, raised) if box.cut else self.script.raised(box, small)

    def _root(self, base: Factor) -> Box:
        inside = self._inside((base,)) if isinstance(base, Sum) else self.factor(base, inner=True)
        small = self.script.raised(Box("", 0.0), self._exponent(_HALF))
        root = self.script.root(inside)
        return root if root.cut else replace(root, last_cut=lambda: (beside(self._bracket(inside), small),))

    def _exponent(self, exponent: Fraction | Sum) -> Box:
        if isinstance(exponent, Sum):
            return Typesetter(self.script, flat=True)._inside((exponent,))
        if exponent.denominator == 1:
            return self.script.number(exponent, True)
        numerator, denominator = (self.script.number(Fraction(part), True) for part in exponent.as_integer_ratio())
        return beside(beside(numerator, self.script.slash), denominator)

    def _inside(self, sums: Iterable[Sum]) -> Box:
        """What stands in brackets: one sum, or arguments between commas."""
        return joined([joined(self.terms(total, inner=True)) for total in sums], self.script.comma, after=True)

    def _bracket(self, box: Box) -> Box:
        return self._between(box, self.script.brackets)

    def _between(self, box: Box, pair: Callable[[int], tuple[Box, Box]]) -> Box:
        left, right = pair(box.height)
        return beside(beside(left, box), right)

    def _condition(self, condition: Relation | None) -> Box | None:
        return None if condition is None else self._relation(condition)

    def _relation(self, relation: Relation) -> Box:
        left, right = self._side(relation.left, relation.sign), self._side(relation.right, relation.sign)
        return beside(beside(left, self.script.relation(relation.sign)), right)

    def _side(self, side: Sum | Relation, sign: str) -> Box:
        if isinstance(side, Sum):
            return self._inside((side,))
        box = self._relation(side)
        return self._bracket(box) if sign == "and" and side.sign == "or" else box


def _split(value: Value) -> tuple[Value, Value]:
    if isinstance(value, Fraction):
        return Fraction(value.numerator), Fraction(value.denominator)
    return value, Fraction(1)
