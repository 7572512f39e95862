"""The dimension of an expression, where the units of its symbols leave no doubt about it; angles count as numbers."""

from collections.abc import Iterable, Mapping
from fractions import Fraction
from typing import Any

from sympy import Add, Expr, Mul, Number, Pow, Rational, Symbol

from qddot.model.naming import t
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


def dimension(expression: Expr, units: Mapping[Symbol, str]) -> Dimension | None:
    """The dimension of an expression of symbols with these units; None where it is not certain.

    A number may have a unit that nobody wrote down, so what it is added to or multiplied by tells; where nothing else
    does, nothing is certain.
    """
    if expression.has(Symbol) and not _tells(expression):
        return None
    return _dimension(expression, units)


def _tells(expression: Expr) -> bool:
    """Whether no factor but a whole number or a half stands in a product."""
    factors = (part for product in expression.atoms(Mul) for part in product.args if isinstance(part, Number))
    return all(isinstance(number, Rational) and number.q <= 2 for number in factors)


def _dimension(node: Any, units: Mapping[Symbol, str]) -> Dimension | None:
    if isinstance(node, Symbol):
        return dimension_of_unit(units[node]) if node in units else None
    if isinstance(node, Add):
        found = [_dimension(part, units) for part in node.args if not isinstance(part, Number)]
        return found[0] if found and all(each == found[0] for each in found) else None
    if isinstance(node, Mul):
        return product((_dimension(part, units), Fraction(1)) for part in node.args if not isinstance(part, Number))
    if isinstance(node, Pow):
        exponent = node.args[1]
        if not isinstance(exponent, Rational):
            return None
        return product([(_dimension(node.args[0], units), Fraction(int(exponent.p), int(exponent.q)))])
    return {}


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
