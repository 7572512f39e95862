"""One panel of quantities over time: scaled, as change since the start where offsets would hide it, or raised apart."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.pictures.picture import Curve, Panel
from qddot.runner.pictures.scales import KINDS, greatest, legible, named, scaled

Vector = NDArray[np.float64]

#: How often the greatest swing of some curves their distance has to hold so that change since the start is shown.
FLAT = 8.0
#: From how many curves on those of nearly one size, which run over each other, are raised apart.
STACK = 3
#: The longest meaning in a legend, and the longest line over a panel.
_LONG, _ABOVE = 34, 88


@dataclass(frozen=True, eq=False)
class Line:
    """A quantity of a run: values (n,) at x (n,); name: with those of its duplicates; said: what a legend says."""

    x: Vector
    values: Vector
    name: str
    unit: str
    meaning: str = ""
    said: str = ""
    colour: int | None = None
    band: tuple[Vector, Vector] | None = None
    dashed: bool = False


def panel_of(lines: Sequence[Line], from_start: Sequence[str] | None = (), apart: bool = False) -> Panel:
    """The panel of these lines.

    from_start: names that are shown as change since the start; None: all, where offsets would flatten the rest.
    apart: whether curves of nearly one size are raised, so that they can be told apart.
    """
    spread = apart and len(lines) >= STACK and _alike(lines)
    if from_start is None:
        changing = set() if spread or not _flattened(lines) else {line.name for line in lines}
    else:
        changing = {line.name for line in lines if line.name in from_start}
    moved = [_since_start(line) if line.name in changing else (line.values, line.band) for line in lines]
    units = list(dict.fromkeys(line.unit for line in lines))
    scales = {unit: scaled(unit, _largest([m for m, line in zip(moved, lines, strict=True) if line.unit == unit]))
              for unit in units}  # fmt: skip
    spacing = _spacing([values * scales[line.unit][0] for (values, _), line in zip(moved, lines, strict=True)], spread)
    words, above = _words(lines, mixed=len(units) > 1, scales=scales)
    curves = tuple(
        Curve(
            line.x,
            values * scales[line.unit][0],
            word,
            k if line.colour is None else line.colour,
            spacing * (len(lines) - 1 - k),
            None if band is None else (band[0] * scales[line.unit][0], band[1] * scales[line.unit][0]),
            line.dashed,
        )
        for k, (line, word, (values, band)) in enumerate(zip(lines, words, moved, strict=True))
    )
    axis, above = _told(lines, [scales[unit][1] for unit in units], changing, above)
    if spacing:
        above = f"{above or axis}; {spacing:g} {scales[units[0]][1]} from line to line"
    several = len({line.said or line.name for line in lines}) > 1
    above = textwrap.shorten(above, _ABOVE, placeholder=" …")
    return Panel(curves, axis, above, spacing, several and not spacing, scales[units[0]][1] if len(units) == 1 else "")


def _since_start(line: Line) -> tuple[Vector, tuple[Vector, Vector] | None]:
    first = line.values[0]
    return line.values - first, None if line.band is None else (line.band[0] - first, line.band[1] - first)


def _swings(lines: Sequence[Line]) -> list[float]:
    return [float(np.ptp(known)) for line in lines if (known := line.values[np.isfinite(line.values)]).size]


def _flattened(lines: Sequence[Line]) -> bool:
    """Whether what moves least of all would hardly be seen to move, for the distances of the curves or from 0."""
    known = [line.values[np.isfinite(line.values)] for line in lines]
    swing = max(_swings(lines), default=0.0)
    if not swing or len({line.unit for line in lines}) > 1 or not all(len(line.values) for line in lines):
        return False
    there = [each for each in known if each.size]
    reach = max(each.max() for each in there) - min(each.min() for each in there)
    far = min(abs(float(each[0])) for each in there)
    return reach > FLAT * swing or far > 2 * FLAT * swing


def _alike(lines: Sequence[Line]) -> bool:
    """Whether curves of one unit are of nearly one size and at one level, and are not the same throughout."""
    swings = _swings(lines)
    if len(swings) < len(lines) or len({line.unit for line in lines}) > 1 or not min(swings):
        return False
    if all(np.array_equal(line.values, lines[0].values) for line in lines):
        return False
    middles = [float(np.nanmedian(line.values)) for line in lines]
    return max(swings) < 3 * min(swings) and max(middles) - min(middles) < max(swings)


def _largest(moved: Sequence[tuple[Vector, tuple[Vector, Vector] | None]]) -> float:
    return greatest(each for values, band in moved for each in (values, *(band or ())))


def _spacing(values: Sequence[Vector], spread: bool) -> float:
    """A round number beyond the largest swing of the curves; 0 where they are not raised."""
    if not spread:
        return 0.0
    swing = max(float(np.ptp(each[np.isfinite(each)])) for each in values)
    ten = 10.0 ** math.floor(math.log10(swing))
    return next(step * ten for step in (1, 2, 5, 10) if step * ten >= 0.999 * swing)


def _words(lines: Sequence[Line], mixed: bool, scales: dict[str, tuple[float, str]]) -> tuple[list[str], str]:
    """What the legend says of each line, and what stands above: meanings where they are short, else what they share."""
    meanings = [line.meaning or line.name for line in lines]
    above = ""
    if len(lines) > 1 and any(line.said for line in lines):
        words, above = [line.said or line.name for line in lines], meanings[0] if len(set(meanings)) == 1 else ""
    elif len(lines) > STACK - 1 and (shared := _shared(meanings)):
        words = [line.name for line in lines]
        above = f"{meanings[0]} … {meanings[-1][len(shared) :].strip()}"
    elif len(lines) <= STACK and max(map(len, meanings)) <= _LONG:
        words = meanings
    else:
        words = [line.name for line in lines]
    if mixed:
        words = [named(word, scales[line.unit][1]) for word, line in zip(words, lines, strict=True)]
    return words, above


def _shared(meanings: Sequence[str]) -> str:
    """The words, two or more, that all meanings begin with, each going on; nothing where there are none."""
    split = [meaning.split() for meaning in meanings]
    count = 0
    while all(len(words) > count + 1 for words in split) and len({words[count] for words in split}) == 1:
        count += 1
    return " ".join(split[0][:count]) if count > 1 else ""


def _told(lines: Sequence[Line], units: list[str], changing: set[str], above: str) -> tuple[str, str]:
    """What stands at the vertical axis, and above."""
    names = {line.name for line in lines}
    change = "change of " if changing == names else ""
    if len(names) > 1:
        what = KINDS.get(lines[0].unit, "values") if len(units) == 1 and (change or lines[0].unit in KINDS) else ""
        partly = f"{', '.join(sorted(changing))}: change since the start" if changing and not change else ""
        text = named(change + what, units[0]) if what else ", ".join(filter(None, units))
        return text, "; ".join(filter(None, (above, "since the start" if change else partly)))
    line = lines[0]
    told = above or (line.meaning if line.meaning != line.name else "")
    if change and len(lines) == 1:
        told = f"{told or line.name}, from {line.values[0]:.5g} {legible(line.unit)}".rstrip().replace(" -", " −")
    elif change:
        told = f"{told or line.name}, since the start"
    return named(change + line.name, units[0]), told + (f": {line.said}" if line.said and len(lines) == 1 else "")
