"""A progress bar that only appears where there is something to wait for."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from qddot.runner.machine.compiling import when_compiling

#: Seconds after which a run earns a bar.
_PATIENCE = 1.0


class LateBar:
    """Called with the fraction done; draws nothing during the first second, and nothing where nobody watches."""

    def __init__(self, what: str) -> None:
        self._columns = (TextColumn(what), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
        self._start = time.monotonic()
        self._console = Console(stderr=True)
        self._progress: Progress | None = None

    def __call__(self, fraction: float) -> None:
        """Show the fraction done, 0 to 1."""
        waiting = time.monotonic() - self._start > _PATIENCE and fraction < 1.0
        if self._progress is None and waiting and self._console.is_terminal:
            self._progress = Progress(*self._columns, console=self._console, transient=True)
            self._progress.add_task("", total=1.0)
            self._progress.start()
        if self._progress is not None:
            self._progress.update(self._progress.task_ids[0], completed=fraction)

    def close(self) -> None:
        """Take the bar away."""
        if self._progress is not None:
            self._progress.stop()


@contextmanager
def progress_bar(what: str) -> Iterator[LateBar]:
    """A bar for the length of a block."""
    bar = LateBar(what)
    try:
        yield bar
    finally:
        bar.close()


@contextmanager
def compilation_told() -> Iterator[None]:
    """Within a block, say so on the standard error where numba compiles: it takes from seconds to a minute."""

    def tell() -> (
        None
    ):  # sys.stderr of that moment: a bar that is shown puts its own in place, and the line above itself
        print("compiling, once for this model and method ...", file=sys.stderr, flush=True)

    with when_compiling(tell):
        yield
