"""The dimension of an expression, where the units of its symbols leave no doubt about it; angles count as numbers."""

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Any

from sympy import Abs, Add, Expr, Max, Min, Mul, Number, Piecewise, Pow, Rational, Symbol, sympify

from qddot.model.naming import t
from qddot.model.nodes import atoms
from qddot.model.table import Value
from qddot.units.worth import ANGLES, unit_of

#: Base unit -> power, none of them 0.
Dimension = Mapping[str, Fraction]


def dimension_of_unit(unit: str) -> Dimension:
    """The dimension of a unit."""
    return {base: Fraction(power) for base, power in unit_of(unit).dimension if base not in ANGLES}


def units_of(system: Any) -> dict[Symbol, str]:
    """The units of a model's symbols, of their rates and of what a run solves for."""
    moving: tuple[Any, ...] = (*system.coordinates, *system.states, *system.inputs)
    fixed: tuple[Any, ...] = (*system.parameters, *system.quantities, *system.constraints)
    units = {t: "s"} | {each.symbol: each.unit for each in (*moving, *fixed)}
    rates = [(each.rate, each.unit) for each in (*moving, *system.quantities) if each.rate is not None]
    units |= {rate: "1/s" if unit == "1" else f"({unit})/s" for rate, unit in rates}
    return units | {each.acceleration: f"({each.unit})/s^2" for each in system.coordinates if each.unit != "1"}


class Dimensions:
    """The dimensions of expressions of a model's symbols.

    A number may have a unit that nobody wrote down, so what it is added to or multiplied by tells; where nothing else
    does, nothing is certain.
    """

    def __init__(self, system: Any) -> None:
        self._units = units_of(system)
        self._known: dict[Any, Dimension | None] = {}

    def of(self, expression: Expr) -> Dimension | None:
        """The dimension of an expression; None where it is not certain."""
        if atoms(expression, Symbol) and not _tells(expression):
            return None
        return self._of(expression)

    def _of(self, node: Any) -> Dimension | None:
        if node not in self._known:
            self._known[node] = self._found(node)
        return self._known[node]

    def _found(self, node: Any) -> Dimension | None:  # noqa: PLR0911 - one for each kind
        if isinstance(node, Symbol):
            return dimension_of_unit(self._units[node]) if node in self._units else None
        if isinstance(node, Add | Max | Min | Abs):
            return self._common(node.args)
        if isinstance(node, Piecewise):
            return self._common([branch.expr for branch in node.args])
        if isinstance(node, Value):
            return _of_table(node)
        if isinstance(node, Mul):
            return product((self._of(part), Fraction(1)) for part in node.args if not isinstance(part, Number))
        if isinstance(node, Pow):
            exponent = node.args[1]
            if not isinstance(exponent, Rational):
                return None
            return product([(self._of(node.args[0]), Fraction(int(exponent.p), int(exponent.q)))])
        return {}

    def _common(self, parts: Iterable[Any]) -> Dimension | None:
        """The dimension that all of these have, numbers apart."""
        found = [self._of(part) for part in parts if not isinstance(part, Number)]
        return found[0] if found and all(each == found[0] for each in found) else None


def _tells(expression: Expr) -> bool:
    """Whether no factor but a whole number or a half stands in a product."""
    factors = (part for product in atoms(expression, Mul) for part in product.args if isinstance(part, Number))
    return all(isinstance(number, Rational) and number.q <= 2 for number in factors)


def _of_table(value: Value) -> Dimension | None:
    """The unit of a table, divided by those of the arguments that it is differentiated by."""
    below = [(unit, order) for unit, order in zip(value.table.units * 2, value.orders, strict=False) if order]
    divided = ((dimension_of_unit(unit) if unit is not None else None, Fraction(-order)) for unit, order in below)
    return product(((dimension_of_unit(value.table.unit), Fraction(1)), *divided))


def arguments_of_tables(system: Any, places: Iterable[tuple[str, Any]]) -> Iterator[str]:
    """Arguments of tables in another unit than the table's: told only where the dimension is certain."""
    dimensions = Dimensions(system)
    for place, expression in places:
        for value in sorted(atoms(sympify(expression), Value), key=str):
            for argument, unit in zip(value.args, value.table.units * 2, strict=False):
                own = dimensions.of(argument) if unit is not None and argument.free_symbols else None
                if own is not None and own != dimension_of_unit(unit):
                    table = value.table.name
                    yield f"{place} gives the table {table} {argument}, which is in {said(own)}, expected {unit}"


def product(powers: Iterable[tuple[Dimension | None, Fraction]]) -> Dimension | None:
    """The dimension of a product of powers; None where that of a factor is."""
    total: dict[str, Fraction] = {}
    for each, power in powers:
        if each is None:
            return None
        for base, own in each.items():
            total[base] = total.get(base, Fraction(0)) + power * own
    return {base: power for base, power in total.items() if power}


def said(dimension: Dimension) -> str:
    """A dimension as a unit: kg m/s^2."""
    above = [(base, power) for base, power in sorted(dimension.items()) if power > 0]
    below = [(base, -power) for base, power in sorted(dimension.items()) if power < 0]
    top = " ".join(map(_said, above)) or "1"
    return "/".join((top, *map(_said, below)))


def _said(part: tuple[str, Fraction]) -> str:
    base, power = part
    return base if power == 1 else f"{base}^{power}"
