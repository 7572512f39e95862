"""One pulse, and the sum of equal pulses at several times.

Every pulse has knots of its own: the times at which its pieces join, its start plus where they join in the pulse. How
far a knot is behind that joint decides what the piece begins with, so that a pulse is at every time what its definition
says, to rounding, however far from zero. Only edges that are one time become one breakpoint.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import finite, numbers, shown
from qddot.runner.inputs.instants import apart, check_resolved
from qddot.runner.inputs.signal import AMPLITUDE, C0, C1, C2, C3, FREQUENCY, PHASE, START, Signal

#: A pulse is refused beyond these, in s: powers of its duration would overflow.
SHORTEST, LONGEST = 1e-30, 1e30
#: A knot may be earlier than the joint it stands for by this part of a duration, which is rounding of what was given.
EARLIER = 1e-9

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pulse:
    """A pulse from 0 to `duration`, zero outside; its sines, if any, all have one frequency.

    pieces (n, 8): as of a signal, the first from 0. edges (m,): where it is not smooth, its ends among them.
    """

    pieces: Vector
    edges: Vector
    duration: float

    def area(self) -> float:
        """Integral of the pulse, exactly that of its pieces."""
        rows = self.pieces
        s = np.diff(rows[:, START], append=self.duration)
        total = s * (rows[:, C0] + s * (rows[:, C1] / 2 + s * (rows[:, C2] / 3 + s * rows[:, C3] / 4)))
        waves = rows[rows[:, AMPLITUDE] != 0]
        phases = waves[:, PHASE] + waves[:, FREQUENCY] * s[rows[:, AMPLITUDE] != 0]
        turns = waves[:, AMPLITUDE] * (np.cos(waves[:, PHASE]) - np.cos(phases)) / waves[:, FREQUENCY]
        return float(total.sum() + turns.sum())

    def stretched(self, factor: float, times: float) -> "Pulse":
        """The pulse with its values times `factor`, lasting `times` as long; ValueError where that is no length."""
        if not SHORTEST <= times <= LONGEST:
            raise ValueError(f"the pulse lasts {times:g} s, expected {SHORTEST:g} to {LONGEST:g} s")
        rows = self.pieces.copy()
        rows[:, START] *= times
        for power, column in enumerate((C0, C1, C2, C3)):
            rows[:, column] *= factor / times**power
        rows[:, AMPLITUDE] *= factor
        rows[:, FREQUENCY] /= times
        return Pulse(rows, self.edges * times, self.duration * times)


def start_times(times: ArrayLike) -> Vector:
    """The times at which pulses start (n,), rising; raises ValueError where there is none or one is not finite."""
    starts = np.sort(np.atleast_1d(numbers("times", times, "one or more finite times at which pulses start")))
    if starts.ndim != 1 or starts.size == 0 or not np.isfinite(starts).all():
        raise ValueError(f"times is {shown(times)}, expected one or more finite times at which pulses start")
    return starts


def sized(pulse: Pulse, peak: float | None, duration: float | None, impulse: float | None) -> Pulse:
    """A pulse of duration 1 and peak 1 with two of peak, duration and impulse = integral as given."""
    given = {"peak": peak, "duration": duration, "impulse": impulse}
    known = {name: finite(name, value) for name, value in given.items() if value is not None}
    if len(known) != 2:
        found = " and ".join(known) or "none"
        raise ValueError(f"a pulse needs two of peak, duration and impulse; given: {found}")
    if known.get("duration", 1.0) <= 0:
        raise ValueError(f"duration is {duration}, expected a time greater than 0")
    if "peak" not in known:
        return pulse.stretched(known["impulse"] / (pulse.area() * known["duration"]), known["duration"])
    if "duration" in known:
        return pulse.stretched(known["peak"], known["duration"])
    if known["impulse"] * known["peak"] <= 0:
        raise ValueError(f"peak {peak} and impulse {impulse} must have the same sign and not vanish")
    return pulse.stretched(known["peak"], known["impulse"] / (pulse.area() * known["peak"]))


def train(pulse: Pulse, starts: Vector) -> Signal:
    """The sum of the pulses that start at `starts` (n,), rising; breakpoints are the edges of each.

    Sines of one frequency add up as phasors: an overlap of half-sines is exact, too. Raises ValueError for a pulse
    whose edges the spacing of floating-point numbers at its time does not tell apart.
    """
    farthest = starts[np.argmax(np.maximum(np.abs(starts), np.abs(starts + pulse.duration)))]
    check_resolved("times: the shortest part of the pulse", float(farthest), float(np.diff(pulse.edges).min()))
    joints = np.append(pulse.pieces[:, START], pulse.duration)
    knots, places = np.unique(_knots(starts, joints, pulse.duration), return_inverse=True)
    places = places.reshape(len(starts), len(joints))
    pieces = np.zeros((len(knots) + 1, 8))
    pieces[0, START], pieces[1:, START] = knots[0] - pulse.duration, knots
    phasors = np.zeros(len(pieces), dtype=np.complex128)
    for start, place in zip(starts, places, strict=True):
        covered = np.arange(place[0], place[-1])
        source = pulse.pieces[np.searchsorted(place, covered, side="right") - 1]
        s = np.maximum((knots[covered] - start) - source[:, START], 0.0)
        covered += 1
        pieces[covered, C0] += source[:, C0] + s * (source[:, C1] + s * (source[:, C2] + s * source[:, C3]))
        pieces[covered, C1] += source[:, C1] + s * (2 * source[:, C2] + 3 * s * source[:, C3])
        pieces[covered, C2] += source[:, C2] + 3 * s * source[:, C3]
        pieces[covered, C3] += source[:, C3]
        phasors[covered] += source[:, AMPLITUDE] * np.exp(1j * (source[:, FREQUENCY] * s + source[:, PHASE]))
    pieces[:, AMPLITUDE], pieces[:, PHASE] = np.abs(phasors), np.angle(phasors)
    pieces[:, FREQUENCY] = np.where(phasors != 0, pulse.pieces[:, FREQUENCY].max(), 0.0)
    edges = knots[np.unique(places[:, np.searchsorted(joints, pulse.edges)])]
    return Signal(pieces, edges[apart(edges)])


def _knots(starts: Vector, joints: Vector, duration: float) -> Vector:
    """Times (n, joints) at which the pieces of each pulse begin, and it ends: the first that are not too early."""
    knots = np.add.outer(starts, joints)
    early = (knots - starts[:, None]) - joints < -EARLIER * duration
    return np.where(early, np.nextafter(knots, np.inf), knots)
