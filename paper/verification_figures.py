"""Figures 2 and 3 of paper 2116."""

from pathlib import Path

import numpy as np

from qddot.drawing import COLOURS, panels, save
from qddot.paper.verification import Verification


def draw_schemes(verification: Verification, path: Path) -> Path:
    """Fig. 2: displacement by Euler's method, which drifts away, and by ODE45 beside the analytic solution."""
    title = f"Integration schemes, {verification.parameter_set} (Fig. 2)"
    figure, axes = panels(2, title=title, below="t in s")
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
    return save(figure, path)


def draw_errors(verification: Verification, path: Path) -> Path:
    """Fig. 3: the error of every scheme over time, on a logarithmic scale."""
    title = f"Errors of the schemes, {verification.parameter_set} (Fig. 3)"
    figure, axes = panels(1, title=title, below="t in s")
    for row, colour in zip(verification.rows, COLOURS, strict=False):
        error = np.maximum.accumulate(np.abs(row.error))
        axes[0].semilogy(row.solution.t[1:], error[1:], color=colour, linewidth=1.2, label=row.scheme)
    axes[0].set_ylim(bottom=1e-13)  # below, only the first steps of some schemes
    axes[0].set_ylabel("largest error of $q_2$ so far, in m")
    axes[0].legend(fontsize="small", ncols=3, frameon=False, loc="lower right")
    return save(figure, path)
