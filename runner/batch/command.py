"""The commands of batches: what they print and write; each gives the exit status."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from runner.batch.export import export
from runner.batch.job import Job, read_job
from runner.batch.results import Results
from runner.batch.run import computed, opened, updated
from runner.batch.store import Store, StoreError
from runner.report.batch_progress import BatchProgress
from runner.report.batch_tables import counts, extremes_table, failures_table, metrics_table, valueless, wide_console
from runner.study.overrides import parsed

#: What the shell sees of a process that Ctrl-C ended.
INTERRUPTED = 130


def batch(
    study: Path,
    out: Path | None,
    settings: Sequence[str],
    workers: int | None,
    scheduler: str | None,
    fresh: bool,
    figure: bool,
) -> int:
    """Run the batch, or go on with it; print its summary and draw its figure. 1 where no run reached its end."""
    if workers is not None and workers < 1:
        raise ValueError(f"--workers {workers}: expected a number of processes, at least 1")
    job = read_job(study, parsed(settings))
    store = opened(job, out if out is not None else Path("results") / f"{study.stem}.zarr", fresh)
    progress = _compute(job, store, workers, scheduler)
    results = Results(store.path)
    console = wide_console()
    if progress.runs > progress.before:
        speed = f"{progress.rate:.4g} runs/s, {progress.steps / progress.seconds:.3g} steps/s"
        console.print(f"{progress.runs - progress.before} runs in {progress.seconds:.1f} s: {speed}", highlight=False)
    if progress.runs < progress.total:
        console.print(f"stopped after {counts(results)}: the same command goes on from there", highlight=False)
        return INTERRUPTED
    _print(console, results)
    console.print(f"wrote {store.path}", highlight=False, soft_wrap=True)
    if figure and len(results.finished) and results.axes:
        from runner.report.batch_figures import draw  # noqa: PLC0415 - matplotlib is slow to import

        console.print(f"wrote {draw(results, store.path.with_suffix('.png'))}", highlight=False, soft_wrap=True)
    return 0 if len(results.finished) else 1


def _compute(job: Job, store: Store, workers: int | None, scheduler: str | None) -> BatchProgress:
    notes = list(store.notes())
    done, failed = (sum(note[key] for note in notes) for key in ("runs", "failed"))
    progress = BatchProgress(len(job.sweep), done, failed)
    if 0 < done < progress.total:
        progress.say(f"going on with {store.path}: {done} of {progress.total} runs are there")
    if done < progress.total and (changed := updated(store)):
        progress.say(f"note: the store was begun with other versions ({', '.join(changed)}); last digits may differ")

    def announce() -> None:
        progress.say("stopping when the blocks that were begun are written; press Ctrl-C again to drop them")

    with progress.shown():
        try:
            for note in computed(job, store, workers, scheduler, announce, progress.ready):
                progress.add(note)
        except OSError as error:
            raise OSError(
                f"{store.path}: {error.strerror or error}; {progress.runs} of {progress.total} runs are safe: "
                "make room and give the same command, which goes on from there"
            ) from error
    progress.stop()
    return progress


def summary(store: Path) -> int:
    """Print how many runs there are and failed, the metrics, and the reasons of failures."""
    _print(wide_console(), Results(store))
    return 0


def _print(console: Console, results: Results) -> None:
    console.print(f"[bold]{results.title}[/bold]")
    console.print(counts(results), highlight=False)
    if results.metrics:
        console.print(metrics_table(results))
        console.print(extremes_table(results))
        for line in valueless(results):
            console.print(f"note: {line}", highlight=False, soft_wrap=True)
    if results.failures():
        console.print(failures_table(results))


def plot(store: Path, metrics: Sequence[str], over: Sequence[str], runs: str | None, into: Path | None) -> int:
    """Draw a figure of a store."""
    from runner.report.batch_figures import draw  # noqa: PLC0415 - matplotlib is slow to import

    results = Results(store)
    chosen = _runs(results, runs) if runs is not None else []
    name = "_runs" if chosen else ""
    path = draw(results, into or store.with_name(f"{store.stem}{name}.png"), metrics, over, chosen)
    Console().print(f"wrote {path}", highlight=False, soft_wrap=True)
    return 0


def _runs(results: Results, text: str) -> list[int]:
    """Runs from "0,5,17", "best" or "worst" (of the first metric)."""
    if text in ("best", "worst"):
        if not results.metrics or not len(results.finished):
            raise StoreError(f"--runs {text}: there is no metric of a finished run")
        return [int(results.best_first(results.metrics[0])[0 if text == "best" else -1])]
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts):
        raise StoreError(f"--runs {text!r}: expected numbers of runs such as 0,5,17, or best, or worst")
    return list(np.unique([int(part) for part in parts]))


def write_export(store: Path, to: Path) -> int:
    """Export the rows of a store."""
    Console().print(f"wrote {export(Results(store), to)}", highlight=False, soft_wrap=True)
    return 0
