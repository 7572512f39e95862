"""A road under the axles: every input of a model that has a position reads the same road, each at its own time."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import finite, shown, unknown
from qddot.runner.inputs.instants import ROUNDING, apart
from qddot.runner.inputs.shapes import hermite
from qddot.runner.inputs.signal import AMPLITUDE, C2, C3, START, Signal, values_at
from qddot.runner.load import Model, Parameters, as_model

Vector = NDArray[np.float64]

#: Largest deviation in height, m, of a road under a vehicle of varying speed.
ACCURACY = 1e-6
#: Halvings of an interval in search of that accuracy.
MOST_HALVINGS = 30
#: Most cubics of a road at a varying speed.
MOST_PIECES = 300_000


def drive(
    model: Model,
    road: Signal,
    speed: float | Signal,
    *,
    parameters: Parameters = None,
    start: float = 0.0,
    positions: Mapping[str, float] | None = None,
    span: tuple[float, float] | None = None,
) -> dict[str, Signal]:
    """Signals of the model's inputs that have a position, for driving along a road: `inputs` of `simulate`.

    road: height over distance. speed: m/s, or a table of it over time in s (lines; `span` = (t0, t1) is then needed).
    start: where on the road the model's origin is at t = 0, m. positions: m ahead of the origin, where the model itself
    says nothing or something else. Raises ValueError naming the argument.
    """
    model = as_model(model)
    if not isinstance(road, Signal):
        raise ValueError(f"road is {shown(road)}, expected a signal: heights over the distance")
    if not (positions is None or isinstance(positions, Mapping)):
        raise ValueError(f"positions is {shown(positions)}, expected a mapping from inputs to m ahead of the origin")
    places = dict(model.positions(model.parameter_values(parameters)))
    inputs = model.tables.free_inputs
    for name, place in (positions or {}).items():
        if name not in inputs:
            raise ValueError(f"model {model.name}: {unknown('input', name, inputs)}")
        places[name] = finite(f"position of {name}", place)
    if not places:
        raise ValueError(
            f"model {model.name}: no input has a position on the road; give positions, such as {inputs[:1]}"
        )
    return roads_at(road, places, speed, start, span)


def roads_at(
    road: Signal,
    positions: Mapping[str, float],
    speed: float | Signal,
    start: float = 0.0,
    span: tuple[float, float] | None = None,
) -> dict[str, Signal]:
    """As `drive`, for positions by name. At a constant speed all signals share the road's pieces."""
    origin = finite("start", start)
    if not isinstance(speed, Signal):
        v = finite("speed", speed)
        return {name: road.shifted(v, origin + place) for name, place in positions.items()}
    if span is None:
        raise ValueError("a speed that varies needs the span of the run")
    if not isinstance(span, tuple | list | np.ndarray) or len(span) != 2:
        raise ValueError(f"span is {shown(span)}, expected (start, end)")
    span = finite("span: its start", span[0]), finite("span: its end", span[1])
    way = Way.of(speed, span)
    return {name: along(road, way, origin + place) for name, place in positions.items()}


class Way:
    """Distance over time for a speed of straight lines: x(t) = x_k + v_k s + a_k s^2 / 2, s = t - t_k, x(0) = 0.

    t (n + 1,): where the pieces join; x, v, a (n,). The vehicle never turns within a piece.
    """

    def __init__(self, t: Vector, v: Vector, a: Vector) -> None:
        h = np.diff(t)
        self.t, self.v, self.a = t, v, a
        travelled = np.concatenate([[0.0], np.cumsum(h * (v + a * h / 2))])
        self.x = travelled[:-1] - np.interp(0.0, t, travelled)
        self.ends = self.x + h * (v + a * h / 2)

    @property
    def range(self) -> tuple[float, float]:
        """The least and the greatest distance, m."""
        places = np.concatenate([self.x, self.ends])
        return float(places.min()), float(places.max())

    @classmethod
    def of(cls, speed: Signal, span: tuple[float, float]) -> "Way":
        """The way of a speed during a span that is widened to hold t = 0."""
        curved = (C2, C3, AMPLITUDE)
        if speed.pieces[:, curved].any() or (speed.rate, speed.offset) != (1.0, 0.0):
            raise ValueError("a speed over time is a table of straight lines")
        begin, end = min(span[0], 0.0), max(span[1], 0.0)
        knots = speed.pieces[:, START]
        t = np.unique(np.concatenate([[begin, 0.0, end], knots[(knots > begin) & (knots < end)]]))
        middle = (t[:-1] + t[1:]) / 2
        a = speed.derivative(middle)
        v = speed(middle) - a * (middle - t[:-1])
        with np.errstate(divide="ignore", invalid="ignore"):
            turns = np.where(a != 0, t[:-1] - v / a, np.nan)
        t = np.unique(np.concatenate([t, turns[(turns > t[:-1]) & (turns < t[1:])]]))
        middle = (t[:-1] + t[1:]) / 2
        a = speed.derivative(middle)
        return cls(t, speed(middle) - a * (middle - t[:-1]), a)

    def __call__(self, t: Vector, k: NDArray[np.int64]) -> tuple[Vector, Vector]:
        """Distance and speed at times t on pieces k."""
        s = t - self.t[k]
        return self.x[k] + s * (self.v[k] + s * self.a[k] / 2), self.v[k] + s * self.a[k]

    def crossings(self, places: Vector) -> Vector:
        """Times at which the vehicle passes these places, m."""
        found = []
        for k, (begin, end) in enumerate(zip(self.x, self.ends, strict=True)):
            sign = 1.0 if end >= begin else -1.0
            ahead = sign * (places - begin)
            ahead = ahead[(ahead > 0) & (ahead < sign * (end - begin))]
            v, a = sign * self.v[k], sign * self.a[k]
            found.append(self.t[k] + 2 * ahead / (v + np.sqrt(np.maximum(v * v + 2 * a * ahead, 0.0))))
        return np.concatenate(found)


