"""Conditions of a model in time and parameters alone, as signals: on which side of each a run is, and from when on.

What changes sign there is the model's kernel `switching`, see `abi`. A straight line passes zero once. What has waves
in it is looked at 32 times a period of the fastest, other curves at a thousand instants; and where one of these is
nearest to zero between its neighbours, what lies between them is looked at, too.
"""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.shapes import constant
from qddot.runner.inputs.signal import Signal
from qddot.runner.load import Model
from qddot.runner.problem import FOREVER

Floats = NDArray[np.float64]

#: 0 before zero, 1 from there on.
_STEP = Signal(np.array([[-1.0, *7 * [0.0]], [0.0, 1.0, *6 * [0.0]]]), np.zeros(1))
#: How often a curve is looked at: in a period, at least, at most; golden sections.
_PER_PERIOD, _LEAST, _MOST, _SECTIONS = 32, 1000, 1_000_000, 60
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def sides(model: Model, c: Floats, t0: float, t1: float) -> dict[str, Signal]:
    """The signal of each side of a model with constants c (n_constants,) from t0 to t1, in either order.

    Raises ValueError where a curve turns too often within that time to be followed, or the time has no end.
    """
    names = model.tables.sides
    if not names:
        return {}
    value = _reader(model, c)
    return {name: _side(model, name, value, k, min(t0, t1), max(t0, t1)) for k, name in enumerate(names)}


def sides_of_runs(model: Model, c: Floats, t0: Floats, t1: Floats) -> dict[str, list[Signal]]:
    """The same for each run: c (runs, n_constants), t0 and t1 (runs,)."""
    names = model.tables.sides
    found = [sides(model, *each) for each in zip(c, t0.tolist(), t1.tolist(), strict=True)] if names else []
    return {name: [each[name] for each in found] for name in names}


def _reader(model: Model, c: Floats) -> Callable[[float], Floats]:
    """A function of time: of each side (n, 3) the switching function, its slope, and how it bends."""
    kernel, values = model.kernel("switching"), np.zeros((len(model.tables.sides), 3))

    def at(t: float) -> Floats:
        kernel(t, c, values.ravel())
        return values

    return at


def _side(model: Model, name: str, value: Callable[[float], Floats], k: int, start: float, end: float) -> Signal:
    if value(start)[k, 2] == 0.0:
        at_zero, slope, _ = value(0.0)[k].tolist()
        return _straight(at_zero, slope)
    if end - start >= FOREVER:
        meaning = next(each.meaning for each in model.tables.inputs if each.name == name)
        raise ValueError(f"model {model.name}: a condition in t is no straight line ({meaning}): give the run an end")

    def function(t: float) -> float:
        return float(value(t)[k, 0])

    times = _instants(model, name, value, k, start, end)
    return _signal(list(_changes(function, times)), function(start) > 0.0, start)


def _straight(at_zero: float, slope: float) -> Signal:
    """Where at_zero + slope t is positive."""
    if slope == 0.0:
        return constant(float(at_zero > 0.0))
    sign = math.copysign(1.0, slope)
    return _STEP.shifted(sign, sign * at_zero / slope)


def _instants(model: Model, name: str, value: Callable[[float], Floats], k: int, start: float, end: float) -> Floats:
    """The times at which a curve is looked at."""
    fastest = max(value(t)[k, 2] for t in np.linspace(start, end, _LEAST).tolist())
    periods = math.sqrt(max(fastest, 0.0)) * (end - start) / (2.0 * math.pi)
    count = max(_LEAST, math.ceil(_PER_PERIOD * periods)) if math.isfinite(periods) else _MOST + 1
    if count > _MOST:
        raise ValueError(
            f"model {model.name}: the condition of {name} turns {periods:.3g} times from t = {start:.9g} to {end:.9g}, "
            f"more than {_MOST // _PER_PERIOD}, which are followed; give the course as an input"
        )
    return np.linspace(start, end, count + 1 if end > start else 1)


def _changes(function: Callable[[float], float], times: Floats) -> Iterator[float]:
    """The times at which a function becomes positive or stops to be, rising."""
    instants = times.tolist()
    heights = [function(t) for t in instants]
    for i, (a, b) in enumerate(pairwise(instants)):
        if (heights[i] > 0.0) != (heights[i + 1] > 0.0):
            yield _change(function, a, b)
        elif i > 0 and _is_nearest(heights[i - 1 : i + 2]):
            turn = _turning(function, instants[i - 1], b)
            if (function(turn) > 0.0) != (heights[i] > 0.0):
                yield from (_change(function, instants[i - 1], turn), _change(function, turn, b))


def _is_nearest(three: list[float]) -> bool:
    """Whether the second of three heights on one side of zero is nearest to it."""
    signs = {height > 0.0 for height in three}
    return len(signs) == 1 and abs(three[1]) <= min(abs(three[0]), abs(three[2])) and abs(three[1]) < abs(three[0])


def _change(function: Callable[[float], float], a: float, b: float) -> float:
    """The first floating-point time, between a and b, from which on the sign is that at b: by halves."""
    before = function(a) > 0.0
    while a < (middle := 0.5 * (a + b)) < b:
        a, b = (middle, b) if (function(middle) > 0.0) == before else (a, middle)
    return b


def _turning(function: Callable[[float], float], a: float, b: float) -> float:
    """Where a function is nearest to zero between a and b, or beyond it: by golden sections."""
    side = math.copysign(1.0, function(a))
    c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
    for _ in range(_SECTIONS):
        at_c, at_d = side * function(c), side * function(d)
        if min(at_c, at_d) < 0.0:
            break
        if at_c < at_d:
            b, c, d = d, d - _GOLDEN * (d - a), c
        else:
            a, c, d = c, d, c + _GOLDEN * (b - c)
    return c if side * function(c) < side * function(d) else d


def _signal(changes: list[float], first: bool, start: float) -> Signal:
    if not changes:
        return constant(float(first))
    pieces = np.zeros((len(changes) + 1, 8))
    pieces[0, 0] = min(start, changes[0]) - (1.0 + abs(changes[0]))
    pieces[1:, 0] = changes
    pieces[:, 1] = (np.arange(len(pieces)) % 2) != first
    return Signal(pieces, np.array(changes))
