"""Breaking formulas into lines: boxes that know their width, and where else they can be cut."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

Cut = Callable[[], tuple["Box", ...]]


@dataclass(frozen=True, slots=True)
class Box:
    """Text that stands on one line.

    width: in the units of its script. height: how far it outgrows a letter (0), for the size of brackets around it.
    cut: the same content in pieces, for where the box alone is wider than a line: between the terms in its brackets.
    last_cut: where that does not help, between factors, or a fraction with a slash. None where there is no such place.
    """

    text: str
    width: float
    height: int = 0
    cut: Cut | None = None
    last_cut: Cut | None = None


def joined(boxes: Sequence[Box], between: Box | None = None, *, after: bool = False) -> Box:
    """Boxes side by side, to be cut between them: before what stands between, or `after` it."""
    between = between or Box("", 0.0)
    if len(boxes) == 1:
        return boxes[0]

    def cut() -> tuple[Box, ...]:
        if after:
            return (*(beside(box, between) for box in boxes[:-1]), boxes[-1])
        return (boxes[0], *(beside(between, box) for box in boxes[1:]))

    return Box(
        between.text.join(box.text for box in boxes),
        sum(box.width for box in boxes) + between.width * (len(boxes) - 1),
        max((box.height for box in boxes), default=0),
        cut,
    )


def beside(left: Box, right: Box) -> Box:
    """Two boxes that stay together: what can be cut is cut inside."""

    def cut() -> tuple[Box, ...]:
        return _merged(_pieces(left, left.cut), _pieces(right, right.cut))

    def last_cut() -> tuple[Box, ...]:
        return _merged(_pieces(left, left.last_cut), _pieces(right, right.last_cut))

    return Box(
        left.text + right.text,
        left.width + right.width,
        max(left.height, right.height),
        cut if left.cut or right.cut else None,
        last_cut if left.last_cut or right.last_cut else None,
    )


def times(left: Box, right: Box, between: Box, sign: Box) -> Box:
    """Two factors with what stands between them; at worst the line breaks there, before a sign of multiplication."""
    whole = beside(beside(left, between), right)

    def last_cut() -> tuple[Box, ...]:
        first, *others = _pieces(right, right.last_cut)
        return (*_pieces(left, left.last_cut), beside(sign, first), *others)

    return replace(whole, last_cut=last_cut)


def _pieces(box: Box, cut: Cut | None) -> tuple[Box, ...]:
    return (box,) if cut is None else cut()


def _merged(left: tuple[Box, ...], right: tuple[Box, ...]) -> tuple[Box, ...]:
    return (*left[:-1], beside(left[-1], right[0]), *right[1:])


def fitting(boxes: Iterable[Box], width: float) -> list[Box]:
    """Boxes no wider than `width`, cut where they must be and can be."""
    found: list[Box] = []
    for box in boxes:
        cut = None if box.width <= width else box.cut or box.last_cut
        found += [box] if cut is None else fitting(cut(), width)
    return found


def lines(boxes: Iterable[Box], width: float, indent: float) -> list[list[Box]]:
    """Boxes filled into lines of `width`, all but the first indented."""
    found: list[list[Box]] = []
    room = 0.0
    for box in fitting(boxes, width - indent):
        if not found or box.width > room:
            room = width - (indent if found else 0.0)
            found.append([])
        found[-1].append(box)
        room -= box.width
    return found
