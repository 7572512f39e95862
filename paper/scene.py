"""The vehicle as a picture, and the ride that moves it: axles, springs, hull, gun, road. `scene.js` moves it."""

from pathlib import Path
from typing import Any

import numpy as np

from qddot import read_study
from qddot.report import Section

_HERE = Path(__file__).parent
#: Samples of the ride, s, and of the road, m.
_STEP, _ROAD_STEP = 0.02, 0.05
_SPEED = 20 / 3.6
_SHOTS = (3.0, 4.85, 6.7)
_END = 12.0


def ride_section(more: str) -> Section:
    """The section of the moving vehicle, with more HTML below it; its script reads what `ride_data` gives."""
    style, script = ((_HERE / name).read_text("utf-8") for name in ("scene.css", "scene.js"))
    return Section("The ride", _picture() + more, style, script)


def _picture() -> str:
    """The SVG with its controls; the script moves what has an id."""
    wheels = "".join(
        f'<path id="spring{i}" fill="none" stroke="currentColor" stroke-width="1.5"/>'
        f'<g id="wheel{i}"><circle r="27" fill="none" stroke="currentColor" stroke-width="5"/>'
        '<path d="M-22,0H22M0,-22V22" stroke="currentColor" stroke-width="2"/></g>'
        for i in range(5)
    )
    return f"""<p>The model: five axles on tyres, a hull that heaves and pitches on five springs and two dampers, a gun.
It drives over a random frozen plough at 20 km/h, from left to right, and fires the 30 mm gun three times, 1.85 s apart.
Displacements are drawn to scale.</p>
<svg class="scene" viewBox="0 0 800 300" role="img" aria-label="The vehicle over the road">
<path id="road" fill="var(--ground)" stroke="none"/>
{wheels}
<g id="hull"><g fill="var(--hull)" stroke="currentColor" stroke-width="2">
<path d="M-205,12 L-215,-62 L120,-62 L205,-20 L195,12 Z"/><path d="M-30,-62 V-86 H40 V-62 Z"/></g>
<path d="M40,-77 H270" stroke="currentColor" stroke-width="6"/>
<circle r="4" fill="currentColor"/><text x="8" y="-8">q₆, q₇</text>
<path id="flash" d="M272,-77 l26,-12 l-6,12 l6,12 Z" fill="#e69f00" opacity="0"/></g>
</svg>
<div class="controls">
<button type="button" id="play">Play</button>
<input type="range" id="time" min="0" max="{_END}" step="0.01" value="0" aria-label="Time">
<output id="shown" for="time">0.00 s</output>
</div>
"""


def ride_data(study: Path) -> dict[str, Any]:
    """What the script needs: samples of the ride, changes since the start, and the road by place."""
    changes = {"road.speed": _SPEED, "inputs.F.times": list(_SHOTS), "span": [0.0, _END]}
    vehicle = read_study(study, changes)
    times = np.arange(0.0, _END + 0.5 * _STEP, _STEP)
    run = vehicle.run(method="exact", output_times=np.minimum(times, _END))
    keep = np.searchsorted(run.t, np.minimum(times, _END) - 1e-9)
    places = vehicle.model.positions(vehicle.model.parameter_values(vehicle.arguments["parameters"]))
    ahead = [places[f"z_{i}"] for i in range(1, 6)]
    start = -2.0
    fine = vehicle.run(method="exact", output_times=np.linspace(0.0, _END, 4001))
    x = start + _SPEED * fine.t + max(ahead)
    road_start = start - 6.0
    along = np.arange(road_start, x[-1], _ROAD_STEP)
    road = np.interp(along, x, fine[f"z_{1 + int(np.argmax(ahead))}"], left=0.0)

    def change(name: str) -> list[float]:
        return [round(float(value), 5) for value in run[name][keep] - run[name][keep][0]]

    return {
        "step": _STEP,
        "end": _END,
        "speed": _SPEED,
        "start": start,
        "heave": change("heave"),
        "pitch": change("pitch"),
        "force": [round(float(value), 1) for value in run["F"][keep]],
        "peak": float(run["F"].max()),
        "axles": [{"ahead": round(float(a), 4), "height": change(f"q_{i}")} for i, a in enumerate(ahead, start=1)],
        "road_start": road_start,
        "road_step": _ROAD_STEP,
        "road": [round(float(value), 4) for value in road],
    }
