"""Section 4 of paper 2116: the hull on a frozen plough at several speeds, with and without shots, on many random roads.

The model is linear, so what shots add is the same on every road: it is computed once, on level ground, and added.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot import Solution, Study, StudyError
from qddot.paper.schema import DrivingSettings
from qddot.paper.studies import Studies

Vector = NDArray[np.float64]

#: Quantiles that are told of every number.
QUANTILES = {"q05": 0.05, "median": 0.5, "q95": 0.95}
KMH = 1 / 3.6


@dataclass(frozen=True, eq=False)
class Speed:
    """One speed, km/h: per number of shots the ratio of the hull's amplitude to the road's on every road (roads,)."""

    speed: float
    ratios: Mapping[int, Vector]

    def added(self, shots: int) -> float:
        """The median change of the hull's amplitude by the shots, relative to that without."""
        return float(np.median(self.ratios[shots] / self.ratios[0] - 1.0))


@dataclass(frozen=True, eq=False)
class Ride:
    """One road at one speed for the figure: t (n,), s; road height under the centre of mass and heave (n,), m."""

    speed: float
    t: Vector
    road: Vector
    heave: Mapping[int, Vector]


@dataclass(frozen=True, eq=False)
class Driving:
    """speeds: of the paper; permissible (roads,): the speed, km/h, above which the hull outgrows the road."""

    speeds: tuple[Speed, ...]
    permissible: Vector
    samples: tuple[Ride, ...]
    fastest: float

    def numbers(self) -> dict[str, float]:
        """What claims may name."""
        found: dict[str, float] = {}
        for each in self.speeds:
            head = f"drive.{each.speed:g}"
            for shots, ratios in each.ratios.items():
                for name, level in QUANTILES.items():
                    found[f"{head}.shots_{shots}.ratio.{name}"] = float(np.quantile(ratios, level))
                found[f"{head}.shots_{shots}.added"] = each.added(shots)
            found[f"{head}.share_below_road"] = float(np.mean(each.ratios[0] <= 1.0))
        for name, level in QUANTILES.items():
            found[f"drive.permissible.{name}"] = float(np.quantile(self.permissible, level))
        return found


def driving(settings: DrivingSettings, studies: Studies, progress: Callable[[float], None] | None = None) -> Driving:
    """Drive over `roads` random roads at every speed. Raises StudyError where the model is not linear."""
    field = Field(settings, studies)
    speeds = sorted({*settings.speeds, *settings.more_speeds})
    shot = {speed: field.shots(speed) for speed in speeds}
    table = np.zeros((settings.roads, len(speeds)))
    ratios: dict[float, dict[int, list[float]]] = {v: {n: [] for n in settings.shots} for v in settings.speeds}
    samples = []
    for seed in range(settings.roads):
        for k, speed in enumerate(speeds):
            t, road, heave = field.ride(seed, speed)
            table[seed, k] = _amplitude(heave) / _amplitude(road)
            if speed in ratios:
                moved = {n: heave + shot[speed][n] for n in settings.shots}
                for n, values in moved.items():
                    ratios[speed][n].append(_amplitude(values) / _amplitude(road))
                if seed == settings.shown:
                    samples.append(Ride(speed, t, road, moved))
        if progress is not None:
            progress((seed + 1) / settings.roads)
    found = tuple(Speed(v, {n: np.array(values) for n, values in rows.items()}) for v, rows in ratios.items())
    permissible = np.array([_crossing(speeds, row) for row in table])
    return Driving(found, permissible, tuple(samples), max(speeds))


class Field:
    """The study's vehicle over a stretch of the field: every speed, km/h, covers the same distance."""

    def __init__(self, settings: DrivingSettings, studies: Studies) -> None:
        self._settings, self._vehicle = settings, studies.study(settings.study)
        if not self._vehicle.model.tables.linear:
            raise StudyError(f"{self._vehicle.path}: shots are added to the ride, which needs a linear model")

    def ride(self, seed: int, speed: float) -> tuple[Vector, Vector, Vector]:
        """Times (n,), road height under the middle axle and change of heave (n,), without shots."""
        solution = self._solution(self._at(seed, speed), {"F": 0.0})
        return np.array(solution.t), np.array(solution[self._settings.road]), self._change(solution)

    def ride_with_shots(self, seed: int, speed: float, times: Sequence[float]) -> Vector:
        """The change of heave (n,) of the ride with shots at these times, s, computed at once."""
        return self._change(self._solution(self._at(seed, speed, times), {}))

    def shots(self, speed: float) -> dict[int, Vector]:
        """The change of heave (n,) by each number of shots on level ground."""
        found = {}
        for count in self._settings.shots:
            times = [self._settings.first + k * self._settings.interval for k in range(count)]
            study = self._at(0, speed, times)
            level = {name: 0.0 for name in study.inputs if name != "F"}
            found[count] = self._change(self._solution(study, level if count else {**level, "F": 0.0}))
        return found

    def _at(self, seed: int, speed: float, times: Sequence[float] = ()) -> Study:
        changes = {"road.seed": seed, "road.speed": speed * KMH, "span": [0.0, self._settings.distance / (speed * KMH)]}
        return self._vehicle.changed(changes | ({"inputs.F.times": list(times)} if times else {}))

    def _solution(self, study: Study, inputs: Mapping[str, float]) -> Solution:
        """Saved at equal distances along the field, the same for every run at a speed."""
        times = np.linspace(0.0, study.span[1], self._settings.points)
        return study.run(method="exact", inputs=inputs, output_times=times)

    def _change(self, solution: Solution) -> Vector:
        heave = np.array(solution[self._settings.quantity])
        return heave - heave[0]


def _amplitude(values: Vector) -> float:
    """Half the height of the band that the values fill."""
    return 0.5 * float(values.max() - values.min())


def _crossing(speeds: Sequence[float], ratios: Vector) -> float:
    """The lowest speed at which the ratio exceeds 1, by a line between those tried; the highest where it never does."""
    above = np.flatnonzero(ratios > 1.0)
    if not len(above):
        return float(speeds[-1])
    k = int(above[0])
    if k == 0:
        return float(speeds[0])
    share = (1.0 - ratios[k - 1]) / (ratios[k] - ratios[k - 1])
    return float(speeds[k - 1] + share * (speeds[k] - speeds[k - 1]))
