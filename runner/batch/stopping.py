"""Ctrl-C and SIGTERM as a wish that a batch sees between two blocks."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


class Wish:
    """Whether somebody wants the batch to stop."""

    def __init__(self) -> None:
        self.stop = False


@contextmanager
def stoppable(announce: Callable[[], None]) -> Iterator[Wish]:
    """Within the block, Ctrl-C or SIGTERM sets `stop` and announces it; a second one ends the process at once.

    That loses the blocks that are being computed, and nothing else. Outside the main thread signals stay as they are.
    """
    wish = Wish()

    def note(number: int, frame: Any) -> None:
        if wish.stop:
            os._exit(128 + number)
        wish.stop = True
        announce()

    if threading.current_thread() is not threading.main_thread():
        yield wish
        return
    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield wish
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
