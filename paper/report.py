"""The report of the M113: the ride, shots, claims, verification, modes and equations on one page."""

import json
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot import load, modes, read_study
from qddot.drawing import COLOURS
from qddot.paper.claims import read
from qddot.paper.claims_section import claims_section
from qddot.paper.identified import barrel, described, identified
from qddot.paper.verification import verify
from qddot.report import Section, embedded, plot, scene_section, table, taking_part, write_page

Vector = NDArray[np.float64]

#: Points of a curve in the page, about.
_POINTS = 800
#: What `qddot paper` computed -> the title of its section, and words above its plots.
_SECTIONS = {
    "firing": (
        "When to fire",
        "Shots at equal intervals, standing: the largest change of each quantity after the last one. The vibration "
        "dose (ISO 2631-1, Wk) stands for the crew's comfort.",
    ),
    "phase": (
        "When to fire on rough ground",
        "Two shots of 30 mm on the plough at 20 km/h: blue, they calm the hull; red, they add to what the road does.",
    ),
    "speed": (
        "Permissible speed",
        "The same field ploughed many times: on which part of such roads the hull moves less than the ground below it.",
    ),
    "cost": (
        "Cost",
        "Least times of some runs on the machine that computed this; each line is a method from loose to tight "
        "settings, those left out that are both slower and less close than another.",
    ),
}
#: The ride: when the gun is fired, and its end, s.
_FIRED, _END = (3.0, 4.85, 6.7), 12.0
_RIDE = """<p>The model: five axles on tyres, a hull that heaves and pitches on five springs and two dampers, a gun.
It drives over a random frozen plough at 20 km/h, from left to right, and fires the 30 mm gun three times, 1.85 s apart.
Displacements are drawn to scale.</p>
"""


def report(paper_file: Path, claims_file: Path, equations: str, into: Path) -> Path:
    """Write the page. equations: the model's equations as an HTML page, of which the main part is taken.

    claims_file: what `qddot paper` wrote. Raises ValueError where there is none, or it is of another vehicle.
    """
    if not claims_file.is_file():
        raise ValueError(f"{claims_file}: there is no such file; `qddot paper` writes it")
    said = json.loads(claims_file.read_text("utf-8"))
    if said.get("parameter_set") is not None:
        raise ValueError(
            f"{claims_file}: claims judged with the parameter set {said['parameter_set']}, but the report shows the "
            "paper's own vehicle; give the claims.json of `qddot paper` without --parameters"
        )
    plots: list[dict[str, Any]] = []
    paper = read(paper_file)
    folder, computed = paper_file.parent, said.get("plots", {})
    sections = [
        *_ride(folder / "drive.toml", plots),
        claims_section(said["claims"], paper.assumptions),
        Section("Shots standing still", _shots(folder, paper.assumptions["pulse"], plots)),
        *(_section(*_SECTIONS[name], found, plots) for name, found in computed.items()),
        Section("Identification", _identified(folder, plots)),
        Section("Verification", _verification()),
        Section("Modes", _modes()),
        Section("Equations and parameters", embedded(equations)),
    ]
    source = "Computed by qddot from T, Π and Φ; every number on this page can be downloaded or computed again."
    return write_page(into, paper.title, source, sections, plots)


