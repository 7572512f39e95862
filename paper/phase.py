"""When to fire on rough ground: what swings after two shots, by the time of the first one and their interval.

The model is linear: the ride and the answer to one shot are computed once, and every pair of shots is their sum.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot import StudyError
from qddot.paper.schema import PhaseSettings
from qddot.paper.studies import Studies

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Phase:
    """first (n,), intervals (m,), s; swings (n, m): the largest change of the quantity after the second shot.

    unfired (n, m): the same of the ride without shots, in the same window. t, ride: its change over time; unit.
    """

    quantity: str
    unit: str
    first: Vector
    intervals: Vector
    swings: Vector
    unfired: Vector
    t: Vector
    ride: Vector

    def place(self, worst: bool) -> tuple[float, float]:
        """First shot and interval, s, with the least or the largest swing."""
        k = int(np.argmax(self.swings) if worst else np.argmin(self.swings))
        i, j = np.unravel_index(k, self.swings.shape)
        return float(self.first[i]), float(self.intervals[j])

    def numbers(self) -> dict[str, float]:
        """What claims may name."""
        found = {"phase.best_over_unfired": float((self.swings / self.unfired).min())}
        found["phase.worst_over_unfired"] = float((self.swings / self.unfired).max())
        for name, worst in (("best", False), ("worst", True)):
            found[f"phase.{name}_first"], found[f"phase.{name}_interval"] = self.place(worst)
        return found


def phase(settings: PhaseSettings, studies: Studies) -> Phase:
    """The map of swings. Raises StudyError where the model is not linear or the study is too short for the shots."""
    longest = settings.first[1] + settings.intervals[1] + settings.after
    vehicle = studies.study(settings.study, {**settings.set, "span": [0.0, longest + 2 * settings.step]})
    if not vehicle.model.tables.linear:
        raise StudyError(f"{vehicle.path}: shots are added to the ride, which needs a linear model")
    t = np.arange(0.0, longest + settings.step, settings.step)
    rough = vehicle.run(method="exact", inputs={"F": 0.0}, output_times=t)
    level = dict.fromkeys((name for name in vehicle.inputs if name != "F"), 0.0)
    shot = vehicle.changed({"inputs.F.times": [0.0]}).run(method="exact", inputs=level, output_times=t)
    ride, answer = (_change(solution[settings.quantity][: len(t)]) for solution in (rough, shot))
    first = np.arange(*settings.first, settings.step * settings.every)
    intervals = np.arange(*settings.intervals, settings.step * settings.every)
    swings, unfired = np.zeros((2, len(first), len(intervals)))
    window = round(settings.after / settings.step)
    for i, start in enumerate(first):
        one = round(start / settings.step)
        for j, interval in enumerate(intervals):
            two = one + round(interval / settings.step)
            moved = ride[two : two + window]
            fired = moved + answer[two - one : two - one + window] + answer[:window]
            swings[i, j], unfired[i, j] = np.abs(fired).max(), np.abs(moved).max()
    unit = next(each.unit for each in vehicle.model.tables.outputs if each.name == settings.quantity)
    return Phase(settings.quantity, unit, first, intervals, swings, unfired, t, ride)


def _change(values: Vector) -> Vector:
    return np.array(values) - values[0]
