"""What a shape of a scene is drawn of: lines, areas and circles. `scene.js` does the same on a page."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.scene.frames import Box, Frames
from qddot.runner.scene.road import Road
from qddot.runner.tables import Shape

Numbers = NDArray[np.float64]

#: Colours by name, by day and by night.
PALETTE = {
    "blue": ("#8fadc8", "#5e86a8"),
    "olive": ("#93a173", "#7d8c60"),
    "sand": ("#d9cdb4", "#4f493d"),
    "grey": ("#b4babf", "#6f777e"),
    "dark": ("#3f474f", "#aeb6bd"),
    "orange": ("#d06a1c", "#ea9650"),
    "yellow": ("#f0b400", "#ffcf3f"),
    "red": ("#c0342b", "#ff8379"),
}

#: Of what lies between two places: lines through (part of the way, part of the width across).
_TEETH = [(0.16 + 0.68 * (k + 0.5) / 8, 0.5 if k % 2 else -0.5) for k in range(8)]
BETWEEN: dict[str, list[list[tuple[float, float]]]] = {
    "bar": [[(0.0, 0.0), (1.0, 0.0)]],
    "spring": [[(0.0, 0.0), (0.16, 0.0), *_TEETH, (0.84, 0.0), (1.0, 0.0)]],
    "damper": [
        [(0.0, 0.0), (0.3, 0.0)],
        [(0.75, -0.5), (0.3, -0.5), (0.3, 0.5), (0.75, 0.5)],
        [(0.55, -0.4), (0.55, 0.4)],
        [(0.55, 0.0), (1.0, 0.0)],
    ],
}
#: Of a wheel: circles as parts of its radius with whether they are its rim, and spokes between two parts of it.
RINGS, SPOKES, FROM, TO = ((1.0, False), (0.66, True), (0.16, False)), 5, 0.16, 0.66
#: The head of an arrow, in units: its length and half of its width. A shorter arrow is none.
HEAD, HALF, SHORT = 0.9, 0.4, 0.15
#: Units between ticks of the ground.
TICKS = 3.0


@dataclass(frozen=True, eq=False)
class Stroke:
    """A line or an area through points (m, 2), m, or a circle about the only one; filled: else a line.

    width: of a line in m; 0 for a thin one. rim: whether it has the colour of a rim.
    """

    points: Numbers
    radius: float = 0.0
    filled: bool = False
    width: float = 0.0
    rim: bool = False


def drawing(frames: Frames, k: int, box: Box) -> Iterator[tuple[Shape, list[Stroke]]]:
    """Each shape of frame k with its strokes, none where it is not shown."""
    for shape, values in frames.parts():
        yield shape, strokes(shape, values[k].tolist(), box, frames.road, float(frames.way[k]))


def strokes(shape: Shape, values: Sequence[float], box: Box, road: Road | None, way: float) -> list[Stroke]:
    """What a shape with these numbers is drawn of where the ground has gone by so far, m."""
    if shape.conditional:
        if not values[-1] > 0:
            return []
        values = values[:-1]
    return _KINDS[shape.kind](shape, values, box, road, way)


def ground_line(shape: Shape, values: Sequence[float], box: Box, road: Road | None, way: float) -> Numbers:
    """The surface of a ground (m, 2) from the left of a picture to its right."""
    if road is not None and shape.note:
        x = np.linspace(box.left, box.right, 201)
        return np.column_stack([x, road.along(x + way)])
    points = np.array(values[:-1]).reshape(-1, 2)
    points = points[np.argsort(points[:, 0], kind="stable")]
    x = np.array([box.left, *np.clip(points[:, 0], box.left, box.right), box.right])
    return np.column_stack([x, [points[0, 1], *points[:, 1], points[-1, 1]]])


def _ground(shape: Shape, values: Sequence[float], box: Box, road: Road | None, way: float) -> list[Stroke]:
    line = ground_line(shape, values, box, road, way)
    depth = values[-1]
    below = line[::-1] - [0.0, depth] if depth else np.array([[box.right, box.bottom], [box.left, box.bottom]])
    return [Stroke(np.concatenate([line, below]), filled=True), Stroke(line), *_ticks(line, depth, box, way)]


def _ticks(line: Numbers, depth: float, box: Box, way: float) -> Iterator[Stroke]:
    """Short lines below the ground, which go by with it."""
    apart = TICKS * box.unit
    first, last = (math.floor((end + way) / apart) for end in (box.left, box.right))
    for k in range(first + 1, last + 1):
        x = k * apart - way
        top = np.array([x, np.interp(x, *line.T) - (0.0 if depth else 0.5 * box.unit)])
        yield Stroke(np.array([top, top - ([0.0, depth] if depth else [0.7 * box.unit, box.unit])]))


def _between(shape: Shape, values: Sequence[float], box: Box, *_: Any) -> list[Stroke]:
    start, end, width = np.array(values[:2]), np.array(values[2:4]), values[4] or 2 * box.unit
    way = end - start
    across = np.array([-way[1], way[0]]) / (math.hypot(*way) or 1.0) * width
    lines = [np.array([start + part * way + aside * across for part, aside in line]) for line in BETWEEN[shape.kind]]
    thick = values[4] or 0.6 * box.unit
    return [Stroke(line, width=thick if shape.kind == "bar" else 0.0) for line in lines]


def _arrow(shape: Shape, values: Sequence[float], box: Box, *_: Any) -> list[Stroke]:
    start, way = np.array(values[:2]), np.array(values[2:4])
    length = math.hypot(*way)
    if length < SHORT * box.unit:
        return []
    along, end = way / length, start + way
    head = min(HEAD * box.unit, 0.6 * length)
    aside = np.array([-along[1], along[0]]) * head * HALF / HEAD
    foot = end - head * along
    return [
        Stroke(np.array([start, foot]), width=0.22 * box.unit),
        Stroke(np.array([end, foot + aside, foot - aside]), filled=True),
    ]


def _disc(shape: Shape, values: Sequence[float], box: Box, *_: Any) -> list[Stroke]:
    return [Stroke(np.array([values[:2]]), values[2] or 0.5 * box.unit, filled=True)]


def _wheel(shape: Shape, values: Sequence[float], box: Box, road: Road | None, way: float) -> list[Stroke]:
    centre, radius = np.array(values[:2]), values[2]
    angle = values[3] if shape.note != "rolls" else -way / radius if radius else 0.0
    turns = [angle + 2 * math.pi * k / SPOKES for k in range(SPOKES)]
    ways = [np.array([math.cos(turn), math.sin(turn)]) * radius for turn in turns]
    return [
        *(Stroke(centre[None], part * radius, filled=True, rim=rim) for part, rim in RINGS),
        *(Stroke(np.array([centre + FROM * way, centre + TO * way])) for way in ways),
    ]


def _polygon(shape: Shape, values: Sequence[float], box: Box, *_: Any) -> list[Stroke]:
    body, (x, y, angle, width) = np.array(values[:-4]).reshape(-1, 2), values[-4:]
    cos, sin = math.cos(angle), math.sin(angle)
    points = np.array([x, y]) + body @ np.array([[cos, sin], [-sin, cos]])
    if shape.note != "line":
        return [Stroke(points, filled=True)]
    return [Stroke(np.concatenate([points, points[:1]]), width=width or 0.5 * box.unit)]


_KINDS = {
    "ground": _ground,
    "disc": _disc,
    "wheel": _wheel,
    "polygon": _polygon,
    "arrow": _arrow,
    **dict.fromkeys(BETWEEN, _between),
}
