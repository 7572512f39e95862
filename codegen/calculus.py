"""Derivatives that see through named quantities: the chain rule instead of substitution, so that names survive."""

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from typing import Any

import symengine as se

from qddot.codegen.convert import arguments, looked_up, slope
from qddot.codegen.nodes import holding, holds_choice, operands, symbols_of
from qddot.codegen.rewrite import ZERO, Names, operations, replaced, rewrite

Vector = tuple[Any, ...]

#: A derivative of a quantity of more operations than this is a quantity itself.
_LONG = 10
#: Terms of a sum within a product whose derivatives are taken one by one.
_MANY = 4
#: What SymEngine makes of a division by zero.
_NO_NUMBERS = frozenset(("ComplexInfinity", "Infinity", "NegativeInfinity", "NaN"))
#: What SymEngine does not differentiate by itself, or not as it should.
_is_rough = holding(se.Piecewise, se.FunctionSymbol)


class Definitions:
    """Named quantities in order, each an expression in base symbols and earlier quantities.

    Derivatives of quantities are cached, and expressions are differentiated term by term by the symbols each term
    holds, which keeps a chain of n masses at cost n. Where there are names to be had, a long derivative that moves
    becomes a quantity of its own, w_by_q: so rotations of rotations are never written out, however often they are
    differentiated.
    degrees: of the polynomials of tables, by name. fixed: symbols that are constant during a run.
    """

    def __init__(
        self,
        expressions: Mapping[Any, Any],
        degrees: Mapping[str, int] | None = None,
        fixed: frozenset[Any] = frozenset(),
        names: Names | None = None,
    ) -> None:
        self.expressions = dict(expressions)
        self._degrees = degrees or {}
        self._fixed, self._names = fixed, names
        self._reach: dict[Any, frozenset[Any]] = {}
        self._slopes: dict[tuple[Any, Any], Any] = {}
        self._sums: dict[Any, dict[Any, Any]] = {}
        for symbol, expression in self.expressions.items():
            self._reach[symbol] = self.base_symbols(expression)

    def copy(self, names: Names) -> "Definitions":
        """The same quantities, and what is known of them, to be added to by derivatives that are named by `names`."""
        copied = Definitions({}, self._degrees, self._fixed, names)
        copied.expressions, copied._reach = dict(self.expressions), dict(self._reach)
        copied._slopes = dict(self._slopes)
        return copied

    def base_symbols(self, expression: Any) -> frozenset[Any]:
        """All symbols an expression depends on, through quantities too; quantities themselves left out."""
        found: set[Any] = set()
        for symbol in symbols_of(expression):
            found.update(self._reach.get(symbol, (symbol,)))
        return frozenset(found)

    def gradient(self, expression: Any, variables: Iterable[Any]) -> dict[Any, Any]:
        """Total derivatives by each variable; the ones that vanish by structure are left out.

        variables: a set where there are many of them and of expressions, for any other is made a set each time.
        """
        wanted = variables if isinstance(variables, Set) else set(variables)
        parts: dict[Any, list[Any]] = {}
        for term in terms(expression):
            reached = {symbol: found for symbol in symbols_of(term) if (found := self._reached(symbol, wanted))}
            for symbol, outer in self._derivatives(term, reached):
                for variable in reached[symbol]:
                    inner = self._slope(symbol, variable)
                    parts.setdefault(variable, []).append(outer if inner is None else outer * inner)
        sums = {variable: se.Add(*found) for variable, found in parts.items()}
        return {variable: total for variable, total in sums.items() if total != ZERO}

    def _reached(self, symbol: Any, wanted: Set[Any]) -> Iterable[Any]:
        """Which of the wanted base symbols a symbol depends on."""
        if symbol in self._reach:
            return self._reach[symbol] & wanted
        return (symbol,) if symbol in wanted else ()

    def substitute(self, expressions: Iterable[Any], values: Mapping[Any, Any]) -> list[Any] | None:
        """Expressions with base symbols replaced, inside the quantities they use too; None where one has no value."""
        inner: dict[Any, Any] = dict(values)
        expressions = tuple(expressions)
        needed = self.needed(expressions)
        try:
            for symbol, definition in self.expressions.items():
                if symbol in needed:
                    inner[symbol] = _replaced(definition, inner)
            found = [_replaced(expression, inner) for expression in expressions]
        except RuntimeError:  # what SymEngine has to say of sin(1/0)
            return None
        return found if all(map(_is_finite, found)) else None

    def needed(self, expressions: Iterable[Any]) -> set[Any]:
        """The quantities that expressions depend on."""
        needed = set().union(*(symbols_of(expression) for expression in expressions))
        for symbol, definition in reversed(self.expressions.items()):
            if symbol in needed:
                needed |= symbols_of(definition)
        return needed & self.expressions.keys()

    def _derivatives(self, term: Any, symbols: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        """Partial derivatives by symbols; of a product with a long sum by way of the derivatives of its terms."""
        factors = operands(term) if isinstance(term, se.Mul) else ()
        long = [part for part in factors if isinstance(part, se.Add)]
        if len(long) != 1 or len(operands(long[0])) < _MANY or _is_rough(term):
            yield from ((symbol, self._derivative(term, symbol)) for symbol in symbols)
            return
        total, rest = long[0], se.Mul(*(part for part in factors if part is not long[0]))
        slopes, within = self._slopes_of_sum(total, symbols), symbols_of(rest)
        for symbol in symbols:
            inside = rest * slopes[symbol] if symbol in slopes else se.Integer(0)
            yield symbol, inside + total * rest.diff(symbol) if symbol in within else inside

    def _slopes_of_sum(self, total: Any, symbols: Iterable[Any]) -> dict[Any, Any]:
        """Partial derivatives of a sum by symbols that it holds, and what others are known; kept."""
        known = self._sums.setdefault(total, {})
        missing = symbols_of(total).intersection(symbols) - known.keys()
        if missing:
            found: dict[Any, list[Any]] = {symbol: [] for symbol in missing}
            for term in operands(total):
                for symbol, slope in self._derivatives(term, missing & symbols_of(term)):
                    found[symbol].append(slope)
            known |= {symbol: se.Add(*parts) for symbol, parts in found.items()}
        return known

    def _derivative(self, expression: Any, symbol: Any) -> Any:
        """The partial derivative; of tables by the chain rule, each of their derivatives a function of its own."""
        if not _is_rough(expression):
            return expression.diff(symbol)
        calls = _outermost_calls(expression)
        if not calls:
            return settled(expression.diff(symbol))
        names = {call: se.Dummy() for call in calls}
        shell = replaced(expression, names)
        parts = [settled(shell.diff(symbol))]
        for call, name in names.items():
            table, orders = looked_up(call)
            outer = settled(shell.diff(name))
            for k, (order, argument) in enumerate(zip(orders, arguments(call), strict=True)):
                if order < self._degrees[table] and symbol in symbols_of(argument):
                    parts.append(outer * slope(call, k) * self._derivative(argument, symbol))
        return replaced(se.Add(*parts), {name: call for call, name in names.items()})

    def _slope(self, symbol: Any, variable: Any) -> Any:
        """Give d symbol / d variable; None stands for the symbol itself, one."""
        if symbol == variable:
            return None
        key = (symbol, variable)
        if key not in self._slopes:
            found = self.gradient(self.expressions[symbol], (variable,)).get(variable, se.Integer(0))
            self._slopes[key] = self._named(found, f"{symbol}_by_{variable}")
        return self._slopes[key]

    def _named(self, derivative: Any, wish: str) -> Any:
        """A derivative, or the quantity that it becomes."""
        reach = self.base_symbols(derivative)
        if self._names is None or operations(derivative) <= _LONG or reach <= self._fixed:
            return derivative
        symbol = self._names.fresh(wish)
        self.expressions[symbol], self._reach[symbol] = derivative, reach
        return symbol


def _replaced(expression: Any, values: Mapping[Any, Any]) -> Any:
    return expression.subs({symbol: values[symbol] for symbol in symbols_of(expression) & values.keys()})


def _is_finite(expression: Any) -> bool:
    return type(expression).__name__ not in _NO_NUMBERS and all(map(_is_finite, operands(expression)))


def settled(expression: Any) -> Any:
    """The same, each Piecewise whose branches are all of one value written as that value."""
    return rewrite(expression, _one_value, {}) if holds_choice(expression) else expression


def _one_value(node: Any) -> Any:
    values = operands(node)[::2] if isinstance(node, se.Piecewise) else ()
    return values[0] if values and all(value == values[0] for value in values) else node


def _outermost_calls(expression: Any) -> list[Any]:
    if isinstance(expression, se.FunctionSymbol):
        return [expression]
    return list(dict.fromkeys(call for part in operands(expression) for call in _outermost_calls(part)))


def terms(expression: Any) -> tuple[Any, ...]:
    """The addends of a sum, opening products of a number or symbol with a sum as they stand."""
    return operands(expression) if isinstance(expression, se.Add) else (expression,)


def by(gradient: Mapping[Any, Any], variables: Sequence[Any]) -> Vector:
    """The entries of a gradient in the order of its variables, 0 where there is none."""
    return tuple(gradient.get(variable, se.Integer(0)) for variable in variables)


def dot(left: Sequence[Any], right: Sequence[Any]) -> Any:
    """The sum of products."""
    return se.Add(*(a * b for a, b in zip(left, right, strict=True)))
