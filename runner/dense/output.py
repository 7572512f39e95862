"""A run between its saved points: the dense output of its method.

A run keeps what it saves and what it was made from. When somebody first asks for what lies between, it is made again,
by the same steps, and hands over the pieces of its dense output; these are kept where they are not too many.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.dense.extremes import EVALUATE, INPUTS, extremes, states_at, work_for
from qddot.runner.frame.backward import cover, mirrored, mirrored_options
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.projection import put_on
from qddot.runner.frame.turns import points
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.pointers import pointer
from qddot.runner.method import Method
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Status
from qddot.runner.result import Subject, values_at

Numbers = NDArray[np.float64]

#: Numbers in the pieces of a run that are kept: 64 MB.
MOST_KEPT = 8_000_000


@dataclass(frozen=True, eq=False)
class DenseOutput:
    """What a run is between the steps it takes; steps, end: how many it took, and its last time, s.

    subject, problem, method, options: what it was made from.
    """

    subject: Subject
    problem: Problem
    method: Method
    options: Options
    steps: int
    end: float
    _kept: list[tuple[Numbers, Numbers]] = field(default_factory=list, init=False, repr=False)

    def values_at(self, times: Numbers) -> Numbers:
        """States, outputs, inputs (m, n_quantities) at times (m,), s; at a jump the limit from the right."""
        return values_at(self.subject, self.problem, times, self._states_at(times))

    def _states_at(self, times: Numbers) -> Numbers:
        """The states (m, n_states) at times (m,); where two steps meet, those of the later one."""
        forward, found = self._sense * times, np.full((len(times), len(self._forward.initial_state)), np.nan)

        def take(t: Numbers, x: Numbers) -> None:
            here = (forward >= t[0, 0]) & (forward <= t[-1, -1])
            if here.any():
                states = np.empty((np.count_nonzero(here), x.shape[2]))
                _compiled_states()((t, x, points(t.shape[1] - 1)), forward[here], states)
                found[here] = states

        self._go_through(take)
        if self._forward.held is not None:
            put_on(self._forward, forward, found)
        return found

    def better(self, best: Numbers, start: float, end: float) -> None:
        """Better extremes (n_quantities, 4), least value and its time, greatest and its time, between two times.

        Of the quantities, states, outputs and inputs, in the order of the solution.
        """
        low, high = sorted((self._sense * start, self._sense * end))
        problem, kernel = self._forward, self.subject.output_kernel
        if kernel is not None:
            kernel = pointer(cover(kernel, "outputs") if self._sense < 0 else kernel, abi.VECTOR_KERNEL, "outputs")
        source = (
            kernel or 0,
            pointer(evaluate, EVALUATE, "evaluate"),
            problem.inputs,
            reader_for(problem.inputs),
            np.array(problem.constants),
        )
        found = np.array(best)
        found[:, 1::2] *= self._sense

        def take(t: Numbers, x: Numbers) -> None:
            degree = t.shape[1] - 1
            stride = degree if self.method.family == "fixed" else 1
            work = work_for(x.shape[2], len(found), len(problem.inputs.first))
            compiled_extremes()(source, (t, x, points(degree)), work, stride, low, high, found)

        self._go_through(take)
        found[:, 1::2] *= self._sense
        best[:] = found

    @property
    def _sense(self) -> float:
        return 1.0 if self.problem.t1 >= self.problem.t0 else -1.0

    @cached_property
    def _forward(self) -> Problem:
        return self.problem if self._sense > 0 else mirrored(self.problem)

    def _go_through(self, take: Callable[[Numbers, Numbers], None]) -> None:
        """Hand over the pieces, in order; raises KeyboardInterrupt where Ctrl-C ends the run that makes them."""
        if self._kept:
            take(*self._kept[0])
            return
        pieces: list[tuple[Numbers, Numbers]] = []
        size = 0

        def keep(t: Numbers, x: Numbers) -> None:
            nonlocal size
            size += x.size
            if size <= MOST_KEPT:
                pieces.append((t, x))
            else:
                pieces.clear()
            take(t, x)

        options = replace(self.options, events=(), progress=None, time_limit=None)
        options = options if self._sense > 0 else mirrored_options(options)
        recorder = Recorder(keep, self.steps, self._sense * self.end)
        if self.method.integrate(self._forward, self.method, options, recorder).status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        if pieces:
            self._kept.append((np.concatenate([t for t, _ in pieces]), np.concatenate([x for _, x in pieces])))


@dataclass(frozen=True, eq=False)
class Chain:
    """The dense outputs of stretches, one behind the other; where two meet, the later one counts."""

    parts: tuple[DenseOutput, ...]

    def values_at(self, times: Numbers) -> Numbers:
        """As that of a part."""
        which = np.searchsorted([float(part.problem.t0) for part in self.parts[1:]], times, side="right")
        rows = [part.values_at(times[which == k]) for k, part in enumerate(self.parts)]
        found = np.empty((len(times), rows[0].shape[1]))
        for k, values in enumerate(rows):
            found[which == k] = values
        return found

    def better(self, best: Numbers, start: float, end: float) -> None:
        """As that of a part, each within its own stretch."""
        for part in self.parts:
            low, high = max(start, float(part.problem.t0)), min(end, part.end)
            if low <= high:
                part.better(best, low, high)


_PIECES = types.Tuple((abi.MATRIX, types.Array(types.float64, 3, "C"), abi.VECTOR))


@cache
def _compiled_states() -> Any:
    return compiled(types.void(_PIECES, abi.VECTOR, abi.MATRIX), nogil=True)(states_at)


@cache
def compiled_extremes() -> Any:
    """`extremes`, compiled."""
    source = types.Tuple((types.int64, types.int64, INPUTS, abi.VECTOR, abi.VECTOR))
    work = typeof(work_for(1, 1, 1))
    scalars = (types.int64, types.float64, types.float64)
    return compiled(types.void(source, _PIECES, work, *scalars, abi.MATRIX), nogil=True)(extremes)