def along(road: Signal, way: Way, offset: float, accuracy: float = ACCURACY) -> Signal:
    """The height over time at x = way + offset: cubics with the right values and slopes at their ends.

    They end wherever a piece of the road or of the speed does, so kinks and jumps stay where they are, and are halved
    until they are within `accuracy` (m) of road(x(t)) at three points inside. Of a road of straight lines they are
    exact.
    """
    places = (np.concatenate([road.pieces[1:, START], road.breakpoints]) - road.offset) / road.rate - offset
    knots = np.unique(np.concatenate([way.t, way.crossings(np.unique(places))]))
    least = 2.0**-52 * np.abs(knots).max()  # rounding of the way
    knots = knots[apart(knots) & (np.diff(knots, prepend=-np.inf) > least)]
    bends = way.crossings((road.breakpoints - road.offset) / road.rate - offset)
    left, right = knots[:-1], knots[1:]
    done: list[Vector] = []
    for halving in range(MOST_HALVINGS + 1):
        pieces, error = _fitted(road, way, offset, left, right)
        rough = (error > accuracy) if halving < MOST_HALVINGS else np.zeros(len(left), dtype=bool)
        done.append(pieces[~rough])
        if not rough.any():
            break
        middle = (left[rough] + right[rough]) / 2
        left, right = np.concatenate([left[rough], middle]), np.concatenate([middle, right[rough]])
        if len(left) > MOST_PIECES:
            raise ValueError(f"the road is too fine to be followed to {accuracy:g} m at a varying speed")
    pieces = np.concatenate(done)
    pieces = pieces[np.argsort(pieces[:, START])]
    starts = pieces[:, START]
    edges = np.concatenate([bends, way.t[1:-1]])
    places = np.searchsorted(starts, edges + np.maximum(least, ROUNDING * np.abs(edges)), "right") - 1
    return Signal(pieces, starts[np.unique(places)])


def _fitted(road: Signal, way: Way, offset: float, left: Vector, right: Vector) -> tuple[Vector, Vector]:
    """Cubics on intervals within one piece of road and speed, and their largest deviation from the road, m."""
    middle = (left + right) / 2
    k = np.clip(np.searchsorted(way.t, middle) - 1, 0, len(way.v) - 1)
    x, _ = way(middle, k)
    row = np.searchsorted(road.pieces[:, START], road.rate * (x + offset) + road.offset, "right") - 1
    rows = road.pieces[np.maximum(row, 0)]

    def height(t: Vector) -> tuple[Vector, Vector]:
        x, v = way(t, k)
        z, slope = values_at(rows, road.rate * (x + offset) + road.offset - rows[:, START])
        return z, slope * road.rate * v

    (z0, dz0), (z1, dz1) = height(left), height(right)
    pieces = hermite(left, right, np.stack([z0, z1], 1), np.stack([dz0, dz1], 1))
    error = np.zeros(len(left))
    for part in (0.25, 0.5, 0.75):
        s = part * (right - left)
        error = np.maximum(error, np.abs(values_at(pieces, s)[0] - height(left + s)[0]))
    return pieces, error
