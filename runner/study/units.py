"""Numbers with units: `"605 N s"` in a study, where the model says N s."""

from qddot.runner.checks import finite
from qddot.runner.study.base import Amount
from qddot.units.amounts import amount_in


def magnitude(where: str, amount: Amount, unit: str) -> float:
    """The amount in `unit`; a plain number is in that unit already. Raises ValueError that begins with `where`."""
    if not isinstance(amount, str):
        return finite(where, amount)
    try:
        number = amount_in(amount, unit)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    return finite(where, number)
