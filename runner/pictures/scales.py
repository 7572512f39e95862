"""Units as engineers write them: powers raised, and prefixes so that numbers are neither long nor tiny."""

import math
import re
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_RAISED = str.maketrans("-0123456789.", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹·")
_POWER = re.compile(r"(?:\^|\*\*)\(?(-?[0-9.]+)\)?")

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
_ALL = (-9, 9)
#: Units that take prefixes, and the least and the largest power of ten; a unit that begins with one of them as well.
_TAKE = {"m": (-9, 3), "rad": (-6, 0), "s": (-9, 0)} | dict.fromkeys(("N", "J", "W", "Pa", "Hz", "V", "A"), _ALL)
_HEAD = re.compile(rf"({'|'.join(sorted(_TAKE, key=len, reverse=True))})(?![\w^*])")
#: The largest value below which a smaller unit is taken: 0.4 m is 400 mm, 0.4 m/s is not 400 mm/s.
_SMALL = {"m": 0.5}
_SMALL_ELSEWHERE = 0.1

#: What a quantity in a unit is, where several share an axis.
KINDS = {
    "m": "displacement",
    "rad": "angle",
    "m/s": "velocity",
    "rad/s": "angular velocity",
    "m/s^2": "acceleration",
    "rad/s^2": "angular acceleration",
    "N": "force",
    "N m": "moment",
    "J": "energy",
    "W": "power",
    "Pa": "pressure",
    "V": "voltage",
    "A": "current",
}


def legible(unit: str) -> str:
    """A unit with its powers raised, `m/s^2` as `m/s²`, `m s^-1.75` as `m s⁻¹·⁷⁵`; nothing for 1."""
    text = _POWER.sub(lambda found: found[1].translate(_RAISED), unit.strip()).replace("*", " ")
    return "" if text == "1" else text


def scaled(unit: str, largest: float) -> tuple[float, str]:
    """The factor and the legible unit in which the largest of some values in `unit` is a number to look at."""
    head = _HEAD.match(unit.strip())
    if head is None or not math.isfinite(largest) or largest <= 0:
        return 1.0, legible(unit)
    lowest, highest = _TAKE[head[1]]
    power = 0
    if largest >= 1000 or largest < _SMALL.get(unit.strip(), _SMALL_ELSEWHERE):
        power = min(highest, max(lowest, 3 * math.floor(math.log10(largest) / 3 + 1e-12)))
    return 10.0**-power, _PREFIXES[power] + legible(unit)


def greatest(arrays: Iterable[NDArray[np.float64]]) -> float:
    """The largest magnitude of a finite number in some arrays, 0 where there is none."""
    return max((float(np.abs(each[np.isfinite(each)]).max(initial=0.0)) for each in arrays), default=0.0)


def named(name: str, unit: str) -> str:
    """`heave, mm`; the name alone where there is no unit. unit: a legible one."""
    return f"{name}, {unit}" if unit else name
