"""What a single name is worth: `kN`, `min`, `deg` from a table of our own, all others from pint's."""

from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from qddot.units.table import PREFIXED, PREFIXES, SEVERAL, TABLE, TEMPERATURES
from qddot.units.text import quoted

#: How a name begins that says which of several is meant.
_SAYS_WHICH = ("short_", "force_short_", "US_", "liquid_", "number_")
#: pint's names of units of which we think otherwise than pint.
_OURS = {
    "turn": "turn",
    "revolutions_per_minute": "rpm",
    "revolutions_per_second": "rps",
    "mil": "mil",
    "count": "1",
    "counts_per_second": "Hz",
}


class Name(NamedTuple):
    """How many of which unit a name stands for, and what 0 of it is in that unit."""

    factor: Fraction
    of: tuple[tuple[str, int], ...] | str
    zero: Fraction = Fraction(0)


@lru_cache(maxsize=4096)
def look_up(name: str) -> Name:
    """What a single name stands for. Raises ValueError, naming the nearest."""
    if name in TABLE:
        return Name(*TABLE[name])
    if name in TEMPERATURES:
        factor, zero = TEMPERATURES[name]
        return Name(factor, "K", zero)
    for prefix, factor in PREFIXES.items():
        if name.startswith(prefix) and name.removeprefix(prefix) in PREFIXED:
            return Name(factor, name.removeprefix(prefix))
    return _from_pint(name)


def _from_pint(name: str) -> Name:
    import pint  # noqa: PLC0415 - slow to import, and units of the table need none

    registry = pint.get_application_registry()
    meanings = registry.parse_unit_name(name) if len(name) <= 60 and name.isidentifier() else ()
    if not meanings:
        raise ValueError(f"unknown unit {quoted(name)}{_hint(name, registry)}")
    prefix, unit, _ = meanings[0]
    if prefix and name[-1].isdigit() and (power := _taken_apart(name)):  # to pint, kg0 are thousands of g0
        raise ValueError(f"{quoted(name)} means several things; write {power}, or a number of {unit}")
    if name.endswith("s") and _bare(name[:-1]) and not name.islower():  # to pint, Pas are several Pa
        raise ValueError(f"{quoted(name)} means several things; write {name[:-1]} s, or {name[:-1]}")
    if unit in SEVERAL and not name.startswith(_SAYS_WHICH):
        raise ValueError(f"{quoted(name)} means several things; write {SEVERAL[unit]}")
    if unit in _OURS:
        scale = registry.Quantity(1.0, f"{prefix}meter").to("meter").magnitude if prefix else 1
        return Name(Fraction(scale), _OURS[unit])
    return _measured(name, registry, f"{prefix}{unit}")


def _measured(name: str, registry: Any, unit: str) -> Name:
    """The unit as pint knows it, by what 0, 1 and 2 of it are in SI units."""
    zero, one, two = (registry.Quantity(number, unit).to_base_units() for number in (0.0, 1.0, 2.0))
    factor = float(one.magnitude - zero.magnitude)
    powers = {_BASE_NAMES.get(base, base): power for base, power in one.unit_items()}
    whole = all(float(power).is_integer() for power in powers.values())
    if not whole or factor == 0.0 or abs(float(two.magnitude) - zero.magnitude - 2 * factor) > 1e-9 * abs(factor):
        raise ValueError(f"{quoted(name)} is no multiple of a unit of the SI, so amounts of it cannot be converted")
    of = tuple((base, int(power)) for base, power in powers.items() if base != "count")
    return Name(Fraction(factor), of, Fraction(float(zero.magnitude)))


#: pint's names of its base units, and ours.
_BASE_NAMES = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}


def _hint(name: str, registry: Any) -> str:
    """What was probably meant: `N m` for Nm, `m^2` for m2, `kg` for kgg; some that there are where none is like it."""
    from difflib import get_close_matches  # noqa: PLC0415 - for slips alone

    if together := _taken_apart(name):
        return f"; did you mean {together!r}?"
    ours = [*TABLE, *(f"{prefix}{unit}" for prefix in ("k", "m", "c", "M") for unit in PREFIXED)]
    known = [*ours, *(each for each in dir(registry) if each.isidentifier() and each not in SEVERAL)]
    lowered = {each.lower(): each for each in reversed(known)}
    close = get_close_matches(name[:60].lower(), lowered, n=1)
    return f"; did you mean {lowered[close[0]]!r}?" if close else "; expected units such as kg, m, s, N, rad"


def _taken_apart(name: str) -> str:
    """The name as a product of different units of the table, the last with a power: "kN m", "m^2"; else nothing."""
    letters = name.rstrip("0123456789")
    power = name[len(letters) :]
    parts: dict[str, str] = {}  # unit -> with its prefix
    while letters:
        lengths = range(1, len(letters) + 1)
        found = next(((letters[:n], bare) for n in lengths if (bare := _bare(letters[:n]))), None)
        if found is None or found[1] in parts:
            return ""
        parts[found[1]] = found[0]
        letters = letters.removeprefix(found[0])
    return " ".join(parts.values()) + (f"^{power}" if power else "")


def _bare(name: str) -> str:
    """The name without its prefix where it is one of the table, else nothing."""
    if name in TABLE and name != "kg":
        return name
    return next((unit for unit in PREFIXED for prefix in PREFIXES if name == prefix + unit), "")
