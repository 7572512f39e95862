"""The log of a run: the stops it heads for, the times wanted, and the points and events written down on the way.

It knows neither the method nor its step control: a state is an address.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from qddot.runner.frame.events import EventLog, names_of
from qddot.runner.frame.output_times import check_points
from qddot.runner.frame.pieces import Recorder
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, address, floats, integers, layout, number_in, reading, record
from qddot.runner.problem import Problem, Statistics, Status, Trajectory, unchecked

#: Points that there is room for at first, beyond twice the wanted times; doubled whenever half of it is used up.
FIRST_ROOM = 8192
#: Ends of a run at a state that is not to be trusted.
FAILURES = (Status.NON_FINITE, Status.STEP_UNDERFLOW, Status.NEWTON_FAILURE)

#: stops (n_stops,), rising; stop: the next one. wanted (n_wanted,): times to save at, rising, within the span;
#: next_wanted. refine: points saved per step, 0 where only wanted times are; starts: not 0 where a step's start is one
#: more: pieces are recorded. saved_t, saved_x: `room` points of n
#: states each, of which `saved` are used; found_t, found_event, found_x: `event_room` events, `found` of them used.
LOG = layout(
    "n stops n_stops stop wanted n_wanted next_wanted refine starts saved_t saved_x room saved "
    "found_t found_event found_x event_room found"
)
POINTS, EVENTS = ("saved_t", "saved_x"), ("found_t", "found_event", "found_x")


class Used(NamedTuple):
    """Fields of the record that Python reads after each slice."""

    refine: int
    n_wanted: int
    next_wanted: int
    saved: int
    room: int
    found: int
    event_room: int


@dataclass(frozen=True, eq=False)
class Log:
    """The record that compiled loops write to, and the arrays it points into; recorder: where pieces go, not points.

    enlarged: names of the rooms that are larger than at first.
    """

    record: np.void
    arrays: dict[str, NDArray[Any]]
    recorder: Recorder | None = None
    enlarged: set[str] = field(default_factory=set)

    @cached_property
    def _read(self) -> Callable[[], tuple[int, ...]]:
        return reading(self.record, *Used._fields)

    @cached_property
    def _saved(self) -> Callable[[], int]:
        return number_in(self.record, "saved")

    @property
    def used(self) -> Used:
        """How much is written down, and how much there is room for."""
        return Used._make(self._read())

    def roomy(self, go_on: Callable[[], int], events: int) -> Callable[[], int]:
        """A slice that makes room for what the next one may write down: a step at first finds as much as it needs.

        events: of a step, at most.
        """

        def one_slice() -> int:
            status = go_on()
            if status == Status.RUNNING:
                self.make_room(events)
            return status

        return one_slice

    def make_room(self, events: int) -> None:
        """Double what is half full, or too small for what a step may write down, `events` events among it."""
        self._hand_over()
        used = self.used
        points = points_of_step.py_func(used.refine, used.n_wanted - used.next_wanted)
        for filled, size, more, name, names in (
            (used.saved, used.room, points, "room", POINTS),
            (used.found, used.event_room, events, "event_room", EVENTS),
        ):
            if 2 * filled >= size or filled + more > size:
                self._enlarge(filled, size, more, name, names)

    def _enlarge(self, filled: int, used: int, more: int, room: str, names: tuple[str, ...]) -> None:
        size = used
        while 2 * filled >= size or filled + more > size:
            size *= 2
        for name in names:
            old = self.arrays[name]
            self.arrays[name] = np.concatenate([old, np.zeros((size - used, *old.shape[1:]), old.dtype)])
            self.record[name] = address(self.arrays[name])
        self.record[room] = size
        self.enlarged.add(room)

    def save(self, t: float, x: NDArray[np.float64]) -> None:
        """Append a point, unless the last one is of this time, or pieces are recorded."""
        place = self._saved()
        if self.recorder is not None:
            self._hand_over()
        elif place == 0 or self.arrays["saved_t"][place - 1] < t:
            self.arrays["saved_t"][place], self.arrays["saved_x"][place] = t, x
            self.record["saved"] = place + 1

    def begin(self, x: NDArray[np.float64]) -> None:
        """Have the run start from another state."""
        self.arrays["saved_x"][0] = x

    def reusable(self, status: Status) -> bool:
        """Whether another run may write to it: this one did not fail, and has not made it large."""
        return (status is Status.FINISHED or status is Status.TERMINATED) and not self.enlarged

    def _hand_over(self) -> None:
        """Hand over the pieces that are written down, where pieces are."""
        if self.recorder is not None and (used := self.used).saved > 0:
            t, x = (self.arrays[name][: used.saved].copy() for name in POINTS)
            count = used.refine + 1
            self.recorder.take(t.reshape(-1, count), x.reshape(-1, count, x.shape[1]))
            self.record["saved"] = 0

    def trajectory(
        self,
        status: Status,
        statistics: Statistics,
        failure: Callable[[], tuple[float, int]],
        events: Sequence[Any] = (),
    ) -> Trajectory:
        """What is written down, with how the run ended; failure: tells when it failed, and which state, if it did.

        events: those watched for.
        """
        saved = self._saved()
        failed_at, failed_state = failure() if status in FAILURES else (np.nan, -1)
        extras: dict[str, Any] = {}
        if events:
            t_found, event, x_found = (self.arrays[name][: self.used.found].copy() for name in EVENTS)
            extras["events"] = EventLog(t_found, event, x_found, names_of(events))
        values = {
            "t": self.arrays["saved_t"][:saved].copy(),
            "states": self.arrays["saved_x"][:saved].copy(),
            "status": status,
            "statistics": statistics,
            "failed_at": failed_at,
            "failed_state": failed_state,
            "extras": extras,
        }
        return unchecked(Trajectory, values)


def log_for(
    problem: Problem,
    stops: NDArray[np.float64],
    wanted: NDArray[np.float64],
    *,
    refine: int = 0,
    events: int = 0,
    room: int | None = None,
    recorder: Recorder | None = None,
) -> Log:
    """A log with the start in it. events: of a step, at most; room: for points, where that is known beforehand.

    recorder: takes pieces of degree `refine` instead of points. Raises ValueError where that is more than there may be.
    """
    n = len(problem.initial_state)
    check_points(room or 0)
    room, event_room = FIRST_ROOM + 2 * len(wanted) if room is None else room, 8 + 2 * events
    arrays: dict[str, NDArray[Any]] = {
        "stops": stops,
        "wanted": wanted,
        "saved_t": np.empty(room),
        "saved_x": np.empty((room, n)),
        "found_t": np.zeros(event_room),
        "found_event": np.zeros(event_room, dtype=np.int64),
        "found_x": np.zeros((event_room, n)),
    }
    lengths = {"n_stops": len(stops), "n_wanted": len(wanted), "room": room, "event_room": event_room}
    places = {name: address(array) for name, array in arrays.items()}
    fields = record(LOG, n=n, refine=refine, starts=recorder is not None, **lengths, **places)
    log = Log(fields, arrays, recorder)
    log.save(float(problem.t0), problem.initial_state)
    return log


@compiled(**INLINE)
def points_of_step(refine, wanted):
    """Points for which a step needs room: its own, as many wanted times as are to come, and the last of the run."""
    return max(1, refine) + wanted + 1


@compiled(**INLINE)
def has_room(log, events):
    """Whether what another step writes down finds room, `events` events at most."""
    points = points_of_step(log.refine, log.n_wanted - log.next_wanted)
    return log.saved + points <= log.room and log.found + events <= log.event_room


@compiled(**LEAN)
def next_stop(log):
    """The next stop, infinite after the last."""
    return floats(log.stops, log.n_stops)[log.stop] if log.stop < log.n_stops else np.inf


@compiled(**LEAN)
def next_wanted(log):
    """The next wanted time, infinite after the last."""
    return floats(log.wanted, log.n_wanted)[log.next_wanted] if log.next_wanted < log.n_wanted else np.inf


@compiled(**LEAN)
def take_wanted(log, t):
    """Whether t is the next wanted time; if so it is no longer."""
    found = next_wanted(log) == t
    if found:
        log.next_wanted += 1
    return found


@compiled(**LEAN)
def save(log, t, where):
    """Append a point, its state at an address."""
    floats(log.saved_t, log.room)[log.saved] = t
    source, target = floats(where, log.n), floats(log.saved_x + 8 * log.n * log.saved, log.n)
    for i in range(log.n):
        target[i] = source[i]
    log.saved += 1


@compiled(**LEAN)
def save_event(log, t, event, where):
    """Append an event, the state then at an address."""
    floats(log.found_t, log.event_room)[log.found] = t
    integers(log.found_event, log.event_room)[log.found] = event
    source, target = floats(where, log.n), floats(log.found_x + 8 * log.n * log.found, log.n)
    for i in range(log.n):
        target[i] = source[i]
    log.found += 1
