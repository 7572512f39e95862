"""The result as a named, dated parameter set with its origin: a TOML file that a study refers to by `identified`."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from qddot.runner.files import written_aside
from qddot.runner.identify.fit import Fit
from qddot.runner.identify.judge import Judgement
from qddot.runner.identify.problem import Problem


@dataclass(frozen=True)
class Estimate:
    """One unknown as it was found; at_bound: "", "lower" or "upper"."""

    name: str
    value: float
    standard_error: float
    unit: str
    meaning: str
    lower: float
    upper: float
    at_bound: str


def estimates(problem: Problem, fit: Fit, judgement: Judgement) -> tuple[Estimate, ...]:
    """The unknowns with what was found of each."""
    return tuple(
        Estimate(
            name,
            float(fit.x[i]),
            float(judgement.standard_errors[i]),
            each.unit,
            each.meaning,
            each.lower,
            each.upper,
            "lower" if fit.at_lower[i] else "upper" if fit.at_upper[i] else "",
        )
        for i, (name, each) in enumerate(problem.given.unknowns.items())
    )


def save(problem: Problem, fit: Fit, judgement: Judgement, folder: Path, today: date) -> Path:
    """Write NAME.toml to the folder; it appears whole or not at all."""
    given = problem.given
    lines = [
        "# Written by `qddot identify`; a study refers to it by `identified`.",
        *_table({"name": given.name, "title": given.title}),
        f"date = {today.isoformat()}",
        *_table({"origin": f"bounded least squares of {problem.path.name}", "study": given.study}),
        *_table({"observations": len(fit.residuals), "converged": fit.converged}),
        *_table({"chi_squared": judgement.chi_squared, "degrees_of_freedom": judgement.degrees_of_freedom}),
        *_table({"fits": judgement.fits, "notes": list(judgement.notes)}),
        "",
        "[values]",
        *_table(problem.values(fit.x)),
    ]
    for each in estimates(problem, fit, judgement):
        said = {"value": each.value, "standard_error": each.standard_error, "unit": each.unit, "meaning": each.meaning}
        lines += ["", f"[estimates.{each.name}]", *_table(said)]
        lines += _table({"lower": each.lower, "upper": each.upper, "at_bound": each.at_bound})
    lines += ["", "[correlation]"]
    for name, row in zip(problem.names, judgement.correlation, strict=True):
        lines += _table({name: [round(float(value), 6) for value in row]})
    path = folder / f"{given.name}.toml"
    with written_aside(path) as aside:
        aside.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _table(values: Mapping[str, Any]) -> list[str]:
    return [f"{_key(name)} = {_value(value)}" for name, value in values.items()]


def _key(name: str) -> str:
    return name if name.replace("_", "").isalnum() and name.isascii() else json.dumps(name)


def _value(value: Any) -> str:
    """A TOML value; texts as JSON writes them, which TOML reads."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else "inf" if value > 0 else "-inf" if value < 0 else "nan"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
