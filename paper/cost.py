"""Section 3.2 of paper 2116: what an error below a limit costs by each method, against the exact propagation."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot import IntegrationError, Solution, Study, methods
from qddot.paper.schema import CostSettings, MethodSettings
from qddot.paper.studies import Studies

Vector = NDArray[np.float64]

#: Fixed steps tried, s, and tolerances: the loosest first. The step falls by a fifth, the tolerance by a factor of two.
STEPS = tuple(float(0.02 * 0.8**k) for k in range(42))
TOLERANCES = tuple(float(0.1 * 0.5**k) for k in range(38))
#: Absolute tolerance in m and rad, beside the relative one, as in MATLAB's defaults.
ABSOLUTE = 1e-3
#: Runs at finer settings that must stay below the limit too, so that no lucky zero of the error counts.
CONFIRMED = 3
#: How far settings are refined beyond that: to an error relative to the limit, or to so many seconds.
FINEST, LONGEST = 1e-6, 0.02


@dataclass(frozen=True, eq=False)
class Trial:
    """A method at one setting: the error at the times, relative to the displacement there, and what it costs."""

    name: str
    method: str
    setting: str
    error: float
    steps: int
    evaluations: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Cost:
    """paper: at the paper's own settings, by its names; cheapest: of each method below the limit; curves: (error,
    seconds) of each method at all settings tried. largest_error_time: of each of the paper's cases, s.
    """

    limit: float
    paper: tuple[Trial, ...]
    cheapest: tuple[Trial, ...]
    curves: dict[str, tuple[Vector, Vector]]
    largest_error_time: dict[str, float]

    def numbers(self) -> dict[str, float]:
        """What claims may name."""
        rows = {row.name: row for row in self.paper}
        base = rows["ODE45"]
        found = {f"cost.error.{name}": row.error for name, row in rows.items()}
        found |= {f"cost.time_factor.{name}": row.seconds / base.seconds for name, row in rows.items()}
        found |= {f"cost.evaluations_factor.{name}": row.evaluations / base.evaluations for name, row in rows.items()}
        found["cost.least_time_factor"] = min(row.seconds for row in self.paper if row is not base) / base.seconds
        found |= {f"cost.largest_error_time.{name}": time for name, time in self.largest_error_time.items()}
        own = {row.method: row for row in self.cheapest}
        steps = {row.method: float(row.setting.split()[1]) for row in self.cheapest if row.setting.startswith("step")}
        found |= {f"cost.step_needed.{method}": step for method, step in steps.items()}
        for method in ("heun", "rk4"):
            found[f"cost.evaluations_factor_at_limit.{method}"] = own[method].evaluations / own["ode45"].evaluations
        return found


def cost(settings: CostSettings, studies: Studies, progress: Callable[[float], None] | None = None) -> Cost:
    """Measure the paper's cases and look for the cheapest setting of every method."""
    trials = _Trials(studies.study(settings.study), settings)
    paper = tuple(trials.row(name, each.method, each.options) for name, each in settings.paper.items())
    names = [name for name in methods() if name not in ("exact", "euler")]
    cheapest, curves = [], {}
    for k, name in enumerate(names):
        rows = list(trials.search(name))
        curves[name] = (np.array([row.error for row in rows]), np.array([row.seconds for row in rows]))
        cheapest += _first_below(rows, settings.limit)
        if progress is not None:
            progress((k + 1) / len(names))
    cheapest.append(trials.row("exact", "exact", {}))
    times = {name: trials.largest_error_time(each) for name, each in settings.paper.items()}
    return Cost(settings.limit, paper, tuple(sorted(cheapest, key=lambda row: row.seconds)), curves, times)


def _first_below(rows: list[Trial], limit: float) -> list[Trial]:
    """The loosest setting that is below the limit, with all tried behind it."""
    good = [row.error <= limit for row in rows]
    return next(([rows[k]] for k in range(len(rows)) if all(good[k:])), [])


class _Trials:
    def __init__(self, study: Study, settings: CostSettings) -> None:
        self._study, self._settings = study, settings
        exact = self._run("exact", {})
        self._exact = self._values(exact)
        self._size = np.abs(self._exact - exact[settings.quantity][0])

    def search(self, method: str) -> Iterator[Trial]:
        """Ever finer settings, until a few in a row are below the limit and the last is far below, or slow."""
        below = 0
        for options in _options(method):
            try:
                row = self.row(method, method, options)
            except IntegrationError:
                continue
            below = below + 1 if row.error <= self._settings.limit else 0
            yield row
            if below > CONFIRMED and (row.error <= FINEST * self._settings.limit or row.seconds > LONGEST):
                return

    def row(self, name: str, method: str, options: dict[str, Any]) -> Trial:
        """A method at a setting, with the least time of some runs."""
        solution = self._run(method, options)
        seconds = solution.statistics.wall_time
        for _ in range(self._settings.repeats - 1):
            seconds = min(seconds, self._run(method, options).statistics.wall_time)
        error = float((np.abs(self._values(solution) - self._exact) / self._size).max())
        counts = solution.statistics
        return Trial(name, method, _setting(options), error, counts.steps, counts.evaluations, seconds)

    def largest_error_time(self, given: MethodSettings) -> float:
        """When the error of the quantity is largest, to 2 ms."""
        start, end = self._study.span
        times = {"output_times": np.linspace(start, end, round((end - start) / 2e-3) + 1)}
        runs = (
            self._study.run(method=method, **{**options, **times})
            for method, options in ((given.method, given.options), ("exact", {}))
        )
        one, other = runs
        return float(one.t[np.argmax(np.abs(one[self._settings.quantity] - other[self._settings.quantity]))])

    def _run(self, method: str, options: dict[str, Any]) -> Solution:
        return self._study.run(method=method, **{"output_times": self._settings.times, **options})

    def _values(self, solution: Solution) -> Vector:
        places = np.searchsorted(solution.t, np.array(self._settings.times) - 1e-9)
        return np.array(solution[self._settings.quantity][places])


def _options(method: str) -> list[dict[str, Any]]:
    if methods()[method].adaptive:
        return [{"rtol": rtol, "atol": ABSOLUTE * rtol} for rtol in TOLERANCES]
    return [{"step": step} for step in STEPS]


def _setting(options: dict[str, Any]) -> str:
    names = ("step", "rtol", "first_step", "max_step")
    return ", ".join(f"{name} {options[name]:.3g}" for name in names if name in options) or "no setting"
