"""Running a batch from its study to its store, or going on with one that was stopped."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from qddot.runner.batch.block import warm_up
from qddot.runner.batch.differences import differences
from qddot.runner.batch.disk import tidy
from qddot.runner.batch.job import Job, read_job
from qddot.runner.batch.layout import attributes, versions
from qddot.runner.batch.making import create, locked, remove
from qddot.runner.batch.mending import mended
from qddot.runner.batch.stopping import Wish, stoppable
from qddot.runner.batch.store import OWN, Store, StoreError, free
from qddot.runner.batch.threads import on_threads
from qddot.runner.files import folder_ready, store_of
from qddot.runner.workers import cores

#: The most worker processes that are started on this machine, for each core, and in any case.
WORKERS_PER_CORE, FEW_WORKERS = 4, 16


def run_batch(
    study: str | Path,
    out: str | Path | None = None,
    *,
    changes: Mapping[str, Any] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Path:
    """Run the batch of a study file, or what of it is not finished yet; returns the path of its Zarr store.

    out: the store, results/<name of the study>.zarr by default. changes: values by dotted key in place of the study's.
    workers: compute on so many Dask worker processes; scheduler: on the workers of a Dask scheduler at this address.
    Ctrl-C ends it between two blocks. Raises StudyError, StoreError (a store of another batch), or OSError where the
    disk does not take a block: the store stays as it was after the last block.
    """
    check_workers(workers, scheduler)
    job = read_job(Path(study), changes)
    path = Path(out) if out is not None else store_of(Path(study))
    for _ in computed(job, opened(job, path), workers, scheduler):
        pass
    return path


def check_workers(workers: int | None, scheduler: str | None) -> None:
    """Raise ValueError for workers that cannot be had, before anything is compiled for them."""
    most = max(FEW_WORKERS, WORKERS_PER_CORE * cores())
    if workers is not None and not 1 <= workers <= most:
        raise ValueError(f"--workers {workers}: expected a number of processes from 1 to {most} on this machine")
    if workers is not None and scheduler is not None:
        raise ValueError("--workers starts processes here, --scheduler takes those of a cluster: give one of them")
    if scheduler is not None:
        from qddot.runner.batch.cluster import check_address  # noqa: PLC0415 - only who has a cluster needs it

        check_address(scheduler)


def opened(
    job: Job, path: Path, fresh: bool = False, tell: Callable[[list[str]], None] = lambda damaged: None
) -> Store:
    """The batch's store at this path: a new one, or the one that is there, mended where something of it is damaged.

    Everything is compiled then; worker processes find it in the cache. fresh: remove a store that is there. tell:
    called with what was damaged. Raises StoreError where the store is of another batch, or of none.
    """
    folder_ready(path.parent)  # before minutes of compiling
    if not free(path):
        Store(path)
    warm_up(job)
    if fresh and (path / OWN).is_dir():
        remove(path)
    store = create(path, job)
    different = differences(store.attributes, attributes(job))
    if different:
        reasons = "\n  ".join(different)
        raise StoreError(
            f"{path} is of another batch:\n  {reasons}\ngive another --out, or --fresh to compute it all again"
        )
    if damaged := mended(store, job):
        tell(damaged)
    return store


def updated(store: Store) -> list[str]:
    """Libraries whose version is not that with which the store was begun: the last digits may differ."""
    before, now = store.attributes["versions"], versions()
    return [f"{name} {before.get(name)} -> {now[name]}" for name in now if before.get(name) != now[name]]


def computed(
    job: Job,
    store: Store,
    workers: int | None = None,
    scheduler: str | None = None,
    announce: Callable[[int], None] = lambda number: None,
    ready: Callable[[], None] = lambda: None,
) -> Iterator[dict[str, Any]]:
    """Compute the blocks that are not finished; yields the note of each as it is, and ends early on Ctrl-C.

    announce: called with the number of the signal that wants it to stop; ready: when the first block begins, with
    everything compiled and loaded.
    """
    job = replace(job, block=store.block)
    with locked(store.path), stoppable(announce) as wish:
        tidy(store.path)
        done = store.finished()
        blocks = [index for index in range(job.blocks) if index not in done]
        if blocks:
            yield from _notes(job, store, blocks, wish, workers, scheduler, ready)


def _notes(
    job: Job,
    store: Store,
    blocks: list[int],
    wish: Wish,
    workers: int | None,
    scheduler: str | None,
    ready: Callable[[], None],
) -> Iterator[dict[str, Any]]:
    if workers is None and scheduler is None:
        ready()
        yield from on_threads(job, store, blocks, wish)
        return
    from qddot.runner.batch.cluster import connected, on_workers  # noqa: PLC0415 - Dask is optional, and slow to import

    with connected(workers and min(workers, len(blocks)), scheduler) as client:
        yield from on_workers(job, store, blocks, wish, client, ready)
