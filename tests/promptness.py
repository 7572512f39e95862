"""What ends at once, as a promise that a busy machine does not break."""

import contextlib
import gc
import time

#: Seconds of a processor: many times what anything takes that ends at once, and far less than what never ends.
AT_ONCE = 10.0


@contextlib.contextmanager
def at_once(seconds=AT_ONCE):
    """What is inside takes less than these seconds of its thread, without looks through all objects of the session."""
    gc.disable()
    begun = time.thread_time()
    try:
        yield
        assert time.thread_time() - begun < seconds
    finally:
        gc.enable()
