"""The figure of a fit: every scenario's observed quantities as computed, with what was observed."""

from pathlib import Path
from typing import Any

import numpy as np

from qddot.runner.identify.fit import Fit
from qddot.runner.identify.problem import Problem, Trial
from qddot.runner.identify.schema import Observation
from qddot.runner.pictures.figures import panels, save
from qddot.runner.pictures.picture import COLOURS
from qddot.runner.solution import Solution

_LARGEST = 1e-3


def draw(problem: Problem, fit: Fit, path: Path) -> Path:
    """One panel for each observation, its curve with the start's in grey; bars and points are two standard errors."""
    rows = problem.observations
    figure, axes = panels(len(rows), 1.9, title=problem.given.title, below="t, s")
    fitted = {id(trial): trial.solution(problem.values(fit.x)) for trial in problem.trials}
    begun = {id(trial): trial.solution(problem.values(problem.column("start"))) for trial in problem.trials}
    for axis, (trial, each) in zip(axes, rows, strict=True):
        _panel(axis, trial, each, begun[id(trial)], fitted[id(trial)])
    return save(figure, path)


def _panel(axis: Any, trial: Trial, each: Observation, begun: Solution, fitted: Solution) -> None:
    quantity = fitted.quantity(each.quantity)
    curves = [
        (run, np.array(run[each.quantity]) - (run[each.quantity][0] if each.change else 0)) for run in (begun, fitted)
    ]
    small = max(np.abs(values).max() for _, values in curves) < 100 * _LARGEST and quantity.unit == "m"
    scale, unit = (1e3, "mm") if small else (1.0, quantity.unit)
    styles = (("0.75", 1.0, "at the start of the search"), (COLOURS[0], 1.3, "fitted"))
    for (run, values), (colour, width, label) in zip(curves, styles, strict=True):
        axis.plot(run.t, scale * values, color=colour, linewidth=width, label=label)
    _observed(axis, each, scale, fitted)
    axis.set_title(f"{trial.scenario.name}: {quantity.meaning or each.quantity}", fontsize="small", loc="left")
    axis.set_ylabel(unit)
    axis.margins(x=0.0, y=0.15)
    axis.legend(fontsize="x-small", frameon=False, loc="upper right", ncols=3)


def _observed(axis: Any, each: Observation, scale: float, fitted: Solution) -> None:
    colour, error = COLOURS[1], 2 * scale * each.sigma
    if each.value is None:
        values = scale * np.array(each.values)
        axis.errorbar(each.t, values, error, fmt=".", color=colour, markersize=3, elinewidth=0.6, label="observed")
        return
    start = fitted.t[0] if each.after is None else each.after
    end = fitted.t[-1] if each.before is None else each.before
    window = (each.at - 0.05, each.at + 0.05) if each.at is not None else (start, end)
    axis.fill_between(
        window, scale * each.value - error, scale * each.value + error, color=colour, alpha=0.25, linewidth=0
    )
    axis.plot(window, [scale * each.value] * 2, color=colour, linewidth=1.2, label=f"observed ({each.measure})")
