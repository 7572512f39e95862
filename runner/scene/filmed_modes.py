"""Modes as animations: a model that swings about a state as each of its modes does."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from qddot.runner.load import Model

if TYPE_CHECKING:
    from qddot.runner.scene.animation import Animation
    from qddot.runner.scene.frames import Frames

Numbers = NDArray[np.float64]

#: Frames of a period. How far a mode moves the places of its scene, in parts of its size; where that is measured.
_PERIOD, _MOVES, _SMALL = 60, 0.08, 1e-4
#: How often a mode that does not swing has fallen to 1/e at the end of its clip.
FALLS = 4.0
#: An entry of an eigenvector that is none beside the largest.
_NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class FilmedModes:
    """Modes to be drawn: shapes (n_states, n_modes) about a state (n_states,) of a model with inputs (n_channels,)."""

    model: Model
    constants: Numbers
    t: float
    state: Numbers
    inputs: Numbers
    shapes: NDArray[np.complex128]

    def animation(self, modes: Mapping[int, tuple[str, float, bool]]) -> "Animation":
        """Modes by number, as clips: name, period in s and whether it swings, of each. Raises SceneError."""
        from qddot.runner.scene.animation import Animation, Clip  # noqa: PLC0415 - most modes are not drawn

        clips = [
            Clip(name, self._frames(self._normed(k), period, swings), loop=True)
            for k, (name, period, swings) in modes.items()
        ]
        return Animation(f"{self.model.tables.title}: modes", tuple(clips))

    def _normed(self, k: int) -> NDArray[np.complex128]:
        """A shape whose largest coordinate is 1; where no coordinate moves, whose largest entry is."""
        shape, n = self.shapes[:, k].astype(complex), self.model.tables.coordinates
        still = np.abs(shape[:n]).max() <= _NOTHING * np.abs(shape).max()
        moving = shape if still else shape[:n]
        return shape / moving[np.argmax(np.abs(moving))]

    def _frames(self, shape: NDArray[np.complex128], period: float, swings: bool) -> "Frames":
        from qddot.runner.scene.frames import frames  # noqa: PLC0415 - most modes are not drawn

        t = np.linspace(0.0, period, _PERIOD + 1)
        turns = np.exp(2j * np.pi * t / period) if swings else np.exp(-FALLS * t / period) + 0j
        motion = np.real(turns[:, None] * shape)
        states = self.state + self._amplitude(motion) * motion
        return frames(self.model, self.constants, t, states, np.tile(self.inputs, (len(t), 1)))

    def _amplitude(self, motion: Numbers) -> float:
        """How much of a motion (n, n_states) moves places by a part of the size of the scene."""
        from qddot.runner.scene.frames import numbers_at, parts  # noqa: PLC0415 - most modes are not drawn

        states = self.state + _SMALL * np.concatenate([0.0 * motion[:1], motion, -motion])
        t, channels = np.full(len(states), self.t), np.tile(self.inputs, (len(states), 1))
        moved, size = 0.0, 0.0
        for shape, values in parts(
            self.model.tables.scene, numbers_at(self.model, self.constants, t, states, channels)
        ):
            if shape.kind not in ("ground", "arrow"):
                moved = max(moved, float(np.abs(values - values[0]).max()))
                size = max(size, float(np.ptp(values[0])))
        return _SMALL * _MOVES * max(size, 1e-3) / moved if moved else 0.0
