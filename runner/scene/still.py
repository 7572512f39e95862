"""A moment of a scene as a matplotlib figure."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Patch, Polygon

from qddot.runner.pictures.figures import Drawn, plain
from qddot.runner.scene.frames import Frames
from qddot.runner.scene.strokes import PALETTE, Stroke, drawing
from qddot.runner.tables import Shape

#: Inches across, and of the title; points of a thin line; the colours of outlines, and of lines on the ground.
_WIDTH, _TITLE, _THIN, _INK, _FAINT = 7.0, 0.35, 1.0, "#1b1f24", "#8d8469"


def still(frames: Frames, k: int, title: str = "") -> Drawn:
    """Frame k as a figure, with the time beside its title."""
    box = frames.box
    height = _WIDTH * (box.top - box.bottom) / (box.right - box.left)
    above = _TITLE if title else 0.0
    figure = Drawn(figsize=(_WIDTH, height + above))
    axis = figure.add_axes((0.0, 0.0, 1.0, height / (height + above)))
    axis.set_xlim(box.left, box.right)
    axis.set_ylim(box.bottom, box.top)
    axis.axis("off")
    points = 72 * _WIDTH / (box.right - box.left)  # of a metre
    for layer, (shape, found) in enumerate(drawing(frames, k, box)):
        for each in found:
            _draw(axis, each, shape, points, layer)
    if title:
        figure.text(0.01, 1 - 0.12 / (height + above), plain(title), fontsize="medium", va="top")
    return figure


def _draw(axis: Axes, stroke: Stroke, shape: Shape, points: float, layer: int) -> None:
    paint = PALETTE["grey" if stroke.rim else shape.colour if shape.colour in PALETTE else "blue"][0]
    thin = 0.0 if shape.kind == "ground" else _THIN
    patch: Patch
    if stroke.radius:
        patch = Circle(tuple(stroke.points[0]), stroke.radius, facecolor=paint, edgecolor=_INK, linewidth=_THIN)
    elif stroke.filled:
        patch = Polygon(stroke.points, facecolor=paint, edgecolor=_INK, linewidth=thin, joinstyle="round")
    else:
        wide = stroke.width * points
        joint: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round", "zorder": layer + 2}
        x, y = stroke.points.T
        if wide > 3 * _THIN:
            axis.plot(x, y, color=_INK, linewidth=wide + 2 * _THIN, **joint)
        thin_line = _FAINT if shape.kind == "ground" else paint
        axis.plot(x, y, color=paint if wide else thin_line, linewidth=max(wide, 1.6 * _THIN), **joint)
        return
    patch.set_zorder(layer + 2)
    axis.add_patch(patch)
