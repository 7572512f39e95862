"""A scene that moves: a figure of HTML with its own script, which needs nothing else; in a page or a notebook."""

import base64
import json
import math
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.files import written_aside
from qddot.runner.scene.frames import Box, Frames, around
from qddot.runner.scene.road import Road
from qddot.runner.scene.strokes import BETWEEN, FROM, HALF, HEAD, PALETTE, RINGS, SHORT, SPOKES, TICKS, TO, drawing

Numbers = NDArray[np.float64]

_HERE = Path(__file__).parent
#: Steps of a number between its bounds; the part of what is seen that nobody sees; samples of a road at most.
_STEPS, _UNSEEN, _ROAD = 65535, 2e-5, 30_000
#: Seconds that a clip takes to show at least and at most, by its own pace; paces to choose among.
_SHORTEST, _LONGEST = 4.0, 20.0
_PACES = [digit * 10.0**power for power in range(-6, 6) for digit in (1, 2, 5)]
#: Width of the picture in its own units.
_WIDTH = 800


@dataclass(frozen=True, eq=False)
class Clip:
    """Frames at even times from the first to the last; loop: the end joins the start."""

    name: str
    frames: Frames
    loop: bool = False


@dataclass(frozen=True, eq=False)
class Animation:
    """Clips of one model, with play, pause, slider and speed; in a notebook it is shown as it is.

    linked: whether it shows the moment that other parts of a page show. begin: the time that it stands at first, s.
    """

    title: str
    clips: tuple[Clip, ...]
    linked: bool = False
    begin: float | None = None

    def _repr_html_(self) -> str:
        return f"<style>{style()}</style>{self.figure}<script>{{{script()}}}</script>"

    def save(self, path: str | Path) -> Path:
        """Write a page of its own. Raises ValueError for a name that does not end in .html, OSError as files do."""
        path = Path(path)
        if path.suffix != ".html":
            raise ValueError(f"{path}: expected a file that ends in .html")
        title = escape(self.title)
        with written_aside(path) as aside:
            aside.write_text(
                '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
                '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
                f"<title>{title}</title>\n<style>:root {{ color-scheme: light dark; }}</style>\n</head>\n"
                f"<body>\n<main>\n<h1>{title}</h1>\n{self._repr_html_()}\n</main>\n</body>\n</html>\n",
                encoding="utf-8",
            )
        return path

    @property
    def figure(self) -> str:
        """The picture of the first frame with its controls and its data, without style and script."""
        box = around([clip.frames.box for clip in self.clips])
        choice = ""
        if len(self.clips) > 1:
            options = "".join(f'<option value="{k}">{escape(clip.name)}</option>' for k, clip in enumerate(self.clips))
            choice = f'<select data-clip aria-label="What moves">{options}</select>\n'
        data = json.dumps(self._data(box), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
        height = _WIDTH * (box.top - box.bottom) / (box.right - box.left)
        return (
            '<figure class="scene">\n'
            f'<svg viewBox="0 0 {_WIDTH} {height:.1f}" role="img" aria-label="{escape(self.title)}">'
            f"{_picture(self.clips[0].frames, box)}</svg>\n"
            f'<div class="scene-controls">\n{choice}<button type="button">Play</button>\n'
            '<input type="range" value="0" aria-label="Time"><output></output>\n'
            '<select data-pace aria-label="Speed"></select>\n</div>\n'
            f'<script type="application/json">{data}</script>\n</figure>\n'
        )

    def _data(self, box: Box) -> dict[str, Any]:
        shapes = self.clips[0].frames.shapes
        return {
            "linked": self.linked,
            "begin": self.begin,
            "box": [box.left, box.bottom, box.right, box.top],
            "unit": box.unit,
            "apart": TICKS * box.unit,
            "between": BETWEEN,
            "wheel": {"rings": RINGS, "spokes": SPOKES, "from": FROM, "to": TO},
            "arrow": {"head": HEAD, "half": HALF, "short": SHORT},
            "shapes": [
                {"kind": each.kind, "colour": _colour(each.colour), "size": each.size, "when": each.conditional}
                | ({"note": each.note} if each.note else {})
                for each in shapes
            ],
            "clips": [_clip(clip, box) for clip in self.clips],
        }


@cache
def style() -> str:
    """The style of all scenes on a page."""
    day, night = (" ".join(f"--scene-{name}: {colours[k]};" for name, colours in PALETTE.items()) for k in range(2))
    return Template((_HERE / "scene.css").read_text("utf-8")).substitute(day=day, night=night)


@cache
def script() -> str:
    """The script that moves all scenes on a page."""
    return (_HERE / "scene.js").read_text("utf-8")


def _colour(name: str) -> str:
    return name if name in PALETTE else "blue"


def _clip(clip: Clip, box: Box) -> dict[str, Any]:
    frames = clip.frames
    start, end = float(frames.t[0]), float(frames.t[-1])
    size = max(box.right - box.left, box.top - box.bottom)
    paces, pace = _pace(end - start, 2.0 if clip.loop else _SHORTEST, 4.0 if clip.loop else _LONGEST)
    told: dict[str, Any] = {"name": clip.name, "start": start, "end": end, "frames": len(frames.t), "loop": clip.loop}
    told |= {"paces": paces, "pace": pace, "way": _packed(frames.way, size)}
    columns = []
    for shape, values in frames.parts():
        plain = [values[:, k] for k in range(shape.size)]
        if shape.conditional:
            plain[-1] = (plain[-1] > 0).astype(float)
        columns += [_packed(column, size) for column in plain]
    told["columns"] = columns
    if frames.road is not None:
        told["road"] = _road(frames.road, frames.way, box)
    return told


def _road(road: Road, way: Numbers, box: Box) -> dict[str, Any]:
    start, end = box.left + float(way.min()), box.right + float(way.max())
    step = max((box.right - box.left) / 200, (end - start) / _ROAD)
    places: Numbers = start + step * np.arange(math.ceil((end - start) / step) + 2, dtype=np.float64)
    return {"start": start, "step": step, "heights": _packed(road.along(places), box.right - box.left)}


def _packed(values: Numbers, size: float) -> Any:
    """A column as a page has it: a number where it hardly changes, else 16 bits between its bounds."""
    low, high = float(values.min()), float(values.max())
    if high - low <= _UNSEEN * size:
        return float(f"{values[0]:.7g}")
    step = (high - low) / _STEPS
    whole = np.rint((values - low) / step).astype("<u2")
    return {"low": low, "step": step, "data": base64.b64encode(whole.tobytes()).decode("ascii")}


def _pace(duration: float, shortest: float, longest: float) -> tuple[list[float], float]:
    """Paces to choose among, and the one nearest to real time that shows a duration neither too fast nor too slowly."""
    wanted = min(max(1.0, duration / longest), duration / shortest) if duration > 0 else 1.0
    k = int(np.argmin([abs(math.log(each / wanted)) for each in _PACES]))
    pace = float(f"{_PACES[k]:.6g}")
    near = {float(f"{each:.6g}") for each in _PACES[max(0, k - 3) : k + 4]} | ({1.0} if duration > 0.1 else set())
    return sorted(near), pace


def _picture(frames: Frames, box: Box) -> str:
    """The first frame as paths of an SVG, for where no script runs."""
    scale = _WIDTH / (box.right - box.left)
    found = []
    for shape, strokes in drawing(frames, 0, box):
        paths = []
        for each in strokes:
            x, y = (each.points[:, 0] - box.left) * scale, (box.top - each.points[:, 1]) * scale
            if each.radius:
                r = each.radius * scale
                half = f"a{r:.2f},{r:.2f} 0 1,0 "
                path = f"M{x[0] - r:.2f},{y[0]:.2f}{half}{2 * r:.2f},0{half}-{2 * r:.2f},0Z"
            else:
                path = "M" + "L".join(f"{a:.2f},{b:.2f}" for a, b in zip(x, y, strict=True)) + "Z" * each.filled
            if each.filled:
                kind = "rim" if each.rim else "earth" if shape.kind == "ground" else "area"
            else:
                kind = "surface" if shape.kind == "ground" else "thick" if each.width else "line"
            wide = each.width * scale
            if each.width and shape.kind != "arrow":
                paths.append(f'<path class="edge" d="{path}" style="stroke-width: {wide + 2.4:.2f}px"/>')
            width = f' style="stroke-width: {wide:.2f}px"' if each.width else ""
            paths.append(f'<path class="{kind}" d="{path}"{width}/>')
        found.append(f'<g style="--paint: var(--scene-{_colour(shape.colour)})">{"".join(paths)}</g>')
    return "".join(found)
