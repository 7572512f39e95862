"""`qddot batch`: all runs of a sweep into a store, their summary and figure."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from qddot.runner.batch.job import Job, read_job
from qddot.runner.batch.results import Results
from qddot.runner.batch.run import check_workers, computed, opened, updated
from qddot.runner.batch.store import Store, free
from qddot.runner.commands.plot import picture_of
from qddot.runner.files import store_of
from qddot.runner.report.batch_progress import BatchProgress
from qddot.runner.report.batch_tables import counts, print_summary, tell_damage, wide_console
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
    path = out if out is not None else store_of(study)
    with _kernels(path, fresh, keep_kernels):
        job = read_job(study, parsed(settings))
    store = opened(job, path, fresh, lambda damaged: tell_damage(f"{path} is damaged: {'; '.join(damaged)}; mended"))
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
    print_summary(console, results)
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
