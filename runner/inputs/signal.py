"""A signal: piecewise cubic plus sine in an argument tau = rate*t + offset, with its breakpoints.

One representation serves constants, sampled tables, pulse trains and roads. Five axles share one road table with five
offsets; a sweep over speed changes one rate.
"""

from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from qddot.extras import needed
from qddot.runner import notebook
from qddot.runner.checks import finite
from qddot.runner.inputs.piece import AMPLITUDE, C0, C1, C2, C3, FREQUENCY, PHASE, START, InputTable
from qddot.runner.inputs.reader import sample
from qddot.runner.pictures.panel import Line, panel_of
from qddot.runner.pictures.picture import Picture
from qddot.runner.pictures.points import points
from qddot.words import counted

if TYPE_CHECKING:
    from qddot.runner.pictures.figures import Drawn

#: Jump relative to the largest value that counts as a jump rather than rounding.
JUMP = 1e-9


@dataclass(frozen=True, eq=False)
class Signal:
    """value(t) of one input, in the unit of that input.

    pieces: (n, 8) float64, rows as named above, rising in START; the first holds before its start too, the last for
    ever.
    breakpoints: (m,) values of tau at which value or a low derivative jumps; every integrator lands on them.
    rate, offset: tau = rate*t + offset; rate may be negative or zero.
    """

    pieces: NDArray[np.float64]
    breakpoints: NDArray[np.float64]
    rate: float = 1.0
    offset: float = 0.0

    def __repr__(self) -> str:
        """How many pieces, from where to where, and how it is read."""
        starts = self.pieces[:, START]
        what = f"{counted(len(starts), 'piece')}, {counted(len(self.breakpoints), 'breakpoint')}"
        where = f", from {starts[0]:g} to {starts[-1]:g}" if len(starts) > 1 else ""
        read = "" if (self.rate, self.offset) == (1.0, 0.0) else f", read at {self.rate:g} t + {self.offset:g}"
        return f"<Signal of {what}{where}{read}>"

    def _repr_html_(self) -> str:
        """A small picture, in a notebook."""
        t = np.linspace(*self._reach(), 1000)
        return notebook.curve(t, self(t)) + f"<p>{escape(repr(self)[1:-1])}</p>"

    def plot(
        self, start: float | None = None, end: float | None = None, *, name: str = "value", unit: str = ""
    ) -> "Drawn":
        """A matplotlib Figure of its values from start to end, s; by default over all of its pieces and a little more.

        name, unit: of the vertical axis; a signal knows neither.
        Raises ValueError for an end that is not after the start, ModuleNotFoundError without the extra `report`.
        """
        with needed():
            from qddot.runner.pictures.figures import drawn  # noqa: PLC0415 - matplotlib is slow to import
        first, last = self._reach()
        low = first if start is None else finite("start", start)
        high = last if end is None else finite("end", end)
        if not low < high:
            raise ValueError(f"start is {low:g} s and end is {high:g} s, expected a start before the end")
        t, values = points(self, self.breakpoint_times(), (low, high))
        return drawn(Picture("", (panel_of([Line(t, values, name, unit)]),)))

    def _reach(self) -> tuple[float, float]:
        """Times, s, between which all of its pieces begin, and a tenth more to both sides."""
        ends = self.pieces[[0, -1], START]
        reach = max(float(np.ptp(ends)), 1.0)
        tau = ends + 0.1 * reach * np.array([-1.0, 1.0])
        t = np.sort((tau - self.offset) / self.rate) if self.rate else tau
        return float(t[0]), float(t[1])

    def shifted(self, rate: float = 1.0, offset: float = 0.0) -> "Signal":
        """The same signal read at rate*t + offset: a road under an axle at speed v is road.shifted(v, x_axle)."""
        return replace(self, rate=self.rate * rate, offset=self.rate * offset + self.offset)

    def breakpoint_times(self) -> NDArray[np.float64]:
        """Breakpoints as times (m,), rising; none where the argument stands still."""
        if self.rate == 0.0 or not len(self.breakpoints):
            return np.empty(0)
        return np.sort((self.breakpoints - self.offset) / self.rate)

    def __call__(self, t: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at times t, any shape."""
        return self._sample(t, 0)

    def derivative(self, t: float | NDArray[np.float64], order: int = 1) -> NDArray[np.float64]:
        """Time derivatives at times t, any shape."""
        return self._sample(t, order)

    def _sample(self, t: float | NDArray[np.float64], order: int) -> NDArray[np.float64]:
        times = np.array(t, dtype=np.float64)
        values = np.empty((times.size, 1))
        sample(stack([self], [order]), times.ravel(), values)
        return values.reshape(times.shape)


def values_at(rows: NDArray[np.float64], s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Value and derivative of each piece, rows (n, 8), at s (n,) behind its start."""
    angle = rows[:, FREQUENCY] * s + rows[:, PHASE]
    value = rows[:, C0] + s * (rows[:, C1] + s * (rows[:, C2] + s * rows[:, C3])) + rows[:, AMPLITUDE] * np.sin(angle)
    slope = rows[:, C1] + s * (2 * rows[:, C2] + 3 * s * rows[:, C3])
    return value, slope + rows[:, AMPLITUDE] * rows[:, FREQUENCY] * np.cos(angle)


def derivative_pieces(pieces: NDArray[np.float64]) -> NDArray[np.float64]:
    """The pieces, rows (n, 8), of the derivative by the argument."""
    found = pieces.copy()
    found[:, C0], found[:, C1], found[:, C2], found[:, C3] = pieces[:, C1], 2 * pieces[:, C2], 3 * pieces[:, C3], 0.0
    found[:, AMPLITUDE] *= pieces[:, FREQUENCY]
    found[:, PHASE] += 0.5 * np.pi
    return found


def jumps(pieces: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which pieces, rows (n, 8), do not begin where the ones before them end.

    A jump is more than rounding of the values, and more than they change within the spacing of the arguments there.
    """
    length = np.diff(pieces[:, START])
    (ends, slopes), (starts, slopes_after) = (
        values_at(pieces[:-1], length),
        values_at(pieces[1:], np.zeros(len(length))),
    )
    sizes = (ends, starts, pieces[:, AMPLITUDE])  # a half-sine is 0 at both ends, but for rounding
    largest = max(np.abs(each).max(initial=0.0) for each in sizes)
    across = np.spacing(np.abs(pieces[1:, START])) * (np.abs(slopes) + np.abs(slopes_after))
    return np.flatnonzero(np.abs(starts - ends) > JUMP * largest + across) + 1


def stack(signals: list[Signal], orders: list[int]) -> InputTable:
    """The input table of these channels; a piece array that several signals share is stored once."""
    places: dict[int, int] = {}
    blocks: list[NDArray[np.float64]] = []
    length = 0
    for signal in signals:
        if id(signal.pieces) not in places:
            places[id(signal.pieces)] = length
            blocks.append(signal.pieces)
            length += len(signal.pieces)
    first = np.array([places[id(signal.pieces)] for signal in signals], dtype=np.int64)
    last = first + np.array([len(signal.pieces) - 1 for signal in signals], dtype=np.int64)
    times = [signal.breakpoint_times() for signal in signals if signal.breakpoints.size]
    return InputTable(
        pieces=np.ascontiguousarray(np.concatenate(blocks) if blocks else np.empty((0, 8))),
        first=first,
        last=last,
        rate=np.array([signal.rate for signal in signals], dtype=np.float64),
        offset=np.array([signal.offset for signal in signals], dtype=np.float64),
        order=np.array(orders, dtype=np.int64),
        breakpoints=np.unique(np.concatenate(times)) if times else np.empty(0),
    )
