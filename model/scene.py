"""How a model looks: shapes in a plane, x to the right and y upwards in m, their places expressions of the model's own.

What is declared first is drawn first, and lies behind what follows.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeAlias

from sympy import Expr, Symbol, sympify

from qddot.model.dimensions import Dimensions, dimension_of_unit, said
from qddot.model.nodes import free
from qddot.words import nearest

if TYPE_CHECKING:
    from qddot.model.system import System

Amount: TypeAlias = Expr | float
#: x and y.
Place: TypeAlias = tuple[Amount, Amount]

#: What a shape is painted with: each looks well by day and by night.
COLOURS = ("blue", "olive", "sand", "grey", "dark", "orange", "yellow", "red")


class _Shape:
    """What all shapes have: lists that they are given become tuples."""

    def __post_init__(self) -> None:
        for each in fields(self):  # type: ignore[arg-type] # each of them is a dataclass
            object.__setattr__(self, each.name, _frozen(getattr(self, each.name)))


@dataclass(frozen=True)
class Disc(_Shape):
    """A disc about a place: a point mass, a pin. A radius of 0 leaves its size to who draws."""

    at: Place
    radius: Amount = 0
    colour: str = "orange"
    when: Amount | None = None


@dataclass(frozen=True)
class Bar(_Shape):
    """A bar with round ends between two places. A width of 0 leaves it to who draws, here and below."""

    start: Place
    end: Place
    width: Amount = 0
    colour: str = "blue"
    when: Amount | None = None


@dataclass(frozen=True)
class Spring(_Shape):
    """A spring between two places, that wide across."""

    start: Place
    end: Place
    width: Amount = 0
    colour: str = "orange"
    when: Amount | None = None


@dataclass(frozen=True)
class Damper(_Shape):
    """A damper between two places, that wide across; its cylinder is at the start."""

    start: Place
    end: Place
    width: Amount = 0
    colour: str = "dark"
    when: Amount | None = None


@dataclass(frozen=True)
class Wheel(_Shape):
    """A wheel, turned counter-clockwise by an angle in rad; None: it rolls over the ground that the model travels."""

    centre: Place
    radius: Amount
    angle: Amount | None = None
    colour: str = "dark"
    when: Amount | None = None


@dataclass(frozen=True)
class Polygon(_Shape):
    """A body: its corners about a place of its own, turned about that counter-clockwise by an angle in rad.

    filled: False leaves a closed line of the width, such as a belt or a track.
    """

    corners: Sequence[Place]
    at: Place = (0, 0)
    angle: Amount = 0
    width: Amount = 0
    filled: bool = True
    colour: str = "blue"
    when: Amount | None = None


@dataclass(frozen=True)
class Ground(_Shape):
    """The ground through some points, as far as the picture goes; level beyond the outer ones.

    depth: of a rail or a floor; 0: down to the edge of the picture. Where the heights are inputs that read one road,
    each at its own place, it is that road.
    """

    points: Sequence[Place]
    depth: Amount = 0
    colour: str = "sand"
    when: Amount | None = None


@dataclass(frozen=True)
class Arrow(_Shape):
    """A force (x, y) in N that acts at a place; the longest of a run is a fifth of what the model takes.

    It may depend on accelerations, multipliers and reactions, as outputs may, and so may all else in a scene.
    """

    at: Place
    force: Place
    colour: str = "red"
    when: Amount | None = None


Shape = Disc | Bar | Spring | Damper | Wheel | Polygon | Ground | Arrow
KINDS: tuple[type[Any], ...] = (Disc, Bar, Spring, Damper, Wheel, Polygon, Ground, Arrow)

#: The unit of a number by the field that it stands in; "" where any will do. Other fields hold no numbers.
_UNITS: Mapping[str, str] = {
    **dict.fromkeys(("at", "start", "end", "centre", "corners", "points", "radius", "width", "depth"), "m"),
    **{"force": "N", "angle": "rad", "when": ""},
}
_PLACES, _LISTS = ("at", "start", "end", "centre", "force"), {"corners": 3, "points": 1}


def numbers(shape: Any) -> Iterator[tuple[str, str, Any]]:
    """(what, unit, expression) of each number of a shape, in the order of the kernel."""
    for each in fields(shape):
        value, unit = getattr(shape, each.name), _UNITS.get(each.name)
        if unit is None or value is None:
            continue
        if each.name in _LISTS:
            for k, place in enumerate(value, start=1):
                yield from _coordinates(f"{each.name[:-1]} {k}", unit, place)
        elif each.name in _PLACES:
            yield from _coordinates(each.name, unit, value)
        else:
            yield each.name, unit, value


def scene_numbers(system: "System") -> Iterator[tuple[str, str, Any]]:
    """(place, unit, expression) of each number of a scene, in the order of the kernel."""
    for k, shape in enumerate(system.scene):
        for what, unit, expression in numbers(shape):
            yield f"{_called(k, shape)}: {what}", unit, expression


def row(shape: Any, inputs: Sequence[Symbol]) -> tuple[str, str, int, bool, str]:
    """What the table of a module says of a shape: kind, colour, how many numbers, whether it is shown `when`, note.

    note: of a ground the inputs that are its heights, of a wheel that it rolls, of a polygon that it is a line.
    """
    note = ""
    if isinstance(shape, Ground) and all(height in inputs for _, height in shape.points):
        note = " ".join(str(height) for _, height in shape.points)
    elif isinstance(shape, Wheel) and shape.angle is None:
        note = "rolls"
    elif isinstance(shape, Polygon) and not shape.filled:
        note = "line"
    count = sum(1 for _ in numbers(shape))
    return _kind(shape), shape.colour, count, shape.when is not None, note


def forms_of_scene(system: "System") -> Iterator[str]:
    """What is wrong with the shapes of a scene, but for their expressions."""
    for k, shape in enumerate(system.scene):
        if not isinstance(shape, KINDS):
            yield f"scene[{k}] is {shape!r}, expected {', '.join(kind.__name__ for kind in KINDS)}"
            continue
        called = _called(k, shape)
        for each in fields(shape):
            value = getattr(shape, each.name)
            if each.name in _PLACES and not _is_place(value):
                yield f"{called}: {each.name} is {value!r}, expected a pair (x, y)"
            elif each.name in _LISTS and not (isinstance(value, tuple) and all(map(_is_place, value))):
                yield f"{called}: {each.name} is {value!r}, expected pairs (x, y)"
            elif each.name in _LISTS and len(value) < _LISTS[each.name]:
                yield f"{called}: it has {len(value)} {each.name}, expected {_LISTS[each.name]} or more"
        if shape.colour not in COLOURS:
            hint = nearest(str(shape.colour), COLOURS) or f", expected one of {', '.join(COLOURS)}"
            yield f"{called}: the colour {shape.colour!r} is not known{hint}"
        if not isinstance(getattr(shape, "filled", True), bool):
            yield f"{called}: filled is {shape.filled!r}, expected True or False"


def units_of_scene(system: "System") -> Iterator[str]:
    """Places that are no lengths, forces that are none: told only where the dimension of an expression is certain."""
    dimensions = Dimensions(system)
    for place, unit, expression in scene_numbers(system):
        written = sympify(expression)
        own = dimensions.of(written) if unit and free(written) else None
        wanted = dimension_of_unit(unit) if unit else None
        if own is not None and own != wanted:
            yield f"{place} is in {said(own)}, expected {unit}: it is {written}"


def _kind(shape: Any) -> str:
    return type(shape).__name__.lower()


def _called(k: int, shape: Any) -> str:
    return f"scene[{k}], {_kind(shape)}"


def _coordinates(what: str, unit: str, place: Any) -> Iterator[tuple[str, str, Any]]:
    yield from ((f"{what}, {axis}", unit, value) for axis, value in zip("xy", place, strict=True))


def _is_place(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 2 and not any(isinstance(each, tuple) for each in value)


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list | tuple) else value
