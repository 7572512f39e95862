"""Events: moments when a function of time, state and inputs crosses zero, located on the dense output of a step.

    Event(function)              function(t, x, u, c) -> float, jitted, x (n_states,), u inputs, c constants
    StateCrossing(state, level)  a state crosses a level
    OutputCrossing(...)          an output of the model crosses a level

A rising crossing goes from below zero to zero or above; a value that starts at zero has not crossed.
`Trajectory.extras` keeps an `EventLog` as "events".
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.checks import direction, flag, shown
from qddot.runner.frame.search import FUNCTION, OUTPUT, STATE, WATCH
from qddot.runner.machine.memory import address, record
from qddot.runner.machine.pointers import EVENT_SIGNATURE, pointer


@dataclass(frozen=True, kw_only=True)
class _Watched:
    """What all events say. direction: 1 rising, -1 falling, 0 both. terminal: the run ends there."""

    direction: int = 0
    terminal: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        """Check the direction."""
        direction(f"event {self.name!r}: direction", self.direction)
        flag(f"event {self.name!r}: terminal", self.terminal)


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


def watch_for(events: Sequence[Any], n_states: int) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """What the compiled loop watches for, and the arrays it points into. Raises ValueError for what is no event."""
    return _watch_for(events, n_states) if events else _watch_for_nothing()


@cache
def _watch_for_nothing() -> tuple[np.void, dict[str, NDArray[Any]]]:
    """What most runs watch for; nobody writes to it."""
    return _watch_for((), 0)


def _watch_for(events: Sequence[Any], n_states: int) -> tuple[np.void, dict[str, NDArray[Any]]]:
    rows = [_row(f"events[{i}]", event, n_states) for i, event in enumerate(events)]
    columns = list(zip(*rows, strict=True)) or [()] * 5
    kernels = {id(event.outputs): event for event in events if isinstance(event, OutputCrossing)}
    if len(kernels) > 1:
        raise ValueError("the output crossings of a run name different output kernels; expected one")
    n_outputs = max((event.count for event in kernels.values()), default=0)
    arrays: dict[str, NDArray[Any]] = {
        **{
            name: np.array(columns[i], dtype=np.int64)
            for i, name in enumerate(("kind", "place", "direction", "terminal"))
        },
        "level": np.array(columns[4], dtype=np.float64),
        **{name: np.zeros(len(events)) for name in ("before", "after", "theta")},
        "y": np.zeros(n_outputs),
    }
    watch = record(WATCH, count=len(events), n_outputs=n_outputs)
    for event in kernels.values():
        watch["outputs"] = pointer(event.outputs, abi.VECTOR_KERNEL, "the kernel of an output crossing")
    for name, array in arrays.items():
        watch[name] = address(array)
    return watch, arrays


def _row(name: str, event: Any, n_states: int) -> tuple[int, int, int, bool, float]:
    if isinstance(event, Event):
        return FUNCTION, pointer(event.function, EVENT_SIGNATURE, name), event.direction, event.terminal, 0.0
    if isinstance(event, StateCrossing):
        kind, place, size = STATE, event.state, n_states
    elif isinstance(event, OutputCrossing):
        kind, place, size = OUTPUT, event.output, event.count
    else:
        raise ValueError(f"{name} is {shown(event)}, expected an Event, a StateCrossing or an OutputCrossing")
    if not 0 <= place < size:
        raise ValueError(f"{name} names number {place}, expected 0 to {size - 1}")
    return kind, place, event.direction, event.terminal, event.level
