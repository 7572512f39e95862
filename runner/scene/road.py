"""The road that a model travels: known where inputs read it, each at its own place and time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.reader import sample
from qddot.runner.inputs.signal import InputTable
from qddot.runner.load import Model

Numbers = NDArray[np.float64]

#: How closely, m, the places at which inputs read the road agree with those that the model gives them.
_CLOSE = 1e-6


@dataclass(frozen=True, eq=False)
class Road:
    """Heights along a way that a model travels at a speed, m/s, to the right."""

    table: InputTable
    channel: int
    position: float
    speed: float

    def along(self, way: Numbers) -> Numbers:
        """Heights (m,) at places (m,), of which the model's origin is at speed * t at time t."""
        times = np.ascontiguousarray((way - self.position) / self.speed)
        values = np.empty((len(times), len(self.table.first)))
        sample(self.table, times, values)
        return values[:, self.channel]


def road_of(model: Model, c: Numbers, table: InputTable, names: Sequence[str]) -> Road | None:
    """The road that these inputs read at one speed; None where they read something else, or stand still.

    A single input must be read at another speed than time passes: else it is over time, and nobody travels.
    """
    channels = [channel.name for channel in model.tables.inputs]
    places = model.positions(c[: len(model.tables.parameters)])
    if not all(name in places for name in names):
        return None
    at, ahead = [channels.index(name) for name in names], np.array([places[name] for name in names])
    speed, begins = float(table.rate[at[0]]), table.offset[at] - ahead
    one = len({int(table.first[k]) for k in at}) == 1 and bool((table.rate[at] == speed).all())
    if not one or speed == 0.0 or np.ptp(begins) > _CLOSE * max(1.0, float(np.abs(begins).max())):
        return None
    if len(set(ahead.tolist())) == 1 and (speed, float(table.offset[at[0]])) == (1.0, 0.0):
        return None
    return Road(table, at[0], float(ahead[0]), speed)
