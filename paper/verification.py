"""Section 3.1 of paper 2116: one axle under a fixed hull by six schemes, against the analytic solution (13)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot import Model, Solution, load, simulate

MODEL = "one_axle"
SPAN = (0.0, 1.0)
STEP = 1e-4

#: The paper's six schemes by its own names.
SCHEMES = {
    "Euler": "euler",
    "modified Euler": "heun",
    "Runge-Kutta": "rk4",
    "ODE23": "ode23",
    "ODE45": "ode45",
    "ODE15S": "ode15s",
}

#: Iterations the paper reports, which are the points MATLAB returns.
REPORTED = {"ODE23": 525, "ODE45": 637, "ODE15S": 449}

#: The order of Fig. 3: the three best, then the next ones, largest errors last.
BEST = ("modified Euler", "Runge-Kutta", "ODE45")


@dataclass(frozen=True, eq=False)
class Row:
    """One scheme: its solution, the error (n,) of the displacement in m, and the paper's count where it gives one."""

    scheme: str
    solution: Solution
    error: NDArray[np.float64]
    reported: int | None

    @property
    def points(self) -> int:
        """Points of the solution, the start included."""
        return len(self.solution.t)

    @property
    def largest_error(self) -> float:
        """Largest error in m."""
        return float(np.abs(self.error).max())


@dataclass(frozen=True, eq=False)
class Verification:
    """All six schemes with one parameter set, and the period of the axle in s."""

    parameter_set: str
    period: float
    rows: tuple[Row, ...]

    def row(self, scheme: str) -> Row:
        """The row of a scheme."""
        return next(row for row in self.rows if row.scheme == scheme)

    def claims(self) -> dict[str, bool]:
        """What the paper says of this case -> whether it is so here."""
        errors = {row.scheme: row.largest_error for row in self.rows}
        counted = [row for row in self.rows if row.reported is not None]
        said = {f"{row.scheme} takes {row.reported} points": row.points == row.reported for row in counted}
        said["modified Euler, Runge-Kutta and ODE45 err least, then ODE15S, ODE23 most (Fig. 3)"] = (
            max(errors[scheme] for scheme in BEST) < errors["ODE15S"] < errors["ODE23"]
        )
        said["the error of Euler's method grows monotonically (Fig. 2)"] = bool(
            (np.diff(self.peaks("Euler")) > 0).all()
        )
        return said

    def peaks(self, scheme: str) -> NDArray[np.float64]:
        """The largest error of a scheme in each whole period of the axle, m."""
        row = self.row(scheme)
        periods = (row.solution.t / self.period).astype(int)
        last = int(periods[-1])  # the last one is cut short by the end of the run
        return np.array([np.abs(row.error[periods == k]).max() for k in range(last)])


def verify(parameter_set: str = "as_run") -> Verification:
    """Run all six schemes from rest; MATLAB's defaults for the variable-step ones: rtol 1e-3, atol 1e-6."""
    model = load(MODEL)
    values = _values(model, parameter_set)
    rows = []
    for scheme, method in SCHEMES.items():
        fixed = {"step": STEP, "every": 1} if method in ("euler", "heun", "rk4") else {}
        given: dict[str, Any] = {"method": method, "parameters": parameter_set, "initial": [0.0, 0.0], **fixed}
        simulate(model, (0.0, STEP), **given)  # compiles, where it must, before the run that is timed
        solution = simulate(model, SPAN, **given)
        error = solution["q_2"] - analytic(solution.t, values)
        rows.append(Row(scheme, solution, error, REPORTED.get(scheme)))
    return Verification(parameter_set, float(2 * np.pi / frequency(values)), tuple(rows))


def analytic(t: NDArray[np.float64], values: Mapping[str, float]) -> NDArray[np.float64]:
    """Displacement (n,) in m at times t (n,) in s from rest, equation (13)."""
    omega = frequency(values)
    return -values["g"] / omega**2 * (1 - np.cos(omega * t))


def frequency(values: Mapping[str, float]) -> float:
    """Natural frequency in rad/s: the root of (k_2 + k_7)/m_2."""
    return float(np.sqrt((values["k_2"] + values["k_7"]) / values["m_2"]))


def _values(model: Model, parameter_set: str) -> dict[str, float]:
    names = [parameter.name for parameter in model.tables.parameters]
    return dict(zip(names, model.parameter_values(parameter_set), strict=True))
