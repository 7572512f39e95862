"""The progress of a batch: a bar where somebody watches, a line now and then where nobody does."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from qddot.runner.machine.compiling import working_time

#: Seconds between two lines where there is no terminal.
INTERVAL = 10.0


class BatchProgress:
    """Counts what is computed; `add` after each block, `say` for a word in between."""

    def __init__(self, total: int, done: int, failed: int) -> None:
        self.console = Console(stderr=True, markup=False)
        self.total, self.before = total, done
        self.runs, self.failed, self.steps = done, failed, 0
        self._start = self._said = working_time()
        self._end: float | None = None
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("runs  {task.fields[rate]}  [red]{task.fields[failed]}[/red]"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[left]}"),
            console=self.console,
            transient=True,
            disable=not self.console.is_terminal,
        )
        self._task = self._bar.add_task(
            "preparing", total=total, completed=done, rate="", left="", failed=self._failures()
        )

    @property
    def seconds(self) -> float:
        """Wall time of computing, without that of compiling."""
        return (self._end or working_time()) - self._start

    @property
    def rate(self) -> float:
        """Runs per second of this sitting."""
        return (self.runs - self.before) / max(self.seconds, 1e-9)

    @property
    def left(self) -> str:
        """`about 3 min left` at this sitting's rate: what was there before says nothing about it."""
        return f"about {_span((self.total - self.runs) / max(self.rate, 1e-9))} left"

    def ready(self) -> None:
        """Preparing and compiling are over: the clock starts."""
        self._start = self._said = working_time()
        self._bar.update(self._task, description="computing")

    def stop(self) -> None:
        """Stop the clock."""
        self._end = working_time()

    def add(self, note: Mapping[str, Any]) -> None:
        """A block is finished, as its marker says."""
        self.runs += note["runs"]
        self.failed += note["failed"]
        self.steps += note["steps"]
        rate = f"{self.rate:.4g} runs/s"
        said: dict[str, Any] = {"rate": rate, "left": self.left, "failed": self._failures()}
        self._bar.update(self._task, completed=self.runs, description="computing", **said)
        now = working_time()
        if not self.console.is_terminal and now - self._said > INTERVAL:
            self._said = now
            self.say(f"{self.runs} of {self.total} runs, {rate}, {self.failed} failed, {self.left}")

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


def _span(seconds: float) -> str:
    """`40 s`, `12 min`, `3.4 h` or `5.2 d`."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    if seconds < 7200:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 172_800 else f"{seconds / 86_400:.1f} d"
