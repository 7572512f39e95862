"""What ends soon, as a promise that a busy machine does not break."""

import time
from contextlib import contextmanager

from qddot.cycles import cycles_left_alone


@contextmanager
def within(seconds):
    """What is inside takes less than these seconds of its thread, without looks through all objects of the session."""
    with cycles_left_alone():
        begun = time.thread_time()
        yield
        assert time.thread_time() - begun < seconds
