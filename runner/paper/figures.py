"""Figures 2 and 3 of paper 2116."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from qddot.runner.files import written_aside
from qddot.runner.paper.verification import Verification
from qddot.runner.report.figures import COLOURS


def draw_schemes(verification: Verification, path: Path) -> Path:
    """Fig. 2: displacement by Euler's method, which drifts away, and by ODE45 beside the analytic solution."""
    figure, axes = axes_of(2)
    names = ("Euler", *(row.scheme for row in verification.rows if row.scheme != "Euler"))
    for axis, window in zip(axes, ((0.0, 1.0), (0.9, 1.0)), strict=True):
        for scheme, colour in zip(names, COLOURS, strict=False):
            row = verification.row(scheme)
            part = (row.solution.t >= window[0]) & (row.solution.t <= window[1])
            axis.plot(row.solution.t[part], 1e3 * row.solution["q_2"][part], color=colour, linewidth=1.0, label=scheme)
        fine = verification.row("Runge-Kutta")
        part = (fine.solution.t >= window[0]) & (fine.solution.t <= window[1])
        exact = (fine.solution["q_2"] - fine.error)[part]
        axis.plot(fine.solution.t[part], 1e3 * exact, "k:", linewidth=1.6, label="analytic")
        axis.set_ylabel("$q_2$ in mm")
        axis.set_xlim(window)
    axes[0].legend(fontsize="small", ncols=4, frameon=False, loc="upper left")
    axes[0].margins(y=0.3)
    return saved(figure, axes, f"Integration schemes, {verification.parameter_set} (Fig. 2)", path)


def draw_errors(verification: Verification, path: Path) -> Path:
    """Fig. 3: the error of every scheme over time, on a logarithmic scale."""
    figure, axes = axes_of(1)
    for row, colour in zip(verification.rows, COLOURS, strict=False):
        error = np.maximum.accumulate(np.abs(row.error))
        axes[0].semilogy(row.solution.t[1:], error[1:], color=colour, linewidth=1.2, label=row.scheme)
    axes[0].set_ylim(bottom=1e-13)  # below, only the first steps of some schemes
    axes[0].set_ylabel("largest error of $q_2$ so far, in m")
    axes[0].legend(fontsize="small", ncols=3, frameon=False, loc="lower right")
    return saved(figure, axes, f"Errors of the schemes, {verification.parameter_set} (Fig. 3)", path)


def axes_of(rows: int, height: float = 2.9) -> tuple[Figure, list]:
    """A figure with this many panels under each other, each `height` inches high."""
    figure = Figure(figsize=(8.0, 1.0 + height * rows), layout="constrained")
    FigureCanvasAgg(figure)
    axes = list(figure.subplots(rows, squeeze=False)[:, 0])
    for axis in axes:
        axis.grid(color="0.9", linewidth=0.6)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def saved(figure: Figure, axes: list, title: str, path: Path, below: str = "t in s") -> Path:
    """Write the figure with its title and what stands below its last panel."""
    axes[-1].set_xlabel(below)
    figure.suptitle(title, fontsize="medium")
    with written_aside(path) as aside:
        figure.savefig(aside, dpi=150, format="png")
    return path
