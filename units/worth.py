"""What a unit is worth in the SI, and how amounts in one unit become amounts in another."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from qddot.units.names import look_up
from qddot.units.table import PI
from qddot.units.text import factors, quoted

Dimension = tuple[tuple[str, int], ...]

#: Whole numbers up to here are floats without rounding.
WHOLE = 2**53
#: Bases that count angles or periods, and those that a unit may have and be called dimensionless.
ANGLES = ("rad", "turn", "cycle")
#: Beside numbers, what may be given per radian or not: N m/rad and N m s/rad.
ROTARY: tuple[Dimension, ...] = ((), (("kg", 1), ("m", 2), ("s", -2)), (("kg", 1), ("m", 2), ("s", -1)))


class DimensionError(ValueError):
    """A unit that cannot be turned into the one wanted; the message goes on from the amount: "is in m, ..."."""


class AngleError(DimensionError):
    """A unit that differs from the one wanted by an angle alone, which the SI does not see: rad/s are no Hz."""


@dataclass(frozen=True)
class Unit:
    """An amount of x is zero + factor * x in SI units; dimension: base unit and power, in order."""

    factor: Fraction
    dimension: Dimension
    zero: Fraction = Fraction(0)

    @property
    def dimensionless(self) -> bool:
        """Whether a plain number may stand for an amount: a ratio, or an angle in rad."""
        return self.dimension in ((), (("rad", 1),))


@dataclass(frozen=True)
class Conversion:
    """From one unit to another, of a number or an array: numerator / denominator, rounded once where both are whole."""

    numerator: float
    denominator: float
    offset: float

    def __call__(self, amount: Any) -> Any:
        """The amount in the other unit."""
        return amount * self.numerator / self.denominator + self.offset


@lru_cache(maxsize=4096)
def unit_of(text: str) -> Unit:
    """The unit that a text such as "kN s/m" stands for. Raises ValueError saying what is wrong with it."""
    product = factors(text)
    if len(product) == 1 and product[0][1] == 1:
        return _named(product[0][0])
    factor, powers = Fraction(1), dict[str, int]()
    for name, power in product:
        each = _named(name)
        if each.zero:
            raise ValueError(f"{quoted(name)} has a zero of its own and stands in no product; write K for differences")
        factor *= each.factor**power
        for base, own in each.dimension:
            powers[base] = powers.get(base, 0) + power * own
    return Unit(factor, _dimension(powers))


def problem(text: str) -> str:
    """What is wrong with a text as a unit; nothing where it is one."""
    try:
        unit_of(text)
    except ValueError as error:
        return str(error)
    return ""


@lru_cache(maxsize=4096)
def conversion(given: str, wanted: str) -> Conversion:
    """From the unit `given` to the unit `wanted`. Raises ValueError, DimensionError where the dimensions differ."""
    mine, theirs = unit_of(given), unit_of(wanted)
    for one, other in zip(_readings(mine, theirs), _readings(theirs, mine), strict=True):
        if one is not None and other is not None and one.dimension == other.dimension:
            return _between(one, other)
    if _without_angles(mine) == _without_angles(theirs):
        raise AngleError(f"is no amount of {wanted}: one counts angles, the other does not; give it in {wanted}")
    raise DimensionError(f"is in {given}, expected {wanted} or a multiple of it")


def to_base(given: str) -> Conversion:
    """From the unit `given` to the product of base units that it is a multiple of."""
    unit = unit_of(given)
    return _between(unit, Unit(Fraction(1), unit.dimension))


@lru_cache(maxsize=4096)
def _named(name: str) -> Unit:
    found = look_up(name)
    if found.of == name:
        return Unit(found.factor, ((name, 1),))
    if isinstance(found.of, str):
        of = unit_of(found.of)
        return Unit(found.factor * of.factor, of.dimension, found.zero)
    return Unit(found.factor, _dimension(dict(found.of)), found.zero)


def _dimension(powers: dict[str, int]) -> Dimension:
    return tuple(sorted((base, power) for base, power in powers.items() if power))


def _readings(unit: Unit, other: Unit) -> Iterator[Unit | None]:
    """How a unit may be read beside another one, the plainest first; None where it may not be read so.

    A turn is 2 pi rad. A cycle is so, too, beside a unit with angles, and counts as one beside a unit without:
    2 cycle/m are 2 1/m. A radian may be left out where nothing but radians can be meant: rad/s are no Hz.
    """
    yield unit
    bases = {base for each in (unit, other) for base, _ in each.dimension}
    angles = bool(bases & {"rad", "turn"})
    yield _as_radians(unit) if angles else None
    yield None if angles else _without(unit, "cycle")
    yield _without(unit, "rad") if not bases & {"turn", "cycle"} and _without_angles(unit) in ROTARY else None


def _as_radians(unit: Unit) -> Unit:
    powers, factor = dict(unit.dimension), unit.factor
    for base in ("turn", "cycle"):
        power = powers.pop(base, 0)
        factor *= (2 * PI) ** power
        powers["rad"] = powers.get("rad", 0) + power
    return Unit(factor, _dimension(powers), unit.zero)


def _without(unit: Unit, *bases: str) -> Unit:
    return Unit(unit.factor, tuple((base, power) for base, power in unit.dimension if base not in bases), unit.zero)


def _without_angles(unit: Unit) -> Dimension:
    return _without(unit, *ANGLES).dimension


def _between(one: Unit, other: Unit) -> Conversion:
    ratio, offset = one.factor / other.factor, (one.zero - other.zero) / other.factor
    try:
        if ratio.numerator <= WHOLE and ratio.denominator <= WHOLE:
            return Conversion(float(ratio.numerator), float(ratio.denominator), float(offset))
        return Conversion(float(ratio), 1.0, float(offset))
    except OverflowError:
        raise ValueError("its unit is too large or too small a multiple to compute with") from None
