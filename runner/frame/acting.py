"""Runs of models whose events act: each stretch up to such an event is a run of its own, from the state that it gave.

What an event gives is computed from the state just before; several at one instant act one after the other, in the
order of the model. A state kept on constraints is put back on them where the next stretch begins. Saved at the instant
of an event is the state behind it, as at a jump of an input the limit from the right.

While contacts rest (see `contact`), a stretch takes other kernels, in which their gaps are constraints, and ends where
one of their forces comes to zero.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.contact import AT_ONCE, FLYING, Contacts, Instant
from qddot.runner.frame.events import ActingCrossing, EventLog, names_of
from qddot.runner.frame.search import crossed
from qddot.runner.frame.stretches import Stretch, channels_of
from qddot.runner.load import Model
from qddot.runner.options import Options
from qddot.runner.problem import Acting, Problem, Resting, Statistics, Status, Trajectory
from qddot.runner.tables import CONTACT, EVENT

if TYPE_CHECKING:
    from qddot.runner.method import Method

Vector = NDArray[np.float64]

#: Acts of one event, each sooner after the one before, behind which the last are this part of the first apart: its
#: times come to a limit.
PILE, LIMIT = 8, 1e-6
#: Acts at one instant, after which events only set each other off.
MOST_AT_ONCE = 1000
#: So many changes of what rests within this part of the time passed are chatter.
CHATTER, NO_TIME = 256, 1e-8


def integrate_acting(problem: Problem, acting: Acting, method: "Method", options: Options) -> Trajectory:
    """The trajectory of a problem whose model has events that act; extras["stretches"]: a `Stretch` each.

    Raises ValueError where the run goes backward: what an event did cannot be undone; or where it starts with a gap
    that is below zero.
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
        self._status, self._acted, self._piled, self._advice = Status.RUNNING, False, "", ""
        self._changes: list[float] = []
        self._at = Instant(problem, acting)
        tolerances = options.tolerances(len(self._x)) if method.adaptive else None
        self._contacts = Contacts(self._at, tolerances, options.step if method.family == "fixed" else None)
        self._may_rest = [k for k, row in enumerate(acting.rows) if row.kind == CONTACT]

    def go_on(self) -> bool:
        """Run a stretch and let the event at its end act; whether there is another."""
        if not self._stretches and self._contacts.impacts and not self._begin():
            return False
        options = self._left_of_options()
        stretch = Stretch(self._t, self._x, 0, self._t, options.first_step, self._contacts.signs)
        found = self._method.integrate(stretch.of(self._problem), self._method, options)
        self._stretches.append(replace(stretch, steps=found.statistics.steps, end=float(found.t[-1])))
        self._status, self._acted, log = found.status, False, found.extras["events"]
        last = int(log.event[-1]) - len(self._options.events) if len(log.event) else -1
        released = found.status is Status.TERMINATED and last in self._contacts.resting
        if released:  # it is no impact
            log = replace(log, t=log.t[:-1], event=log.event[:-1], states=log.states[:-1])
        self._found.append(replace(found, extras={**found.extras, "events": log}))
        if found.status is not Status.TERMINATED or last < 0:
            return False
        self._t, self._x, self._acted = float(found.t[-1]), found.states[-1].copy(), True
        if not self._act([] if released else [last], last if released else -1):
            return False
        if self._t >= self._problem.t1:
            self._status = Status.FINISHED
            return False
        return True

    def _begin(self) -> bool:
        """Let impacts act that happen at the start, and contacts rest that do; whether the run goes on."""
        self._status, self._acted = Status.TERMINATED, True
        if self._act(self._contacts.begin(self._t, self._x), -1, first=True):
            return True
        none = EventLog(np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, len(self._x))), ())
        whole = Trajectory(np.array([self._t]), self._x[None], self._status, Statistics(), extras={"events": none})
        self._found.append(whole)
        return False

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
        own = _own_events(
            self._acting, self._acting.resting().events if self._contacts.resting else self._acting.kernel
        )
        return replace(given, events=(*self._events_to_come(), *own), **changed)

    def _events_to_come(self) -> Iterator[Any]:
        """The events that were asked for; those that end the run at a later crossing know of the earlier ones."""
        for i, event in enumerate(self._options.events):
            if int(event.terminal) > 1:
                seen = sum(int(np.count_nonzero(found.extras["events"].event == i)) for found in self._found)
                yield replace(event, terminal=int(event.terminal) - seen)
            else:
                yield event

    def _act(self, waiting: list[int], released: int, *, first: bool = False) -> bool:
        """Let events act, those that happen at the same instant, or are set off, and contacts rest; False at an end.

        waiting: the event that ended the stretch, or those at the start of the run; released: the contact that let go.
        """
        told = set() if first else set(waiting)
        waiting = sorted({*waiting, *(() if first else self._simultaneous())} - {released})
        count = 0
        while waiting:
            k = waiting.pop(0)
            row, before = self._acting.rows[k], self._at.values(self._t, self._x)
            if k not in told or count > len(self._acting.rows):
                self._at_once.append((self._t, k, self._x.copy()))
            if row.kind == EVENT:
                for place, value in zip(self._acting.places[k], before[self._acting.first[k] :], strict=False):
                    self._x[place] = value
            else:
                self._contacts.strike(k, self._t, self._x, before, self._near())
            self._acts[k].append(self._t)
            count += 1
            if row.terminal:
                return False
            if count > MOST_AT_ONCE or (k not in self._may_rest and _piles_up(self._acts[k])):
                return self._end(f"event {row.name} comes sooner and sooner after the one before")
            after = self._at.values(self._t, self._x)
            found = sorted({*self._crossing(before, after), *self._pressed(after)})
            waiting += [j for j in found if j != k and j not in waiting]
        return not self._contacts.impacts or self._settle(released)

    def _end(self, why: str, advice: str = "") -> bool:
        """No stretch begins here, why, and what to do where that is not what one usually does."""
        self._status, self._piled, self._advice = Status.PILED_UP, why, advice
        return False

    def _settle(self, released: int) -> bool:
        """Let contacts rest that do; False where the method holds none, or they only chatter."""
        before = self._contacts.resting
        self._contacts.settle(self._t, self._x, self._near(), released)
        after = self._contacts.resting
        rows = self._acting.rows
        if after and self._method.family in FLYING:
            name = rows[min(after)].name
            why = f"contact {name} comes to rest, which {self._method.name} does not hold"
            return self._end(why, "choose a method that steps, such as dop853 or rk4")
        for k in sorted(after ^ before):
            place = len(rows) + 2 * self._may_rest.index(k) + (k in before)
            self._at_once.append((self._t, place, self._x.copy()))
            self._changes.append(self._t)
            since = self._changes[-CHATTER:]
            if len(since) == CHATTER and self._t - since[0] < NO_TIME * (self._t - self._problem.t0):
                return self._end(f"contact {rows[k].name} rests and parts again and again")
        return True

    def _pressed(self, now: Vector) -> list[int]:
        """Events of one direction that are at zero, to rounding, and go that way now: what touches is pushed on."""
        near, slope = self._soon()
        late = self._at.values(self._t + near, self._x + near * slope)
        rows = enumerate(zip(self._acting.rows, now, late - now, strict=False))
        found = {k for k, (row, at, move) in rows if row.sets and row.direction * move > 0 and abs(at) <= abs(move)}
        return sorted((found - {*self._may_rest}) | {*self._contacts.pressed(self._x, now, near)})

    def _near(self) -> float:
        """A time that is next to nothing."""
        start = self._stretches[-1].t0 if self._stretches else self._problem.t0
        return AT_ONCE * float(np.spacing(max(abs(self._t), self._t - start)))

    def _soon(self) -> tuple[float, Vector]:
        """Such a time, and the slope of the state."""
        return self._near(), self._at.slope(self._t, self._x)

    def _simultaneous(self) -> list[int]:
        """Events that cross zero at this instant, to the resolution of time."""
        near, slope = self._soon()
        early, late = (self._at.values(self._t + way * near, self._x + way * near * slope) for way in (-1.0, 1.0))
        return [k for k in self._crossing(early, late) if k not in self._contacts.resting]

    def _crossing(self, before: Vector, after: Vector) -> list[int]:
        """Events that act between two rows of values."""
        return [
            k
            for k, row in enumerate(self._acting.rows)
            if (row.sets or row.terminal) and crossed.py_func(before[k], after[k], row.direction)
        ]

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
        extras = {
            "events": self._log(),
            "stretches": tuple(self._stretches),
            "piled_up": self._piled,
            "advice": self._advice,
        }
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
        names += tuple(f"{self._acting.rows[k].name} {what}" for k in self._may_rest for what in ("rests", "parts"))
        return EventLog(t[order], event[order], states[order], names)


