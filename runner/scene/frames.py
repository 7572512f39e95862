"""A scene at some moments: the numbers of its shapes, what of them is seen, and how large all of it is."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.signal import InputTable
from qddot.runner.load import Model
from qddot.runner.scene.road import Road, road_of
from qddot.runner.tables import Shape

Numbers = NDArray[np.float64]

#: The longest arrow and the margin, in parts of the larger side of what is seen; of the ground below, of its height.
_ARROW, _MARGIN, _BELOW = 0.2, 0.05, 0.12
#: The least and the greatest width of a picture in parts of its height; the least one where there is a ground.
_NARROW, _WIDE, _OUTDOORS = 0.8, 2.6, 1.9
#: A model that goes farther than so many of its widths is followed. Where in its numbers the abscissae of a shape are.
_FAR = 3.0
_ACROSS: dict[str, slice] = {
    **dict.fromkeys(("bar", "spring", "damper"), slice(0, 4, 2)),
    **dict.fromkeys(("disc", "wheel", "arrow"), slice(0, 1)),
    **{"ground": slice(0, -1, 2), "polygon": slice(-4, -3)},
}


@dataclass(frozen=True)
class Box:
    """What a picture shows, m; unit: the size of what has none of its own."""

    left: float
    bottom: float
    right: float
    top: float

    @property
    def unit(self) -> float:
        """A fortieth of the larger side."""
        return max(self.right - self.left, self.top - self.bottom) / 40


@dataclass(frozen=True, eq=False)
class Frames:
    """Numbers (n, count) of the shapes at moments t (n,), forces already as long as they are drawn.

    road: that the model travels, if it does. way (n,): how far the ground has gone by to the left, m.
    """

    shapes: tuple[Shape, ...]
    t: Numbers
    numbers: Numbers
    way: Numbers
    road: Road | None = None

    def parts(self) -> Iterator[tuple[Shape, Numbers]]:
        """Each shape with its numbers (n, size)."""
        return parts(self.shapes, self.numbers)

    @cached_property
    def box(self) -> Box:
        """What all frames together need, with a margin, and of a fitting shape."""
        grounded = any(shape.kind == "ground" for shape in self.shapes)
        places = np.concatenate([_corners(*each).reshape(-1, 2) for each in self.parts()])
        (left, bottom), (right, top) = places.min(axis=0), places.max(axis=0)
        return _fitted(Box(float(left), float(bottom), float(right), float(top)), grounded)


def around(boxes: Sequence[Box]) -> Box:
    """What holds all of these."""
    return Box(
        min(each.left for each in boxes),
        min(each.bottom for each in boxes),
        max(each.right for each in boxes),
        max(each.top for each in boxes),
    )


class SceneError(ValueError):
    """A model that has no scene, or a scene that cannot be drawn; the message says why."""


def frames(
    model: Model, c: Numbers, t: Numbers, states: Numbers, inputs: Numbers, table: InputTable | None = None
) -> Frames:
    """The frames at times t (n,), s, of states (n, n_states) and input channels (n, n_channels).

    c: the constants of the run. table: its inputs, from which the road is read that the model travels, if it does.
    Raises SceneError where the model has no scene, or a number of it is not finite.
    """
    numbers = numbers_at(model, c, t, states, inputs)
    shapes = model.tables.scene
    read = [shape.note.split() for shape in shapes if shape.kind == "ground" and shape.note]
    road = road_of(model, c, table, read[0]) if read and table is not None else None
    followed, way = _followed(shapes, _scaled(shapes, numbers))
    return Frames(shapes, t, followed, way if road is None else road.speed * t, road)


def numbers_at(model: Model, c: Numbers, t: Numbers, states: Numbers, inputs: Numbers) -> Numbers:
    """What the kernel writes (n, count), forces in N. Raises as `frames`."""
    shapes = model.tables.scene
    if not shapes:
        raise SceneError(f"model {model.name} has no scene: give its System shapes, scene=[Point(...), Bar(...), ...]")
    kernel, found = model.kernel("scene"), np.empty((len(t), sum(shape.size for shape in shapes)))
    channels = np.zeros((len(t), max(1, inputs.shape[1])))
    channels[:, : inputs.shape[1]] = inputs
    rows = zip(t, np.ascontiguousarray(states), channels, found, strict=True)
    for time, x, u, values in rows:
        kernel(time, x, u, c, values)
    if not np.isfinite(found).all():
        row, column = np.argwhere(~np.isfinite(found))[0]
        k = int(np.searchsorted(np.cumsum([shape.size for shape in shapes]), column, side="right"))
        raise SceneError(
            f"model {model.name}: scene[{k}], {shapes[k].kind}, has a place that is {found[row, column]} at "
            f"t = {t[row]:g} s"
        )
    return found


def parts(shapes: tuple[Shape, ...], numbers: Numbers) -> Iterator[tuple[Shape, Numbers]]:
    """Each shape with its numbers (n, size), a part of all numbers (n, count)."""
    first = 0
    for shape in shapes:
        yield shape, numbers[:, first : first + shape.size]
        first += shape.size


def _scaled(shapes: tuple[Shape, ...], numbers: Numbers) -> Numbers:
    """The numbers with forces in m: the longest of them is a fifth of what a frame takes at most."""
    found = numbers.copy()
    forces = [values[:, 2:4] for shape, values in parts(shapes, found) if shape.kind == "arrow"]
    strongest = max((float(np.hypot(*each.T).max()) for each in forces), default=0.0)
    if strongest:
        left, right, bottom, top = _extents(shapes, numbers)
        size = max(float((right - left).max()), float((top - bottom).max()))
        for force in forces:
            np.multiply(force, _ARROW * size / strongest, out=force)
    return found


def _followed(shapes: tuple[Shape, ...], numbers: Numbers) -> tuple[Numbers, Numbers]:
    """The numbers as seen from beside a model that goes far, and how far the eye went (n,), m."""
    left, right, _, _ = _extents(shapes, numbers)
    if np.ptp(left) <= _FAR * float((right - left).max()):
        return numbers, np.zeros(len(numbers))
    places = [values[:, _ACROSS[shape.kind]] for shape, values in _bare(shapes, numbers) if shape.kind != "ground"]
    middle = np.median(np.concatenate(places, axis=1), axis=1)  # most shapes are where the model is
    found = numbers.copy()
    for shape, values in _bare(shapes, found):
        values[:, _ACROSS[shape.kind]] -= middle[:, None]
    return found, middle


def _bare(shapes: tuple[Shape, ...], numbers: Numbers) -> Iterator[tuple[Shape, Numbers]]:
    """As `parts`, without what says whether a shape is shown."""
    for shape, values in parts(shapes, numbers):
        yield shape, values[:, :-1] if shape.conditional else values


def _extents(shapes: tuple[Shape, ...], numbers: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Left, right, lowest and highest place (n,) of what is seen in each frame, ground and arrows apart."""
    kinds = {shape.kind for shape in shapes}
    apart = {"ground", "arrow"} if kinds - {"ground", "arrow"} else set()
    seen = [_corners(shape, values) for shape, values in parts(shapes, numbers) if shape.kind not in apart]
    places = np.concatenate(seen, axis=1)
    low, high = places.min(axis=1), places.max(axis=1)
    return low[:, 0], high[:, 0], low[:, 1], high[:, 1]


