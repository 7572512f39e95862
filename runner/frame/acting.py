"""Runs of models whose events act: each stretch up to such an event is a run of its own, from the state that it gave.

What an event gives is computed from the state just before; several at one instant act one after the other, in the
order of the model. A state kept on constraints is put back on them where the next stretch begins. Saved at the instant
of an event is the state behind it, as at a jump of an input the limit from the right.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.events import ActingCrossing, EventLog, names_of
from qddot.runner.frame.search import crossed
from qddot.runner.inputs.reader import sample
from qddot.runner.load import Model
from qddot.runner.options import Options
from qddot.runner.problem import Acting, Problem, Statistics, Status, Trajectory

if TYPE_CHECKING:
    from qddot.runner.method import Method

Vector = NDArray[np.float64]

#: Acts of one event, each sooner after the one before, behind which the last are this part of the first apart: its
#: times come to a limit.
PILE, LIMIT = 8, 1e-6
#: Acts at one instant, after which events only set each other off.
MOST_AT_ONCE = 100
#: Spacings of floating-point time on each side of an instant, within which events are at once.
AT_ONCE = 64


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch between events that act: from x (n_states,) at t0, so many steps, to the time `end`.

    first_step: that it began with, s, where it was not the options' own.
    """

    t0: float
    x: Vector
    steps: int
    end: float
    first_step: float | None = None


def integrate_acting(problem: Problem, acting: Acting, method: "Method", options: Options) -> Trajectory:
    """The trajectory of a problem whose model has events that act; extras["stretches"]: a `Stretch` each.

    Raises ValueError where the run goes backward: what an event did cannot be undone.
    """
    if problem.t1 < problem.t0:
        raise ValueError(f"the run goes backward, and what event {acting.rows[0].name} does cannot be undone")
    run = _Run(problem, acting, method, options)
    while run.go_on():
        pass
    return run.joined()


