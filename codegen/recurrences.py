"""Expressions as nodes of a table from which the Taylor coefficients of a solution follow, order by order.

Each node is a power series in time, named, and has a rule that gives its coefficient k from lower ones of all nodes and
the k-th ones of its operands (see docs/taylor.md). A row is a text, `name rule operands`:

    linear      factor node ...               sum of factor * node
    product     a b                           a * b
    quotient    a b                           a / b
    power       a factor                      a ** factor
    sin, ...    x factor slope ...            a function of x ..., its derivative by x being factor * slope
    integral    factor rate rule operands     its rate of change is factor * rate; it starts as the rule says
    lagging     m a                           m * a without m_0 a_k, a being an acceleration
    rate        g v a                         d(g v)/dt, with a = dv/dt; g is an integral
    solved      right factor node a ...       row of M a = right: which acceleration stands beside which entry of M,
                                              and which multiplier beside which entry of G'
    held        drift residual factor node a ...  row of G a = drift; it gives the multiplier
    side        d                             1 where d is below zero, 0 elsewhere, during a step
    where       side a b                      a where side is 1, b where it is 0

A factor is a product of numbers and constants, `-2*k_1`; the node `1` is the constant one.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import symengine as se

from qddot.codegen.convert import looked_up
from qddot.codegen.nodes import operands, symbols_of
from qddot.codegen.printer import Printer, double
from qddot.codegen.rewrite import Names, is_number
from qddot.codegen.symbols import named

#: A factor without its number: names of constants in order. A linear form: (node, names) -> number.
Form = dict[tuple[str, tuple[str, ...]], float]
ONE = "1"
#: Whole numbers below are written without a point.
_WHOLE = 1e15


class NoRecurrenceError(Exception):
    """A function whose series does not follow from what it is made of; says which."""


class Recurrences:
    """The rows of a table, as they are asked for.

    sums: of each linear node the form; slopes: of each sine or its kin that is an integral the rate, a product of
    another of these and a speed. constants: symbols that do not change during a run. rates: base symbol -> the symbol
    of its rate of change, 1 for time; where an argument is linear in these, a sine is the integral of its rate.
    """

    def __init__(self, constants: Iterable[Any], rates: Mapping[Any, Any], names: Names) -> None:
        self.rows: dict[str, tuple[str, ...]] = {}
        self._constants = frozenset(constants)
        self._rates = dict(rates)
        self._names = names
        self._known: dict[tuple[str, ...], str] = {}
        self._forms: dict[Any, Form] = {}
        self.sums: dict[str, Form] = {}
        self.slopes: dict[str, Form] = {}
        self._text = Printer({})  # what it writes is the same in every process: SymEngine's own order is not

    def fresh(self, wish: str) -> str:
        """A name for a node that nothing else has."""
        return str(self._names.fresh(wish))

    def assign(self, symbol: Any, expression: Any) -> None:
        """Make a temporary a node of its name; one that is a number times another node stands for that."""
        form = self.form(expression, str(symbol))
        if len(form) > 1:
            form = alone(self.linear(form, str(symbol)))
        self._forms[symbol] = form

    def row(self, rule: str, *operands: str, name: str = "", wish: str = "node_") -> str:
        """The node of this rule, its row added where there is none."""
        key = (rule, *operands)
        if key not in self._known:
            self._known[key] = name if name and name not in self.rows else self.fresh(wish)
            self.rows[self._known[key]] = key
        return self._known[key]

    def node(self, expression: Any, name: str = "") -> str:
        """The node with this value."""
        return self.linear(self.form(expression, name), name)

    def linear(self, form: Form, name: str = "") -> str:
        """The node of a linear form."""
        if len(form) == 1:
            (((node, names), number),) = form.items()
            if not names and number == 1.0:
                return node
        terms = [part for (node, names), number in form.items() for part in (factor_text(number, names), node)]
        found = self.row("linear", *(terms or ("0", ONE)), name=name)
        self.sums[found] = form
        return found

    def form(self, expression: Any, name: str = "") -> Form:
        """An expression as a linear form in nodes; a node made for the whole of it may have the name."""
        if expression in self._forms:
            return self._forms[expression]
        if is_number(expression) or not symbols_of(expression):
            form: Form = added([{(ONE, ()): double(expression)}])
        elif expression.is_Symbol:
            constant = expression in self._constants
            form = {(ONE, (str(expression),)) if constant else (str(expression), ()): 1.0}
        elif isinstance(expression, se.Add):
            form = added(self.form(term) for term in sorted(operands(expression), key=self._text))
        elif isinstance(expression, se.Mul):
            form = self._product(sorted(operands(expression), key=self._text), name)
        elif isinstance(expression, se.Pow):
            form = self._power(operands(expression)[0], operands(expression)[1], name)
        else:
            form = alone(self._function(expression, name))
        self._forms[expression] = form
        return form

    def multiply(self, left: Form, right: Form, name: str = "") -> Form:
        """The product of two linear forms: one node, unless one of them is constant."""
        for one, other in ((left, right), (right, left)):
            if all(node == ONE for node, _ in one):
                return added(scaled(other, number, names) for (_, names), number in one.items())
        (a, number, names), (b, other_number, other_names) = self.single(left), self.single(right)
        factor = tuple(sorted(names + other_names)), number * other_number
        product = self.row("product", *sorted((a, b)), name=name if factor == ((), 1.0) else "")
        return {(product, factor[0]): factor[1]}

    def single(self, form: Form) -> tuple[str, float, tuple[str, ...]]:
        """A form as one node with a factor."""
        if len(form) == 1:
            (((node, names), number),) = form.items()
            return node, number, names
        return self.linear(form), 1.0, ()

    def _product(self, parts: Iterable[Any], name: str) -> Form:
        """Constants and numbers into the factor, the rest as products of two; divisions last."""
        above: list[Form] = []
        below: list[Form] = []
        for part in parts:
            is_division = (
                isinstance(part, se.Pow) and isinstance(operands(part)[1], se.Integer) and int(operands(part)[1]) < 0
            )
            (below if is_division else above).append(self.form(1 / part if is_division else part))
        form = alone(ONE)
        for each in sorted(above, key=len):
            form = self.multiply(form, each, "" if below else name)
        return self._divided(form, below, name) if below else form

    def _divided(self, form: Form, below: list[Form], name: str) -> Form:
        divisor = alone(ONE)
        for each in below:
            divisor = self.multiply(divisor, each)
        numerator, number, names = self.single(form)
        name = "" if names or number != 1.0 else name
        return {(self.row("quotient", numerator, self.linear(divisor), name=name), names): number}

    def _power(self, base: Any, exponent: Any, name: str) -> Form:
        if base == se.E:
            return alone(self._exponential(exponent, name))
        if isinstance(exponent, se.Integer):
            whole = abs(int(exponent))
            if int(exponent) < 0:
                return self._divided(alone(ONE), [self.form(base**whole)], name)
            half = self.form(base ** (whole // 2)) if whole > 1 else alone(ONE)
            squared = self.multiply(half, half, name)
            return self.multiply(squared, self.form(base), name) if whole % 2 else squared
        power = self.form(exponent)
        if len(power) == 1 and next(iter(power))[0] == ONE:
            (((_, names), number),) = power.items()
            return alone(self.row("power", self.node(base), factor_text(number, names), name=name))
        return alone(self._exponential(exponent * se.log(base), name))

    def _exponential(self, exponent: Any, name: str) -> str:
        x = self.node(exponent)
        found = name if name and name not in self.rows else self.fresh(f"exp_{x}")
        return self._known_function("exp", x, found, ("1", found))

    def _known_function(self, rule: str, x: str, name: str, slope: tuple[str, str]) -> str:
        """The node of a function of x; where it is known by another name, that one."""
        key = (rule, x)
        if key not in self._known:
            self._known[key] = name
            self.rows[name] = (rule, x, *slope)
        return self._known[key]

    def _function(self, expression: Any, name: str) -> str:
        kind = type(expression).__name__
        if isinstance(expression, se.FunctionSymbol):
            raise NoRecurrenceError(f"the table {looked_up(expression)[0]}")
        if kind == "Piecewise":
            return self._piecewise(operands(expression), name)
        if kind == "atan2":
            return self._angle(operands(expression)[0], operands(expression)[1], name)
        if kind not in _SLOPES and kind not in _PAIRS:
            raise NoRecurrenceError(kind)
        x = self.node(operands(expression)[0])
        if (kind, x) in self._known:
            return self._known[kind, x]
        if kind in _PAIRS:
            return self._pair(kind, x, operands(expression)[0], name)
        found = name if name and name not in self.rows else self.fresh(f"{kind}_{x}")
        self._known[kind, x] = found
        self.rows[found] = (kind, x)  # its place is before what its slope is made of
        slope = _SLOPES[kind](self._symbol(x), self._symbol(found))
        self.rows[found] = (kind, x, *self.factor_and_node(self.form(slope)))
        return found

    def _symbol(self, node: str) -> Any:
        """A symbol that means a node."""
        symbol = named(node)
        self._forms[symbol] = alone(node)
        return symbol

    def factor_and_node(self, form: Form) -> tuple[str, str]:
        """A form as the text of a factor, and a node."""
        node, number, names = self.single(form)
        return factor_text(number, names), node

    def _pair(self, kind: str, x: str, argument: Any, name: str) -> str:
        """Sine and cosine, or their hyperbolic kin, each the other's slope; integrals where the rate of x is known."""
        (first, _), (second, sign) = pair = _PAIRS[kind]
        names = {each: name if each == kind and name and name not in self.rows else "" for each, _ in pair}
        names = {each: found or self.fresh(f"{each}_{x}") for each, found in names.items()}
        slopes = ((first, second, "1"), (second, first, sign))
        for each, other, factor in slopes:
            self._known[each, x] = names[each]
            self.rows[names[each]] = (each, x, factor, names[other])
        rate = self._rate(self.form(argument))
        if rate is not None:
            for each, other, factor in slopes:
                slope = scaled(self.multiply(rate, alone(names[other])), float(factor), ())
                node, number, constants = self.single(slope)
                self.rows[names[each]] = ("integral", factor_text(number, constants), node, each, x)
                self.slopes[names[each]] = slope
        return self._known[kind, x]

    def _rate(self, argument: Form) -> Form | None:
        """The rate of change of an argument that is linear in what has a rate; None where it is not."""
        parts: list[Form] = []
        for (node, names), number in argument.items():
            if node == ONE:
                continue
            symbol = named(node)
            known = self.form(self._rates[symbol]) if symbol in self._rates else None
            rate = self._rate(self.sums[node]) if node in self.sums else known
            if rate is None:
                return None
            parts.append(scaled(rate, number, names))
        return added(parts)

    def rate_of_product(self, node: str, g: str, v: str, a: str) -> str:
        """The rate of the product g v, with a = dv/dt; the product becomes the integral of it. g: an integral."""
        rate = self.row("rate", g, v, a, wish=f"rate_{node}")
        self.rows[node] = ("integral", "1", rate, "product", *sorted((g, v)))
        return rate

    def needed(self, names: Iterable[str]) -> dict[str, tuple[str, ...]]:
        """The rows that the nodes of these names are made of."""
        found: set[str] = set()
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name in self.rows and name not in found:
                found.add(name)
                waiting += self.rows[name][1:]
        return {name: row for name, row in self.rows.items() if name in found}

    def _angle(self, y: Any, x: Any, name: str) -> str:
        """Give atan2(y, x), of slopes x/r^2 and -y/r^2."""
        parts = [self.factor_and_node(self.form(part / (x**2 + y**2))) for part in (x, -y)]
        operands = [self.node(y), self.node(x), *(text for part in parts for text in part)]
        return self.row("atan2", *operands, name=name)

    def _piecewise(self, arguments: tuple[Any, ...], name: str) -> str:
        pairs = list(zip(arguments[::2], arguments[1::2], strict=True))
        value = self.node(pairs[-1][0])
        for each, condition in reversed(pairs[:-1]):
            side = self.linear(self._condition(condition))
            value = self.row("where", side, self.node(each), value, name=name if each is pairs[0][0] else "")
        return value

    def _condition(self, condition: Any) -> Form:
        """1 where a condition holds, 0 where it does not."""
        kind = type(condition).__name__
        one = alone(ONE)
        if kind in ("StrictLessThan", "LessThan"):
            below, above = operands(condition)
            return alone(self.row("side", self.node(below - above), wish="side_"))
        if kind == "BooleanTrue":
            return one
        if kind == "BooleanFalse":
            return {}
        if kind not in ("And", "Or", "Not"):
            raise NoRecurrenceError({"Equality": "==", "Unequality": "!="}.get(kind, kind))
        found = [self._condition(part) for part in sorted(operands(condition), key=self._text)]
        if kind in ("Or", "Not"):
            found = [added([one, scaled(part, -1.0, ())]) for part in found]
        form = one
        for part in found:
            form = self.multiply(form, part)
        return form if kind in ("And", "Not") else added([one, scaled(form, -1.0, ())])