def _own_events(acting: Acting, kernel: Any) -> Iterator[ActingCrossing]:
    """The events of the model, as this kernel has them; those that act end a stretch."""
    for index, row in enumerate(acting.rows):
        yield ActingCrossing(
            direction=row.direction,
            terminal=row.terminal or bool(row.sets),
            name=row.name,
            events=kernel,
            count=acting.count,
            index=index,
        )


def _piles_up(times: Sequence[float]) -> bool:
    """Whether an event comes sooner after the one before each time, and now very soon."""
    waits = np.diff(times[-PILE - 1 :])
    falling = len(waits) == PILE and bool((np.diff(waits) < 0.0).all())
    return falling and bool(waits[-1] < LIMIT * (times[-1] - times[0]))


def acting_of(model: Model, resting: Callable[[], Resting]) -> Acting | None:
    """The events of a model that act; None where it has no events. resting: as `Acting` has it."""
    tables, rows = model.tables, model.tables.events
    if not rows:
        return None
    sizes = [len(row.sets) + (0 if row.kind == EVENT else 2) for row in rows]
    return Acting(
        kernel=model.kernel("events"),
        rhs=model.kernel("rhs"),
        count=len(rows) + sum(sizes),
        rows=rows,
        places=tuple(tuple(map(model.state_names.index, row.sets)) for row in rows),
        first=tuple(len(rows) + sum(sizes[:k]) for k in range(len(rows))),
        channels=channels_of(tables),
        inertia=model.matrix("constraints" if tables.constraints else "mass"),
        resting=resting,
    )
