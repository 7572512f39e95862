"""What `qddot identify` found for the paper, on its page: unknowns with their errors, and the barrel they move."""

import tomllib
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from qddot import read_study
from qddot.drawing import COLOURS
from qddot.report import legible, numbers, table

#: Two shots, s, after which the paper tells what the barrel's end does, and what it tells, mm.
SHOTS, TOLD = (1.0, 2.85), {"19 mm after the first": 19.0, "25 mm after the second": 25.0}


def identified(folder: Path) -> list[Mapping[str, Any]]:
    """The fits beside the studies of the paper, in the order of their names."""
    return [tomllib.loads(path.read_text("utf-8")) for path in sorted((folder / "identified").glob("*.toml"))]


def described(fit: Mapping[str, Any]) -> str:
    """A fit as HTML: its unknowns, how well the observations are met, and what is to be known of it."""
    rows = []
    for name, each in fit["estimates"].items():
        error = f"{each['standard_error']:.3g}" if each["standard_error"] else "–"
        bound = f"at its {each['at_bound']} bound" if each["at_bound"] else ""
        rows.append(
            (name, each["meaning"], f"{each['value']:.4g}", error, legible(each["unit"]).replace(" ", "\u202f"), bound)
        )
    heads = ("unknown", "meaning", "value", "standard error", "unit", "")
    freedom = fit["degrees_of_freedom"]
    met = "are met within their errors" if fit["fits"] else "are not met within their errors"
    said = f"chi squared {fit['chi_squared']:.3g} with {freedom} degrees of freedom"
    words = f"The {fit['observations']} observations {met}: {said}."
    notes = "".join(f'<p class="note">{escape(note)}</p>' for note in fit["notes"])
    return f"<h3>{escape(fit['title'])}</h3><p>{words}</p>{table(heads, rows, (2, 3))}{notes}"


def barrel(folder: Path, fits: list[Mapping[str, Any]]) -> dict[str, Any]:
    """The plot of the barrel's end after two shots as each fit has it."""
    traces = []
    for fit, colour in zip(fits, COLOURS, strict=False):
        study = read_study(folder / fit["study"]).changed({**fit["values"], "inputs.F.times": list(SHOTS)})
        run = study.run(method="exact", output_times=np.linspace(0.0, 8.0, 801))
        moved = 1e3 * (run["barrel_end"] - run["barrel_end"][0])
        traces.append({"name": fit["title"], "x": numbers(run.t), "y": numbers(moved, 4), "colour": colour})
    marks = [{"y": value, "text": f"the paper: {text}"} for text, value in TOLD.items()]
    return {"name": "identified", "x": "t, s", "y": "barrel end, mm", "unit": "mm", "traces": traces, "marks": marks}
