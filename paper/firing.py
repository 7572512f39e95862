"""When to fire: what swings after the last of several shots, by their interval, and the best and worst burst."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from qddot import Solution, StudyError, metric
from qddot.paper.schema import FiringSettings
from qddot.paper.studies import Studies
from qddot.signal import pulse_train

Vector = NDArray[np.float64]

#: What stands for the crew's comfort: the vibration dose value (ISO 2631-1:1997, equation 5, for shocks) of the heave
#: acceleration, weighted by Wk, over the whole run, m/s^1.75; and the interval between its samples, s, which Wk needs.
DOSE, STEP = "vibration_dose", 0.0018

#: Generations and members per unknown of the search for a schedule (Storn, Price, J. Global Optim. 11 (1997) 341-359).
GENERATIONS, MEMBERS = 25, 8


@dataclass(frozen=True, eq=False)
class Series:
    """Shots at equal intervals (n,), s: the swing (n,) of each quantity after the last, by the number of shots."""

    shots: int
    intervals: Vector
    swings: Mapping[str, Vector]

    def worst(self, quantity: str) -> float:
        """The interval of the largest swing, between the samples by a parabola."""
        return _vertex(self.intervals, self.swings[quantity], int(np.argmax(self.swings[quantity])))

    def best(self, quantity: str) -> float:
        """The interval of the least swing."""
        return _vertex(self.intervals, self.swings[quantity], int(np.argmin(self.swings[quantity])))


@dataclass(frozen=True, eq=False)
class Burst:
    """The schedules of a burst with the least and the largest swing of a quantity: times (shots,), s, and swings."""

    quantity: str
    best: Vector
    best_swing: float
    worst: Vector
    worst_swing: float


@dataclass(frozen=True, eq=False)
class Firing:
    """Everything about when to fire.

    growth: at the paper's interval, the least ratio of the swings after the first three shots. comfort: of
    two shots, the swing at the paper's comfortable interval over that at its worst. units: of the quantities.
    """

    first: float
    series: tuple[Series, ...]
    bursts: tuple[Burst, ...]
    growth: Mapping[str, float]
    comfort: Mapping[str, float]
    units: Mapping[str, str]

    def numbers(self) -> dict[str, float]:
        """What claims may name."""
        found: dict[str, float] = {}
        for each in self.series:
            for quantity in each.swings:
                found[f"firing.{each.shots}_shots.worst_interval.{quantity}"] = each.worst(quantity)
                found[f"firing.{each.shots}_shots.best_interval.{quantity}"] = each.best(quantity)
        found |= {f"firing.paper_interval.growth.{quantity}": ratio for quantity, ratio in self.growth.items()}
        found |= {f"firing.comfortable_over_worst.{quantity}": ratio for quantity, ratio in self.comfort.items()}
        for burst in self.bursts:
            found[f"firing.burst.best_swing.{burst.quantity}"] = burst.best_swing
            found[f"firing.burst.worst_swing.{burst.quantity}"] = burst.worst_swing
        return found


def firing(settings: FiringSettings, studies: Studies, progress: Callable[[float], None] | None = None) -> Firing:
    """Measure the series and search for the schedules."""
    gun = Gun(settings, studies)
    intervals = np.linspace(settings.shortest, settings.longest, settings.points)
    jobs = len(settings.series) + len(settings.quantities)
    series, bursts = [], []
    for k, shots in enumerate(settings.series):
        rows = [gun.swings(settings.first + interval * np.arange(shots)) for interval in intervals]
        swings = {name: np.array([row[name] for row in rows]) for name in settings.quantities}
        series.append(Series(shots, intervals, swings))
        if progress is not None:
            progress((k + 1) / jobs)
    for k, quantity in enumerate(settings.quantities):
        bursts.append(_burst(settings, gun, quantity))
        if progress is not None:
            progress((len(series) + k + 1) / jobs)
    units = {name: gun.unit(name) for name in settings.quantities}
    return Firing(settings.first, tuple(series), tuple(bursts), _growth(settings, gun), _comfort(settings, gun), units)


def _growth(settings: FiringSettings, gun: "Gun") -> dict[str, float]:
    rows = [gun.swings(settings.first + settings.paper_interval * np.arange(shots)) for shots in (1, 2, 3)]
    return {name: min(rows[1][name] / rows[0][name], rows[2][name] / rows[1][name]) for name in settings.quantities}


def _comfort(settings: FiringSettings, gun: "Gun") -> dict[str, float]:
    best, worst = (
        gun.swings(settings.first + interval * np.arange(2))
        for interval in (settings.paper_comfortable, settings.paper_interval)
    )
    return {name: best[name] / worst[name] for name in settings.quantities}


class Gun:
    """The study's vehicle with its gun, fired at any times; the swing is the largest change after the last shot."""

    def __init__(self, settings: FiringSettings, studies: Studies) -> None:
        self._settings = settings
        self._vehicle = studies.study(settings.study)
        pulse = self._vehicle.tables.inputs.get("F")
        if pulse is None or pulse.kind != "pulse_train":
            raise StudyError(f"{self._vehicle.path}: inputs.F: expected a pulse_train, which is the gun")
        sizes = {name: getattr(pulse, name) for name in ("peak", "duration", "impulse")}
        self._pulse = {name: float(value) for name, value in sizes.items() if value is not None}
        self._shape = pulse.shape

    def run(self, times: NDArray[Any], step: float = 0.01) -> Solution:
        """The vehicle under shots at these times, s, saved every step, s."""
        inputs = {"F": pulse_train(self._shape, times=times, **self._pulse)}
        span = (self._vehicle.span[0], float(times.max()) + self._settings.after)
        return self._vehicle.run(method="exact", step=step, inputs=inputs, span=span)

    def swings(self, times: NDArray[Any], names: Sequence[str] = ()) -> dict[str, float]:
        """The swing of each quantity, all of the settings' by default."""
        names = names or self._settings.quantities
        solution = self.run(times, STEP if DOSE in names else 0.01)
        after = solution.t >= times.max()
        changes = {name: solution[name][after] - solution[name][0] for name in names if name != DOSE}
        found = {name: float(np.abs(change).max()) for name, change in changes.items()}
        return found | ({DOSE: dose(solution)} if DOSE in names else {})

    def unit(self, name: str) -> str:
        """The unit of a quantity."""
        if name == DOSE:
            return "m/s^1.75"
        return next(each.unit for each in self._vehicle.model.tables.outputs if each.name == name)


