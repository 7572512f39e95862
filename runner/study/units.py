"""Numbers with units: `"605 N s"` in a study, where the model says N s."""

import re
from functools import lru_cache

from runner.checks import finite

#: A number in the unit that is expected there, or a text such as "65 kN/m".
Amount = float | str

#: A number, and a unit that begins with a letter, a degree or percent sign: all that most amounts are.
_PLAIN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d_].*|[°%].*)\s*")
#: Powers that would take pint for ever: of powers, and with exponents of three digits or more.
_TOWER = re.compile(r"(\*\*|\^)\s*(?:[-+(]*\s*\d{3,}|[-+(.\d)\s]+(\*\*|\^))")


def magnitude(where: str, amount: Amount, unit: str) -> float:
    """The amount in `unit`; a plain number is in that unit already. Raises ValueError that begins with `where`."""
    if not isinstance(amount, str):
        return finite(where, amount)
    plain = _PLAIN.fullmatch(amount)
    factor = _factor(plain[2], unit) if plain else None
    if plain and factor is not None:
        return finite(where, float(plain[1]) * factor)
    value, problem = _converted(amount, unit)
    if problem:
        raise ValueError(f"{where}: {problem}")
    return finite(where, value)


def split(amount: str) -> tuple[float, str] | None:
    """Number and unit of a text such as "65 kN/m"; None where it is neither that nor a number."""
    try:
        return float(amount), ""
    except ValueError:
        plain = _PLAIN.fullmatch(amount)
    return (float(plain[1]), plain[2].strip()) if plain else None


@lru_cache(maxsize=4096)
def _factor(unit: str, wanted: str) -> float | None:
    """How many of `wanted` a `unit` is; None where that is no mere factor (degrees Celsius) or there is none.

    A sweep has thousands of amounts of one unit, each of which would cost pint some 0.2 ms.
    """
    (zero, trouble), (one, problem) = (_converted(f"{number} {unit}", wanted) for number in (0, 1))
    return one if zero == 0.0 and not (trouble or problem) else None


@lru_cache(maxsize=4096)
def _converted(amount: str, unit: str) -> tuple[float, str]:
    """The amount in `unit`, and what is wrong with it or nothing; remembered, because pint is slow."""
    import pint  # noqa: PLC0415 - slow to import, and studies of plain numbers need none

    registry = pint.get_application_registry()
    try:
        if _TOWER.search(amount):
            raise ValueError("a power that has no end")
        quantity = registry.Quantity(amount)
        wanted = registry.Unit(unit)
    except (pint.PintError, ValueError, AssertionError, TypeError, SyntaxError, ArithmeticError):
        return 0.0, f'{amount!r} is no number with a unit; write it as "2.5 {unit}"'
    if quantity.unitless and not wanted.dimensionless:
        return 0.0, f"{amount!r} has no unit; expected one such as {unit}, or a plain number in {unit}"
    try:
        value = float(quantity.to(wanted).magnitude)
    except pint.DimensionalityError:
        return 0.0, f"{amount!r} is in {quantity.units:~}, expected {unit} or a multiple of it"
    # pint calls angles dimensionless, so that 1 rpm would pass for 6.28 1/min.
    roots = {each.to_root_units().units for each in (quantity, registry.Quantity(1.0, wanted))}
    if wanted.dimensionality == {"[time]": -1} and len(roots) == 2:
        return 0.0, f"{amount!r} is no amount of {unit}: one counts angles, the other does not; give it in {unit}"
    return value, ""
