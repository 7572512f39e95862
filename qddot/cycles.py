"""Python's search for cycles of what refers to itself, put off while a lot is made that holds none or is needed."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def cycles_left_alone() -> Iterator[None]:
    """Within the block, and all that it calls, Python looks for no cycles; on the way out it does as it did before."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()