def _burst(settings: FiringSettings, gun: Gun, quantity: str) -> Burst:
    """Search the intervals of a burst, for the least and for the largest swing."""
    bounds = [(settings.burst_shortest, settings.burst_longest)] * (settings.burst - 1)

    def times(intervals: Vector) -> Vector:
        return settings.first + np.concatenate([[0.0], np.cumsum(intervals)])

    def search(sign: float) -> tuple[Vector, float]:
        rng = np.random.default_rng(settings.seed)
        options = {"maxiter": GENERATIONS, "popsize": MEMBERS, "tol": 1e-4, "polish": False, "rng": rng}
        found = differential_evolution(lambda x: sign * gun.swings(times(x), [quantity])[quantity], bounds, **options)
        return times(found.x), float(sign * found.fun)

    return Burst(quantity, *search(1.0), *search(-1.0))


def dose(solution: Solution) -> float:
    """The vibration dose value of the hull's heave over the whole run."""
    return metric(solution, "vdv", "heave_acceleration", interval=STEP, weighting="Wk")


def _vertex(x: Vector, y: Vector, k: int) -> float:
    """The place of the vertex of the parabola through sample k and its neighbours, equally spaced."""
    if not 0 < k < len(x) - 1:
        return float(x[k])
    bend = y[k - 1] - 2 * y[k] + y[k + 1]
    return float(x[k] - 0.5 * (y[k + 1] - y[k - 1]) / bend * (x[1] - x[0])) if bend else float(x[k])
