"""Numbers with units: `"605 N s"` in a study, where the model says N s."""

from runner.checks import finite

#: A number in the unit that is expected there, or a text such as "65 kN/m".
Amount = float | str


def magnitude(where: str, amount: Amount, unit: str) -> float:
    """The amount in `unit`; a plain number is in that unit already. Raises ValueError that begins with `where`."""
    if not isinstance(amount, str):
        return finite(where, amount)
    import pint  # noqa: PLC0415 - slow to import, and studies of plain numbers need none

    registry = pint.get_application_registry()
    try:
        quantity = registry.Quantity(amount)
        wanted = registry.Unit(unit)
    except (pint.PintError, ValueError, AssertionError, TypeError, SyntaxError):
        raise ValueError(f'{where}: {amount!r} is no number with a unit; write it as "2.5 {unit}"') from None
    if quantity.unitless and not wanted.dimensionless:
        raise ValueError(f"{where}: {amount!r} has no unit; expected one such as {unit}, or a plain number in {unit}")
    try:
        return finite(where, float(quantity.to(wanted).magnitude))
    except pint.DimensionalityError:
        raise ValueError(f"{where}: {amount!r} is in {quantity.units:~}, expected {unit} or a multiple of it") from None
