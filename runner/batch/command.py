"""The commands of batches: what they print and write; each gives the exit status."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from rich.console import Console

from qddot.runner.batch.export import export
from qddot.runner.batch.job import Job, read_job
from qddot.runner.batch.results import Results
from qddot.runner.batch.run import check_workers, computed, opened, updated
from qddot.runner.batch.store import Store, StoreError, free
from qddot.runner.checks import unknown
from qddot.runner.files import named
from qddot.runner.report.batch_progress import BatchProgress
from qddot.runner.report.batch_tables import (
    counts,
    extremes_table,
    failures_table,
    metrics_table,
    valueless,
    wide_console,
)
from qddot.runner.stale import as_it_stands, begun_with, choosing, kept
from qddot.runner.study.overrides import parsed


def batch(
    study: Path,
    out: Path | None,
    settings: Sequence[str],
    workers: int | None,
    scheduler: str | None,
    fresh: bool,
    keep_kernels: bool,
    figure: bool,
) -> int:
    """Run the batch, or go on with it; print its summary and draw its figure. 1 where no run reached its end.

    A store that is there is gone on with by the kernels that it was begun with, see `_kernels`.

    128 and the number of a signal that stopped it, as a shell sees it: 130 for Ctrl-C, 143 for SIGTERM.
    """
    check_workers(workers, scheduler)
    path = out if out is not None else Path("results") / f"{study.stem}.zarr"
    with _kernels(path, fresh, keep_kernels):
        job = read_job(study, parsed(settings))
    store = opened(job, path, fresh)
    progress, stopped_by = _compute(job, store, workers, scheduler)
    results = Results(store.path)
    console = wide_console()
    if progress.runs > progress.before:
        speed = f"{progress.rate:.4g} runs/s, {progress.steps / progress.seconds:.3g} steps/s"
        console.print(f"{progress.runs - progress.before} runs in {progress.seconds:.1f} s: {speed}", highlight=False)
    if progress.runs < progress.total:
        said = f"stopped after {counts(results)}: the same command goes on from there"
        console.print(said, highlight=False, soft_wrap=True)
        return 128 + stopped_by
    _print(console, results)
    console.print(f"wrote {store.path}", highlight=False, soft_wrap=True)
    if figure and len(results.finished) and results.axes:
        from qddot.runner.report.batch_figures import draw  # noqa: PLC0415 - matplotlib is slow to import

        console.print(f"wrote {draw(results, picture_of(store.path))}", highlight=False, soft_wrap=True)
    return 0 if len(results.finished) else 1


def _kernels(path: Path, fresh: bool, keep: bool) -> AbstractContextManager[None]:
    """How kernels are chosen whose model changed since they were generated: for a store that is there none are made."""
    if fresh or free(path):
        return choosing(as_it_stands) if keep else nullcontext()
    digest = str(Store(path).attributes["kernel_digest"])
    why = (
        f"; {path} is gone on with by the kernels that it was begun with (--keep-kernels), "
        "or all is computed again by new ones (--fresh)"
    )
    return choosing(kept(digest) if keep else begun_with(digest, why))


def _compute(job: Job, store: Store, workers: int | None, scheduler: str | None) -> tuple[BatchProgress, int]:
    """What was computed, and the number of the signal that stopped it, 0 where none did."""
    notes = list(store.notes())
    done, failed = (sum(note[key] for note in notes) for key in ("runs", "failed"))
    progress = BatchProgress(len(job.sweep), done, failed)
    if 0 < done < progress.total:
        progress.say(f"going on with {store.path}: {done} of {progress.total} runs are there")
    if done < progress.total and (changed := updated(store)):
        progress.say(f"note: the store was begun with other versions ({', '.join(changed)}); last digits may differ")

    stopped_by = 0

    def announce(number: int) -> None:
        nonlocal stopped_by
        stopped_by = number
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
    return progress, stopped_by


def summary(store: Path) -> int:
    """Print how many runs there are and failed, the metrics, and the reasons of failures."""
    _print(wide_console(), Results(store))
    return 0


def _print(console: Console, results: Results) -> None:
    console.print(results.heading, style="bold", highlight=False)
    console.print(counts(results), highlight=False)
    if results.metrics:
        console.print(metrics_table(results))
        console.print(extremes_table(results))
        for line in valueless(results):
            console.print(f"note: {line}", highlight=False, soft_wrap=True)
    if results.failures():
        console.print(failures_table(results))


def picture_of(store: Path, **chosen: Sequence[object]) -> Path:
    """Where the figure of a store is drawn, beside it: another file for another choice."""
    return store.with_name(f"{named(store.name.removesuffix('.zarr'), **chosen)}.png")


def plot(store: Path, metrics: Sequence[str], over: Sequence[str], runs: str | None, into: Path | None) -> int:
    """Draw a figure of a store."""
    from qddot.runner.report.batch_figures import draw  # noqa: PLC0415 - matplotlib is slow to import

    results = Results(store)
    if runs is None:
        path = draw(results, into or picture_of(store, metric=metrics, over=over), metrics, over)
    elif over:
        raise ValueError("--over: trajectories of --runs are drawn over time; leave one of the two out")
    else:
        chosen = _runs(results, runs, metrics)
        name = picture_of(store, runs=[runs] if runs in ENDS else chosen, metric=metrics)
        path = draw(results, into or name, runs=chosen)
    _wrote(results, path)
    return 0


#: Runs by what they are.
ENDS = ("best", "worst")


def _runs(results: Results, text: str, metrics: Sequence[str]) -> list[int]:
    """Runs from "0,5,17", "best" or "worst" (of the metric that is given, or else of the first)."""
    if text in ENDS:
        if len(metrics) > 1:
            raise ValueError(f"--runs {text}: of which metric? there are {len(metrics)}; give one")
        metric = metrics[0] if metrics else results.metrics[0] if results.metrics else None
        if metric is not None and metric not in results.metrics:
            raise ValueError(f"--metric: {unknown('metric', metric, results.metrics)}")
        order = results.best_first(metric) if metric is not None else ()
        if not len(order):
            raise StoreError(f"--runs {text}: there is no metric of a finished run")
        return [int(order[0 if text == "best" else -1])]
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() and len(part) < 19 for part in parts):
        raise StoreError(f"--runs {text!r}: expected numbers of runs such as 0,5,17, or best, or worst")
    if metrics:
        raise ValueError("--metric: trajectories of numbered --runs show no metric; leave one of the two out")
    return sorted({int(part) for part in parts})


def write_export(store: Path, to: Path) -> int:
    """Export the rows of a store."""
    results = Results(store)
    _wrote(results, export(results, to))
    return 0


def _wrote(results: Results, path: Path) -> None:
    said = f"wrote {path}" + (f", {results.partial}" if results.partial else "")
    Console(markup=False, emoji=False).print(said, highlight=False, soft_wrap=True)
