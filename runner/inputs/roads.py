"""Road profiles from formulas: signals whose argument is the distance along the road in m, and their height in m.

Before and behind what they describe they are level. `drive` brings them under the axles. A function here is a kind of
road in studies, too; its arguments are the keys.
"""

import numpy as np

from qddot.runner.checks import finite
from qddot.runner.inputs import shapes
from qddot.runner.inputs.formulas import Angle, Length
from qddot.runner.inputs.instants import check_resolved
from qddot.runner.inputs.signal import AMPLITUDE, C0, FREQUENCY, PHASE, START, Signal
from qddot.runner.inputs.tables import table


def sine(amplitude: Length, wavelength: Length, phase: Angle = 0.0, mean: Length = 0.0) -> Signal:
    """A wave without end: mean + amplitude*sin(2 pi x / wavelength + phase); lengths in m, phase in rad."""
    return shapes.sine(amplitude, 1 / _positive("wavelength", wavelength), phase, mean)


def ramp(height: Length, length: Length, at: Length = 0.0) -> Signal:
    """A slope that begins at `at` and climbs `height` over `length`, then level ground; m."""
    begin = finite("at", at)
    check_resolved("the ramp", begin, _positive("length", length), "m")
    return table([begin, begin + length], [0.0, finite("height", height)])


def step(height: Length, at: Length = 0.0, length: Length = 0.0) -> Signal:
    """A step up by `height` at `at`, m; with a length, a steep ramp, which a model that reads the road's rate needs."""
    if length != 0:
        return ramp(height, length, at)
    pieces = np.zeros((2, 8))
    pieces[0, START], pieces[1, START] = finite("at", at) - 1.0 - abs(at), at
    pieces[1, C0] = finite("height", height)
    return Signal(pieces, np.array([float(at)]))


def cosine_bump(height: Length, length: Length, at: Length = 0.0) -> Signal:
    """A bump height/2 (1 - cos(2 pi (x - at) / length)) from `at` to `at + length`, m; exact, with level ends."""
    begin, length = finite("at", at), _positive("length", length)
    check_resolved("the bump", begin, length, "m")
    pieces = np.zeros((3, 8))
    pieces[:, START] = begin - length, begin, begin + length
    pieces[1, C0], pieces[1, AMPLITUDE] = finite("height", height) / 2, height / 2
    pieces[1, FREQUENCY], pieces[1, PHASE] = 2 * np.pi / length, -np.pi / 2
    return Signal(pieces, np.array([begin, begin + length]))


def pothole(depth: Length, length: Length, at: Length = 0.0, edge: Length = 0.0) -> Signal:
    """A hole of `depth` from `at` to `at + length`, its ends slopes of length `edge` (0: upright), m."""
    depth, begin, length = finite("depth", depth), finite("at", at), _positive("length", length)
    if not 0 <= finite("edge", edge) <= length / 2:
        raise ValueError(f"edge is {edge}, expected a length from 0 to half of the hole's, {length / 2:g}")
    check_resolved("the hole", begin, length, "m")
    if edge > 1e-9 * length:
        check_resolved("the edge of the hole", begin, edge, "m")
        x = np.array([0.0, edge, length - edge, length])
        corners, first = np.unique(x, return_index=True)
        return table(begin + corners, -depth * np.array([0.0, 1.0, 1.0, 0.0])[first])
    pieces = np.zeros((3, 8))
    pieces[:, START] = begin - length, begin, begin + length
    pieces[1, C0] = -depth
    return Signal(pieces, np.array([begin, begin + length]))


def _positive(name: str, value: float) -> float:
    if finite(name, value) <= 0:
        raise ValueError(f"{name} is {value}, expected a length greater than 0")
    return float(value)
