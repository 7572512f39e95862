"""Where the energy of a run went: what it holds, what inputs put in, what is dissipated, and whether that adds up."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.stretches import channels_of, inputs_as_run
from qddot.runner.inputs.bind import bind
from qddot.runner.inputs.signal import Signal
from qddot.runner.load import Model, Parameters
from qddot.runner.observe import ENERGIES, observer
from qddot.runner.pictures.panel import Line, panel_of
from qddot.runner.pictures.picture import Picture
from qddot.runner.solution import Solution
from qddot.runner.switching import sides

Vector = NDArray[np.float64]

#: Points and weights of Gauss's rule on 0 to 1: a jump at the end of an interval is in none of them.
_PLACES = np.array([0.5 - 0.15**0.5, 0.5, 0.5 + 0.15**0.5])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


@dataclass(frozen=True, eq=False)
class Balance:
    """Energies in J at times t (n,) in s: kinetic, potential, and, since the start, put in and dissipated."""

    t: Vector
    kinetic: Vector
    potential: Vector
    put_in: Vector
    dissipated: Vector

    @property
    def error(self) -> float:
        """The largest of what is missing, in J: 0 if the run is exact and the work's integrals are."""
        held = self.kinetic + self.potential
        return float(np.abs(held - held[0] - self.put_in + self.dissipated).max())

    @property
    def size(self) -> float:
        """The largest energy that there is or that moves, in J."""
        held = self.kinetic + self.potential
        return float(max(np.abs(each).max() for each in (self.kinetic, held - held[0], self.put_in, self.dissipated)))


def balance(
    solution: Solution, model: Model, parameters: Parameters, inputs: Mapping[str, Signal | float]
) -> Balance | None:
    """The balance of a run of a model; None where a part of it is no finite number, or there is but one point."""
    if len(solution.t) < 2:
        return None
    shown = solution.closely
    t, c = np.array(shown.t), model.constants(model.parameter_values(parameters))
    table = bind(model.tables, inputs, sides(model, c, t[0], t[-1]))
    table = inputs_as_run(table, channels_of(model.tables), solution.extras or {}) or table
    watched = observer(model, [each.name for each in ENERGIES])

    def energies(times: Vector, states: Vector) -> Vector:
        return watched(times, np.ascontiguousarray(states[:, : solution.n_states]), table, c)

    found = energies(t, shown.values)
    steps = np.diff(t)
    if solution.between is None:
        powers = (found[1:, 2:] + found[:-1, 2:]) / 2
    else:
        inside = t[:-1, None] + steps[:, None] * _PLACES
        values = energies(inside.ravel(), solution.at(inside).values.reshape(-1, len(solution.quantities)))
        powers = np.einsum("ijk,j->ik", values[:, 2:].reshape(*inside.shape, 2), _WEIGHTS)
    works = np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:, None] * powers, axis=0)])
    if not (np.isfinite(found[:, :2]).all() and np.isfinite(works).all()):
        return None
    return Balance(t, found[:, 0], found[:, 1], put_in=works[:, 1], dissipated=works[:, 0])


def picture(found: Balance) -> Picture:
    """What the run holds since its start, and where it came from and went."""
    held = found.kinetic + found.potential
    named = {
        "kinetic": found.kinetic,
        "potential, since the start": found.potential - found.potential[0],
        "put in": found.put_in,
        "dissipated": found.dissipated,
        "sum: kinetic and potential, since the start": held - held[0],
    }
    lines = [Line(found.t, values, name, "J", "energies and works", name) for name, values in named.items()]
    return Picture("Energy", (panel_of(lines),))