def alone(node: str) -> Form:
    """The linear form that is one node."""
    return {(node, ()): 1.0}


def added(forms: Iterable[Form]) -> Form:
    """The sum of linear forms, what cancels left out."""
    total: Form = {}
    for form in forms:
        for key, number in form.items():
            total[key] = total.get(key, 0.0) + number
    return {key: number for key, number in total.items() if number != 0.0}


def scaled(form: Form, number: float, names: tuple[str, ...]) -> Form:
    """A linear form times a factor."""
    return {(node, tuple(sorted((*own, *names)))): number * value for (node, own), value in form.items()}


def factor_text(number: float, names: tuple[str, ...]) -> str:
    """A factor as it stands in a row."""
    text = str(int(number)) if number.is_integer() and abs(number) < _WHOLE else repr(number)
    if not names:
        return text
    return {"1": "", "-1": "-"}.get(text, f"{text}*") + "*".join(names)


#: The first function's slope is the second; the second's is the first with this sign.
_PAIRS = {
    **dict.fromkeys(("sin", "cos"), (("sin", "1"), ("cos", "-1"))),
    **dict.fromkeys(("sinh", "cosh"), (("sinh", "1"), ("cosh", "1"))),
}
#: Derivatives of functions by x, in x and the value y.
_SLOPES = {
    "tan": lambda x, y: 1 + y**2,
    "tanh": lambda x, y: 1 - y**2,
    "log": lambda x, y: 1 / x,
    "asin": lambda x, y: (1 - x**2) ** se.Rational(-1, 2),
    "acos": lambda x, y: -((1 - x**2) ** se.Rational(-1, 2)),
    "atan": lambda x, y: 1 / (1 + x**2),
    "asinh": lambda x, y: (1 + x**2) ** se.Rational(-1, 2),
    "acosh": lambda x, y: (x**2 - 1) ** se.Rational(-1, 2),
    "atanh": lambda x, y: 1 / (1 - x**2),
    "erf": lambda x, y: 2 / se.sqrt(se.pi) * se.exp(-(x**2)),
}
