"""What `qddot identify` prints."""

import numpy as np
from rich.table import Table

from qddot.runner.identify.fit import Fit
from qddot.runner.identify.judge import Judgement
from qddot.runner.identify.problem import Problem
from qddot.runner.identify.store import Estimate
from qddot.runner.report.tables import plain_table
from qddot.words import counted


def estimates_table(found: tuple[Estimate, ...]) -> Table:
    """Every unknown with its standard error and bounds."""
    table = plain_table("Unknowns", "unknown", "unit", "value", "standard error", "from", "to", "", numbers=5)
    for each in found:
        error = "-" if each.at_bound else f"{each.standard_error:.3g}"
        at_bound = f"at its {each.at_bound} bound" if each.at_bound else ""
        table.add_row(each.name, each.unit, f"{each.value:.5g}", error, f"{each.lower:g}", f"{each.upper:g}", at_bound)
    return table


def observations_table(problem: Problem, fit: Fit) -> Table:
    """Every observation beside what the fit computes; of a curve, the root mean square of its residuals."""
    heads = ("observed", "computed", "difference", "in\nsigmas")
    table = plain_table("Observations", "quantity", "scenario", *heads, numbers=4)
    for (trial, each), computed in zip(problem.observations, problem.computed(fit.x), strict=True):
        row = (f"{each.quantity}, {each.measure if each.value is not None else 'curve'}", trial.scenario.name)
        if each.value is not None:
            difference = float(computed[0]) - each.value
            numbers = (each.value, float(computed[0]), difference, difference / each.sigma)
            table.add_row(*row, *(f"{number:.4g}" for number in numbers))
        else:
            observed = np.array(each.values)
            rms = float(np.sqrt(np.mean((computed - observed) ** 2)))
            table.add_row(*row, counted(len(observed), "point"), "", f"rms {rms:.3g}", f"rms {rms / each.sigma:.3g}")
    return table


def quality(problem: Problem, fit: Fit, judgement: Judgement) -> str:
    """One line: points, runs, chi squared."""
    freedom, chi = judgement.degrees_of_freedom, judgement.chi_squared
    said = f"{counted(len(fit.residuals), 'residual')}, {counted(len(problem.names), 'unknown')}, "
    said += f"{counted(fit.runs, 'run')} of {counted(len(problem.trials), 'scenario')}; chi squared {chi:.4g} with "
    return said + f"{counted(freedom, 'degree of freedom')}; {fit.message}"
