"""The thin Python loop around a compiled one: progress, Ctrl-C and wall-clock limits act between two slices."""

import time
from collections.abc import Callable

from qddot.runner.problem import Status

#: Least seconds between two reports of progress.
REPORT_INTERVAL = 0.1
#: By their numbers: what looks one up in an enumeration takes ten times as long.
_STATUSES = tuple(Status)


def run_slices(
    one_slice: Callable[[], int],
    *,
    fraction_done: Callable[[], float],
    progress: Callable[[float], None] | None = None,
    time_limit: float | None = None,
) -> Status:
    """Call `one_slice` until it returns anything but Status.RUNNING, and return that.

    one_slice: runs one bounded slice of the integration and leaves its state where the next call finds it.
    fraction_done: the part of the span behind us, 0 to 1; handed to `progress` ten times a second and at the end.
    time_limit: seconds of wall time after which the run ends with Status.TIME_LIMIT; Ctrl-C ends it with
    Status.INTERRUPTED. Both keep what was computed. Neither can act inside a slice, so a slice should take
    milliseconds, not seconds. A division by zero in a function of the user's own ends it with Status.NON_FINITE.
    """
    start = time.perf_counter()
    reported = start
    status = Status.RUNNING
    try:
        while status is Status.RUNNING:
            status = _STATUSES[one_slice()]
            now = time.perf_counter()
            if progress is not None and (status is not Status.RUNNING or now - reported >= REPORT_INTERVAL):
                progress(fraction_done())
                reported = now
            if status is Status.RUNNING and time_limit is not None and now - start >= time_limit:
                status = Status.TIME_LIMIT
    except KeyboardInterrupt:
        return Status.INTERRUPTED
    except ZeroDivisionError:  # of a function that its author compiled by Python's rules; ours follow IEEE's
        return Status.NON_FINITE
    return status
