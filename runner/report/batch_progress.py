"""The progress of a batch: a bar where somebody watches, a line now and then where nobody does."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

#: Seconds between two lines where there is no terminal.
INTERVAL = 10.0


class BatchProgress:
    """Counts what is computed; `add` after each block, `say` for a word in between."""

    def __init__(self, total: int, done: int, failed: int) -> None:
        self.console = Console(stderr=True)
        self.total, self.before = total, done
        self.runs, self.failed, self.steps = done, failed, 0
        self._start = self._said = time.perf_counter()
        self._end: float | None = None
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("runs  {task.fields[rate]}  [red]{task.fields[failed]}[/red]"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=self.console,
            transient=True,
            disable=not self.console.is_terminal,
        )
        self._task = self._bar.add_task("preparing", total=total, completed=done, rate="", failed=self._failures())

    @property
    def seconds(self) -> float:
        """Wall time of computing."""
        return (self._end or time.perf_counter()) - self._start

    @property
    def rate(self) -> float:
        """Runs per second of this sitting."""
        return (self.runs - self.before) / max(self.seconds, 1e-9)

    def ready(self) -> None:
        """Preparing and compiling are over: the clock starts."""
        self._start = self._said = time.perf_counter()
        self._bar.update(self._task, description="computing")

    def stop(self) -> None:
        """Stop the clock."""
        self._end = time.perf_counter()

    def add(self, note: Mapping[str, Any]) -> None:
        """A block is finished, as its marker says."""
        self.runs += note["runs"]
        self.failed += note["failed"]
        self.steps += note["steps"]
        rate = f"{self.rate:.4g} runs/s"
        self._bar.update(self._task, completed=self.runs, rate=rate, failed=self._failures(), description="computing")
        now = time.perf_counter()
        if not self.console.is_terminal and now - self._said > INTERVAL:
            self._said = now
            left = (self.total - self.runs) / max(self.rate, 1e-9)
            self.console.print(f"{self.runs} of {self.total} runs, {rate}, {self.failed} failed, {left:.0f} s left")

    def say(self, text: str) -> None:
        """A word above the bar."""
        self.console.print(text, highlight=False, soft_wrap=True)

    def _failures(self) -> str:
        return f"{self.failed} failed" if self.failed else ""

    @contextmanager
    def shown(self) -> Iterator["BatchProgress"]:
        """Show the bar during a block."""
        with self._bar:
            yield self
