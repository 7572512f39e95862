"""A run as frames, stills and animations."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.reader import sample
from qddot.runner.inputs.signal import InputTable
from qddot.runner.load import Model
from qddot.runner.scene.animation import Animation, Clip
from qddot.runner.scene.frames import Frames, frames, parts

if TYPE_CHECKING:
    from qddot.runner.pictures.figures import Drawn

Numbers = NDArray[np.float64]
#: Gives states (n, n_states), or input channels (n, n_channels), at times (n,), s.
Course = Callable[[Numbers], Numbers]

#: Moments of a frame: what acts for one of them is in the frame. Frames of a run that shows a moment of it.
_MOMENTS, _STILL = 4, 200
#: Frames of a run at least and at most, and a second.
_LEAST, _MOST, _RATE = 240, 1500, 50


@dataclass(frozen=True, eq=False)
class Filmed:
    """What is needed to draw a run from start to end, s: its model, constants, states and input channels over time.

    table: of the inputs, from which the road is known that is travelled; None where only their values are.
    """

    model: Model
    constants: Numbers
    start: float
    end: float
    states: Course
    channels: Course
    table: InputTable | None = None

    def animation(self, title: str = "", *, linked: bool = False, begin: float | None = None) -> Animation:
        """The run as an animation that stands at `begin`, s, first. Raises SceneError."""
        count = int(min(_MOST, max(_LEAST, _RATE * (self.end - self.start)))) if self.end > self.start else 1
        film = _every(self._frames(np.linspace(self.start, self.end, _MOMENTS * (count - 1) + 1)), _MOMENTS)
        return Animation(title or self.model.tables.title, (Clip("", film),), linked, begin)

    def still(self, t: float, title: str = "") -> "Drawn":
        """The moment t, s, of the run as a figure whose sides are those of the whole run.

        Raises SceneError, ValueError for a time outside the run.
        """
        from qddot.runner.scene.still import still  # noqa: PLC0415 - matplotlib is slow to import

        if not self.start <= t <= self.end:
            raise ValueError(f"t is {t:g} s, but the run goes from {self.start:g} to {self.end:g} s")
        times = np.union1d(np.linspace(self.start, self.end, _STILL), [t])
        return still(self._frames(times), int(np.searchsorted(times, t)), title)

    def _frames(self, t: Numbers) -> Frames:
        return frames(self.model, self.constants, t, self.states(t), self.channels(t), self.table)


def filmed(model: Model, c: Numbers, table: InputTable, span: tuple[float, float], states: Course) -> Filmed:
    """A run with constants c and these inputs, its states as a function of time, over a span in s."""

    def channels(t: Numbers) -> Numbers:
        found = np.zeros((len(t), len(table.first)))
        sample(table, np.ascontiguousarray(t), found)
        return found

    return Filmed(model, c, *span, states, channels, table)


def on_lines(t: Numbers, values: Numbers) -> Course:
    """What has values (n, m) at times t (n,), in any order, and goes on straight lines between them."""
    order = np.argsort(t, kind="stable")

    def course(times: Numbers) -> Numbers:
        columns = [np.interp(times, t[order], column[order]) for column in values.T]
        return np.array(columns).reshape(len(columns), len(times)).T

    return course


def _every(film: Frames, moments: int) -> Frames:
    """Every frame of so many moments; what is shown for a moment only, and the longest arrow, from all around it."""
    if len(film.t) <= moments:
        return film
    kept = slice(None, None, moments)
    near = np.arange(0, len(film.t), moments)[:, None] + np.arange(-(moments // 2), moments // 2)
    near = np.clip(near, 0, len(film.t) - 1)
    numbers = film.numbers[kept].copy()
    rows = np.arange(len(numbers))
    for (shape, all_values), (_, values) in zip(film.parts(), parts(film.shapes, numbers), strict=True):
        if shape.conditional:
            values[:, -1] = all_values[near, -1].max(axis=1)
        if shape.kind == "arrow":
            longest = np.argmax(np.hypot(all_values[near, 2], all_values[near, 3]), axis=1)
            values[:, 2:4] = all_values[near[rows, longest], 2:4]
    return replace(film, t=film.t[kept], numbers=numbers, way=film.way[kept])
