"""When numba compiles: who waits for it is told once, and times of integration leave it out.

Numba broadcasts an event where it compiles a function, and none where it finds it in a cache: a warm run hears nothing.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event


class _Clock(event.Listener):
    """Seconds spent compiling in this process; what is compiled within another compilation counts once.

    Numba compiles one function at a time, under a lock. tell: called when the first one begins, once.
    """

    def __init__(self) -> None:
        self.seconds, self.tell = 0.0, None
        self._depth, self._since = 0, 0.0

    tell: Callable[[], None] | None

    def on_start(self, event: Any) -> None:
        """A function begins to be compiled."""
        if self._depth == 0:
            self._since = time.perf_counter()
            tell, self.tell = self.tell, None
            if tell is not None:
                tell()
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """It is compiled."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._since


_CLOCK = _Clock()
event.register("numba:compile", _CLOCK)


def compiled_for() -> float:
    """Seconds that this process has spent compiling."""
    return _CLOCK.seconds


def working_time() -> float:
    """A clock in s that stands still while numba compiles."""
    return time.perf_counter() - _CLOCK.seconds


@contextmanager
def waiting_for_code() -> Iterator[None]:
    """A block in which another process compiles what this one waits for: it counts as compiling."""
    _CLOCK.on_start(None)
    try:
        yield
    finally:
        _CLOCK.on_end(None)


@contextmanager
def when_compiling(tell: Callable[[], None]) -> Iterator[None]:
    """Within a block, call `tell` when numba begins to compile: once, and not at all where everything is cached."""
    _CLOCK.tell = tell
    try:
        yield
    finally:
        _CLOCK.tell = None
