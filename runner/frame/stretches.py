"""The stretches of a run between events that act, the problem of each, and that of the whole run, contacts among it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inputs.piece import C0, COLUMNS, START, InputTable
from qddot.runner.problem import Acting, Problem, Trajectory
from qddot.runner.tables import CONTACT, REST, Tables

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch between events that act: from x (n_states,) at t0, so many steps, to the time `end`.

    first_step: that it began with, s, where it was not the options' own. signs (n_events,): of contacts, what the
    inputs say of them; None where there are none.
    """

    t0: float
    x: Vector
    steps: int
    end: float
    first_step: float | None = None
    signs: Vector | None = None

    def of(self, problem: Problem) -> Problem:
        """The problem of this stretch of another."""
        own = replace(problem, t0=self.t0, initial_state=self.x)
        acting = problem.acting
        if self.signs is None or acting is None or not self.signs.any():
            return own
        own = replace(own, inputs=with_signs(own.inputs, acting.channels, np.array([self.t0]), self.signs[None]))
        return _at_rest(own, acting) if (self.signs > 0.0).any() else own

    def seen(self, problem: Problem) -> Problem:
        """The same for those who look at it: a contact rests, 1, or does not, 0."""
        return replace(self, signs=None if self.signs is None else np.maximum(self.signs, 0.0)).of(problem)


def _at_rest(problem: Problem, acting: Acting) -> Problem:
    """A problem with what it has while contacts rest."""
    found = acting.resting()
    return replace(problem, rhs=found.rhs, jacobian=found.jacobian, held=found.held)


def as_run(problem: Problem, trajectory: Trajectory) -> Problem:
    """The problem as it was run: its inputs say when contacts rested, and its kernels hold those that did."""
    acting = problem.acting
    inputs = None if acting is None else inputs_as_run(problem.inputs, acting.channels, trajectory.extras)
    if acting is None or inputs is None:
        return problem
    return _at_rest(replace(problem, inputs=inputs), acting)


def inputs_as_run(table: InputTable, channels: NDArray[np.int64], extras: Mapping[str, Any]) -> InputTable | None:
    """An input table that says when contacts rested; None where none did. channels: see `Acting`."""
    stretches: Sequence[Stretch] = extras.get("stretches", ())
    found = [each.signs for each in stretches if each.signs is not None]
    if not any((signs > 0.0).any() for signs in found):
        return None
    signs = np.maximum(np.array(found), 0.0)
    return with_signs(table, channels, np.array([each.t0 for each in stretches]), signs)


def channels_of(tables: Tables) -> NDArray[np.int64]:
    """Of each event the channel that says whether it rests, -1 where it cannot, (n_events,)."""
    rests = iter([k for k, channel in enumerate(tables.inputs) if channel.input == REST])
    return np.array([next(rests) if row.kind == CONTACT else -1 for row in tables.events], dtype=np.int64)


def with_signs(table: InputTable, channels: NDArray[np.int64], times: Vector, signs: Vector) -> InputTable:
    """An input table whose channels of contacts are signs (n, n_events) from times (n,) on."""
    rows, own = [k for k, channel in enumerate(channels) if channel >= 0], channels[channels >= 0]
    first, last, blocks, length = table.first.copy(), table.last.copy(), [table.pieces], len(table.pieces)
    rate, offset = table.rate.copy(), table.offset.copy()
    rate[own], offset[own] = 1.0, 0.0
    for k in rows:
        pieces = np.zeros((len(times), COLUMNS))
        pieces[:, START], pieces[:, C0] = times, signs[:, k]
        first[channels[k]], last[channels[k]] = length, length + len(times) - 1
        blocks.append(pieces)
        length += len(times)
    return table._replace(pieces=np.concatenate(blocks), first=first, last=last, rate=rate, offset=offset)
