"""Amounts: a number with its unit, read in the unit that is wanted."""

from qddot.units.text import quoted, split
from qddot.units.worth import DimensionError, conversion, unit_of


def number_and_unit(text: str) -> tuple[float, str]:
    """The parts of a text such as "65 kN/m", the unit empty where there is none; else ValueError."""
    try:
        number, unit = split(text)
        unit_of(unit or "1")
    except ValueError as error:
        raise ValueError(f"{quoted(text)} is no number with a unit: {error}") from None
    return number, unit


def amount_in(text: str, unit: str) -> float:
    """The number of `unit` that a text such as "65 kN/m" is. Raises ValueError: what was found, what was expected.

    A text without a unit is taken where plain numbers have none, for ratios and angles in rad.
    """
    number, given = number_and_unit(text)
    try:
        if not given and not unit_of(unit).dimensionless:
            raise DimensionError(f"has no unit; expected one such as {unit}, or a plain number in {unit}")
        return conversion(given or unit, unit)(number)
    except DimensionError as error:
        raise ValueError(f"{quoted(text)} {error}") from None
    except ValueError as error:  # the unit wanted is none
        message = f"{quoted(text)} cannot be turned into {quoted(unit)}: {error}; give a plain number"
        raise ValueError(message) from None
