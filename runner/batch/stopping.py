"""Ctrl-C and SIGTERM as a wish that a batch sees between two blocks."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

#: What brings the cursor of a terminal back, which a bar hides.
_CURSOR = b"\x1b[?25h\n"


class Wish:
    """Whether somebody wants the batch to stop, and the number of the signal that said so."""

    def __init__(self) -> None:
        self.stop = False
        self.signal = 0


@contextmanager
def stoppable(announce: Callable[[int], None]) -> Iterator[Wish]:
    """Within the block, Ctrl-C or SIGTERM sets `stop` and announces its number; a second one ends the process at once.

    That loses the blocks that are being computed, and nothing else. Outside the main thread signals stay as they are.
    """
    wish = Wish()

    def note(number: int, frame: Any) -> None:
        if wish.signal:
            if os.isatty(2):
                os.write(2, _CURSOR)
            os._exit(128 + number)
        wish.stop, wish.signal = True, number
        announce(number)

    if threading.current_thread() is not threading.main_thread():
        yield wish
        return
    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield wish
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