def _corners(shape: Shape, values: Numbers) -> Numbers:
    """What a shape takes in each frame: the places (n, m, 2) that must be seen; values (n, size)."""
    if shape.conditional:
        values = values[:, :-1]
    if shape.kind == "polygon":
        body, (x, y, angle, width) = values[:, :-4].reshape(len(values), -1, 2), values[:, -4:].T
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        across = x[:, None] + cos * body[..., 0] - sin * body[..., 1]
        up = y[:, None] + sin * body[..., 0] + cos * body[..., 1]
        return _widened(np.stack([across, up], axis=-1), width / 2)
    if shape.kind in ("disc", "wheel"):
        return _widened(values[:, None, :2], values[:, 2])
    if shape.kind == "arrow":
        return np.stack([values[:, :2], values[:, :2] + values[:, 2:4]], axis=1)
    if shape.kind == "ground":
        return values[:, :-1].reshape(len(values), -1, 2)
    return _widened(values[:, :4].reshape(len(values), 2, 2), values[:, 4] / 2)


def _widened(places: Numbers, by: Numbers) -> Numbers:
    """Places (n, m, 2) moved down left and up right by so much (n,)."""
    reach = np.abs(by)[:, None, None]
    return np.concatenate([places - reach, places + reach], axis=1)


def _fitted(box: Box, grounded: bool) -> Box:
    """The box with its margin, widened on both sides or raised to what a picture's sides may be to each other."""
    size = max(box.right - box.left, box.top - box.bottom) or 1.0
    margin = _MARGIN * size
    left, right, top = box.left - margin, box.right + margin, box.top + margin
    bottom = box.bottom - max(margin, _BELOW * (box.top - box.bottom) if grounded else 0.0)
    width, height = right - left, top - bottom
    wider = max(0.0, (_OUTDOORS if grounded else _NARROW) * height - width) / 2
    higher = max(0.0, width / _WIDE - height)
    return Box(
        left - wider, bottom - (0.0 if grounded else higher / 2), right + wider, top + higher / (1 + (not grounded))
    )
