"""Events: moments when a function of time, state and inputs crosses zero, located on the dense output of a step.

    Event(function)              function(t, x, u, c) -> float, jitted, x (n_states,), u inputs, c constants
    StateCrossing(state, level)  a state crosses a level
    OutputCrossing(...)          an output of the model crosses a level

A rising crossing goes from below zero to zero or above; a value that starts at zero has not crossed.
`Trajectory.extras` keeps an `EventLog` as "events".

What is found. The state within a step is the method's dense output, a polynomial (of third degree in a step of constant
length). All its crossings of a level are found, however many lie in a step. Other functions are followed at so many
points of a step that a polynomial of twice that degree stands for them, in up to MOST_PARTS parts of the step; all
crossings of that polynomial are found, and where they are is sought on the function itself. A pair of crossings may be
missed where the function comes no farther beyond zero than the error of the dense output, or that of the polynomial,
which is to say in a function that turns faster within a step than the state, such as one of time alone: limit the step.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.checks import direction, shown, terminal
from qddot.runner.frame import turns
from qddot.runner.frame.search import ACTING, FUNCTION, OUTPUT, STATE, WATCH
from qddot.runner.machine.memory import address, record
from qddot.runner.machine.pointers import EVENT_SIGNATURE, pointer

#: Parts in which a step is followed at most, for functions that turn faster than the state; and the highest degree of a
#: polynomial that follows one, beyond which its coefficients would lose half of their digits.
MOST_PARTS, MOST_DEGREE = 64, 16


@dataclass(frozen=True, kw_only=True)
class _Watched:
    """What all events say. direction: 1 rising, -1 falling, 0 both.

    terminal: the run ends there; a number n ends it at the n-th crossing in this direction.
    """

    direction: int = 0
    terminal: bool | int = False
    name: str = ""

    def __post_init__(self) -> None:
        """Check direction and terminal."""
        direction(f"event {self.name!r}: direction", self.direction)
        terminal(f"event {self.name!r}: terminal", self.terminal)


@dataclass(frozen=True)
class Event(_Watched):
    """function(t, x, u, c) -> float crosses zero."""

    function: Any


@dataclass(frozen=True)
class StateCrossing(_Watched):
    """The state of this index crosses a level."""

    state: int
    level: float = 0.0


@dataclass(frozen=True)
class OutputCrossing(_Watched):
    """Output `output` of the kernel outputs(t, x, u, c, y), y (count,), crosses a level."""

    outputs: Any
    count: int
    output: int
    level: float = 0.0


@dataclass(frozen=True)
class ActingCrossing(_Watched):
    """Value `index` of the kernel events(t, x, u, c, v), v (count,), of a model crosses zero."""

    events: Any
    count: int
    index: int


@dataclass(frozen=True, eq=False)
class EventLog:
    """Events in order: t (n,) in s, event (n,) indices, states (n, n_states); names of all events watched for."""

    t: NDArray[np.float64]
    event: NDArray[np.int64]
    states: NDArray[np.float64]
    names: tuple[str, ...]

    def times(self, name: str) -> NDArray[np.float64]:
        """When the event of this name happened."""
        if name not in self.names:
            raise ValueError(f"no event {name!r} was watched for; expected one of {', '.join(map(repr, self.names))}")
        return self.t[self.event == self.names.index(name)]


def names_of(events: Sequence[Any]) -> tuple[str, ...]:
    """Names, event_1, event_2, ... where none is given."""
    return tuple(event.name or f"event_{i + 1}" for i, event in enumerate(events))


def watch_for(events: Sequence[Any], n_states: int, degree: int) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """What the compiled loop watches for, and the arrays it points into; degree: of the method's dense output.

    Raises ValueError for what is no event.
    """
    return _watch_for(events, n_states, degree) if events else _watch_for_nothing()


@cache
def _watch_for_nothing() -> tuple[np.void, dict[str, NDArray[Any]]]:
    """What most runs watch for; nobody writes to it."""
    return record(WATCH), {}


def _watch_for(events: Sequence[Any], n_states: int, degree: int) -> tuple[np.void, dict[str, NDArray[Any]]]:
    rows = [_row(f"events[{i}]", event, n_states) for i, event in enumerate(events)]
    kernels = {id(event.outputs): event for event in events if isinstance(event, OutputCrossing)}
    if len(kernels) > 1:
        raise ValueError("the output crossings of a run name different output kernels; expected one")
    acting = next((event for event in events if isinstance(event, ActingCrossing)), None)
    count, n_outputs = len(events), max((event.count for event in kernels.values()), default=0)
    n_acting = acting.count if acting is not None else 0
    dense, degree = degree, min(degree if all(row[0] == STATE for row in rows) else 2 * degree, MOST_DEGREE)
    parts = 1 if degree == dense else MOST_PARTS
    most = count * (1 + 2 * degree * parts)
    columns = dict(zip(("kind", "place", "direction", "terminal"), zip(*rows, strict=True), strict=True))
    arrays: dict[str, NDArray[Any]] = {
        **{name: np.array(column, dtype=np.int64) for name, column in columns.items()},
        "level": np.array([getattr(event, "level", 0.0) for event in events], dtype=np.float64),
        "points": turns.points(degree),
        "basis": turns.to_bernstein(degree),
        "tail": turns.to_tail(degree),
        **{name: np.zeros(count) for name in ("before", "after")},
        "values": np.zeros((degree + 1, count)),
        "coefficients": np.zeros(degree + 1),
        "turns": np.zeros(2 * degree),
        "stack": np.zeros(turns.room(degree)),
        "left": np.zeros(count, dtype=np.int64),
        "theta": np.zeros(most),
        "event": np.zeros(most, dtype=np.int64),
        "y": np.zeros(n_outputs),
        "acting_values": np.zeros(n_acting),
    }
    numbers = {"count": count, "n_outputs": n_outputs, "n_acting": n_acting, "degree": degree, "most": most}
    watch = record(WATCH, **numbers, shortest=1.0 / parts)
    if acting is not None:
        watch["acting"] = pointer(acting.events, abi.VECTOR_KERNEL, "events")
    watch["whole"] = degree >= dense
    for event in kernels.values():
        watch["outputs"] = pointer(event.outputs, abi.VECTOR_KERNEL, "the kernel of an output crossing")
    for name, array in arrays.items():
        watch[name] = address(array)
    return watch, arrays


def _row(name: str, event: Any, n_states: int) -> tuple[int, int, int, int]:
    """Kind, place, direction, and how many crossings end the run."""
    if isinstance(event, Event):
        return FUNCTION, pointer(event.function, EVENT_SIGNATURE, name), event.direction, int(event.terminal)
    if isinstance(event, ActingCrossing):
        return ACTING, event.index, event.direction, int(event.terminal)
    if isinstance(event, StateCrossing):
        kind, place, size = STATE, event.state, n_states
    elif isinstance(event, OutputCrossing):
        kind, place, size = OUTPUT, event.output, event.count
    else:
        raise ValueError(f"{name} is {shown(event)}, expected an Event, a StateCrossing or an OutputCrossing")
    if not 0 <= place < size:
        raise ValueError(f"{name} names number {place}, expected 0 to {size - 1}")
    return kind, place, event.direction, int(event.terminal)