class _Run:
    """The stretches so far, and where the next begins."""

    def __init__(self, problem: Problem, acting: Acting, method: "Method", options: Options) -> None:
        self._problem, self._acting, self._method, self._options = problem, acting, method, options
        self._t, self._x = float(problem.t0), np.array(problem.initial_state, dtype=np.float64)
        self._found: list[Trajectory] = []
        self._stretches: list[Stretch] = []
        self._acts: list[list[float]] = [[] for _ in acting.rows]
        self._at_once: list[tuple[float, int, Vector]] = []
        self._status, self._acted, self._piled = Status.RUNNING, False, ""
        self._own = tuple(_own_events(acting))

    def go_on(self) -> bool:
        """Run a stretch and let the event at its end act; whether there is another."""
        start = replace(self._problem, t0=self._t, initial_state=self._x)
        options = self._left_of_options()
        found = self._method.integrate(start, self._method, options)
        self._found.append(found)
        steps, end = found.statistics.steps, float(found.t[-1])
        self._stretches.append(Stretch(self._t, self._x, steps, end, options.first_step))
        self._status, self._acted, log = found.status, False, found.extras["events"]
        last = int(log.event[-1]) - len(self._options.events) if len(log.event) else -1
        if found.status is not Status.TERMINATED or last < 0:
            return False
        self._t, self._x, self._acted = float(found.t[-1]), found.states[-1].copy(), True
        if not self._act(last):
            return False
        if self._t >= self._problem.t1:
            self._status = Status.FINISHED
            return False
        return True

    def _left_of_options(self) -> Options:
        """Those of the next stretch: what is left of the limits, and no first step longer than since the last act."""
        given, changed = self._options, dict[str, Any]()
        if given.output_times is not None:
            changed["output_times"] = given.output_times[given.output_times > self._t]
        if given.max_steps is not None:
            changed["max_steps"] = max(1, given.max_steps - sum(stretch.steps for stretch in self._stretches))
        if given.time_limit is not None:
            spent = sum(found.statistics.wall_time for found in self._found)
            changed["time_limit"] = max(1e-3, given.time_limit - spent)
        if (progress := given.progress) is not None:
            t0, span = self._problem.t0, self._problem.t1 - self._problem.t0
            done, left = (self._t - t0) / span, (self._problem.t1 - self._t) / span
            changed["progress"] = lambda part: progress(done + left * part)
        times = next((times for times in self._acts if times and times[-1] == self._t), [])
        if len(times) > 1 and self._method.adaptive and times[-1] > times[-2]:
            changed["first_step"] = min(given.first_step or np.inf, times[-1] - times[-2])
        return replace(given, events=(*self._events_to_come(), *self._own), **changed)

    def _events_to_come(self) -> Iterator[Any]:
        """The events that were asked for; those that end the run at a later crossing know of the earlier ones."""
        for i, event in enumerate(self._options.events):
            if int(event.terminal) > 1:
                seen = sum(int(np.count_nonzero(found.extras["events"].event == i)) for found in self._found)
                yield replace(event, terminal=int(event.terminal) - seen)
            else:
                yield event

    def _act(self, first: int) -> bool:
        """Let an event act, and those that happen at the same instant or are set off; whether the run goes on."""
        waiting, count = sorted({first, *self._simultaneous()}), 0
        while waiting:
            k = waiting.pop(0)
            row, before = self._acting.rows[k], self._values(self._t, self._x)
            if k != first or count > len(self._acting.rows):
                self._at_once.append((self._t, k, self._x.copy()))
            for place, value in zip(self._acting.places[k], before[self._acting.first[k] :], strict=False):
                self._x[place] = value
            self._acts[k].append(self._t)
            count += 1
            if row.terminal:
                return False
            if count > MOST_AT_ONCE or _piles_up(self._acts[k]):
                self._status, self._piled = Status.PILED_UP, row.name
                return False
            after = self._values(self._t, self._x)
            found = sorted({*self._crossing(before, after), *self._pressed(after)})
            waiting += [j for j in found if j != k and j not in waiting]
        return True

    def _pressed(self, now: Vector) -> list[int]:
        """Events of one direction that are at zero, to rounding, and go that way now: what touches is pushed on."""
        near, slope = self._soon()
        late = self._values(self._t + near, self._x + near * slope)
        rows = enumerate(zip(self._acting.rows, now, late - now, strict=False))
        return [k for k, (row, at, move) in rows if row.sets and row.direction * move > 0 and abs(at) <= abs(move)]

    def _soon(self) -> tuple[float, Vector]:
        """A time that is next to nothing, and the slope of the state."""
        passed = max(abs(self._t), self._t - self._stretches[-1].t0)
        slope = np.zeros(len(self._x))
        self._acting.rhs(self._t, self._x, self._inputs(self._t), self._problem.constants, slope)
        return AT_ONCE * np.spacing(passed), slope

    def _simultaneous(self) -> list[int]:
        """Events that cross zero at this instant, to the resolution of time."""
        near, slope = self._soon()
        early, late = (self._values(self._t + way * near, self._x + way * near * slope) for way in (-1.0, 1.0))
        return self._crossing(early, late)

    def _crossing(self, before: Vector, after: Vector) -> list[int]:
        """Events that act between two rows of values."""
        return [
            k
            for k, row in enumerate(self._acting.rows)
            if (row.sets or row.terminal) and crossed.py_func(before[k], after[k], row.direction)
        ]

    def _values(self, t: float, x: Vector) -> Vector:
        values = np.zeros(self._acting.count)
        self._acting.kernel(t, x, self._inputs(t), self._problem.constants, values)
        return values

    def _inputs(self, t: float) -> Vector:
        u = np.zeros((1, max(1, len(self._problem.inputs.first))))
        sample(self._problem.inputs, np.array([t]), u)
        row: Vector = u[0]
        return row

    def joined(self) -> Trajectory:
        """All stretches as one trajectory."""
        times, states = [found.t for found in self._found], [found.states for found in self._found]
        if self._acted:
            states[-1] = np.concatenate([states[-1][:-1], self._x[None]])
        wanted = self._options.output_times
        for k in range(len(times) - 1):
            times[k], states[k] = times[k][:-1], states[k][:-1]
            if wanted is not None and not np.isin(times[k + 1][0], wanted):
                times[k + 1], states[k + 1] = times[k + 1][1:], states[k + 1][1:]
        extras = {"events": self._log(), "stretches": tuple(self._stretches), "piled_up": self._piled}
        counts = [found.statistics for found in self._found]
        total = {each.name: sum(getattr(count, each.name) for count in counts) for each in fields(Statistics)}
        return replace(
            self._found[-1],
            t=np.concatenate(times),
            states=np.concatenate(states),
            status=self._status,
            statistics=Statistics(**total),
            extras=extras,
        )

    def _log(self) -> EventLog:
        logs = [found.extras["events"] for found in self._found]
        first = len(self._options.events)
        t = np.concatenate([*(log.t for log in logs), [t for t, _, _ in self._at_once]])
        own = np.array([first + k for _, k, _ in self._at_once], dtype=np.int64)
        event = np.concatenate([*(log.event for log in logs), own])
        states = np.concatenate([*(log.states for log in logs), *(x[None] for _, _, x in self._at_once)])
        order = np.argsort(t, kind="stable")
        names = names_of((*self._options.events, *self._acting.rows))
        return EventLog(t[order], event[order], states[order], names)


def _own_events(acting: Acting) -> Iterator[ActingCrossing]:
    """The events of the model; those that act end a stretch."""
    for index, row in enumerate(acting.rows):
        yield ActingCrossing(
            direction=row.direction,
            terminal=row.terminal or bool(row.sets),
            name=row.name,
            events=acting.kernel,
            count=acting.count,
            index=index,
        )


def _piles_up(times: Sequence[float]) -> bool:
    """Whether an event comes sooner after the one before each time, and now very soon."""
    waits = np.diff(times[-PILE - 1 :])
    falling = len(waits) == PILE and bool((np.diff(waits) < 0.0).all())
    return falling and bool(waits[-1] < LIMIT * (times[-1] - times[0]))


def acting_of(model: Model) -> Acting | None:
    """The events of a model that act; None where it has no events."""
    rows = model.tables.events
    if not rows:
        return None
    sizes = [len(row.sets) for row in rows]
    first = tuple(len(rows) + sum(sizes[:k]) for k in range(len(rows)))
    places = tuple(tuple(map(model.state_names.index, row.sets)) for row in rows)
    return Acting(model.kernel("events"), model.kernel("rhs"), len(rows) + sum(sizes), rows, places, first)