def _curve(name: str, x: Vector, y: Vector, colour: str, digits: int = 3) -> dict[str, Any]:
    every = max(1, len(x) // _POINTS)
    rounded = [round(float(value), digits) for value in y[::every]]
    return {"name": name, "x": [round(float(t), 4) for t in x[::every]], "y": rounded, "colour": colour}


def _ride(drive: Path, plots: list[dict[str, Any]]) -> Iterator[Section]:
    """The ride as a scene, with the road and the hull over the same time below it."""
    study = read_study(drive, {"road.speed": 20 / 3.6, "inputs.F.times": list(_FIRED), "span": [0.0, _END]})
    run = study.run(method="exact", output_times=np.linspace(0.0, _END, 1201))
    road, heave = (1e3 * (run[name] - run[name][0]) for name in ("z_3", "heave"))
    curves = [_curve("road under axle 3", run.t, road, "#999999"), _curve("hull", run.t, heave, COLOURS[0])]
    plots.append({"name": "ride", "x": "t, s", "y": "displacement, mm", "unit": "mm", "cursor": True, "traces": curves})
    below = plot(len(plots) - 1, "Displacement of road and hull on this ride")
    section = scene_section(study, run, "The ride", _RIDE, below)
    yield from (section,) if section is not None else ()


def _shots(folder: Path, pulse: str, plots: list[dict[str, Any]]) -> str:
    salvos = {"one shot": [1.0], "two, 1.85 s apart": [1.0, 2.85], "two, 1.07 s apart": [1.0, 2.07]}
    salvos["three, 1.85 s apart"] = [1.0, 2.85, 4.7]
    standing, saved = read_study(folder / "standing.toml"), np.linspace(0, 10, 801)
    runs = {
        name: standing.changed({"inputs.F.times": times}).run(method="exact", output_times=saved)
        for name, times in salvos.items()
    }
    words = "The vehicle stands in its static equilibrium and fires from t = 1 s on. Assumed: "
    found = [f"<p>{words}{escape(pulse)}.</p>"]
    for quantity, title in (("heave", "Displacement of the hull"), ("barrel_end", "Displacement of the barrel's end")):
        curves = [
            _curve(name, run.t, 1e3 * (run[quantity] - run[quantity][0]), colour)
            for (name, run), colour in zip(runs.items(), COLOURS, strict=False)
        ]
        plots.append(
            {"name": quantity, "x": "t, s", "y": f"{quantity.replace('_', ' ')}, mm", "unit": "mm", "traces": curves}
        )
        found.append(plot(len(plots) - 1, title))
    return "\n".join(found)


def _section(title: str, words: str, found: list[dict[str, Any]], plots: list[dict[str, Any]]) -> Section:
    """A section of plots that `qddot paper` computed."""
    places = []
    for each in found:
        plots.append({name: value for name, value in each.items() if name != "title"})
        places.append(plot(len(plots) - 1, each["title"]))
    return Section(title, f"<p>{escape(words)}</p>\n" + "".join(places))


def _identified(folder: Path, plots: list[dict[str, Any]]) -> str:
    fits = identified(folder)
    plots.append(barrel(folder, fits))
    title = "The barrel's end after two shots, 1.85 s apart, as identified"
    return "".join(described(fit) for fit in fits) + plot(len(plots) - 1, title)


def _verification() -> str:
    rows = []
    for row in verify().rows:
        counts = row.solution.statistics
        reported = "" if row.reported is None else str(row.reported)
        rows.append((row.scheme, counts.steps, row.points, reported, counts.evaluations, f"{row.largest_error:.3g}"))
    heads = ("scheme", "steps", "points", "the paper", "evaluations", "largest error, m")
    words = "<p>One axle under a fixed hull (equations 12 and 13), 1 s, against the analytic solution.</p>"
    return words + table(heads, rows, (1, 2, 3, 4, 5))


def _modes() -> str:
    model = load("m113")
    rows = []
    for name in ("as_run_unloaded", "as_run_loaded", "public_unloaded", "public_loaded"):
        for mode in modes(model, name):
            period = f"{mode.damped_period:.4g}" if mode.oscillating else "–"
            numbers = (period, f"{mode.natural_frequency / (2 * np.pi):.4g}", f"{mode.damping_ratio:.4g}")
            rows.append((name.replace("_", " "), *numbers, taking_part(mode)))
    heads = ("parameter set", "damped period, s", "frequency, Hz", "damping ratio", "coordinates that take part")
    return table(heads, rows, (1, 2, 3))
