"""Computing blocks on Dask workers: processes of this machine, or of many that share the store's file system."""

import logging
import socket
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from qddot.runner.batch.block import warm_up
from qddot.runner.batch.job import Job, job_of
from qddot.runner.batch.stopping import Wish
from qddot.runner.batch.store import Store, StoreError
from qddot.runner.batch.threads import compute_and_write
from qddot.runner.load import Model
from qddot.runner.study.read import StudyError

#: How often a block may end its worker before the batch gives up.
ATTEMPTS = 5


#: Protocols of schedulers, and those at which a plain connection shows whether anybody is there.
PROTOCOLS, SOCKETS = ("tcp", "tls", "ws", "wss", "ucx"), ("tcp", "tls", "ws", "wss")


def check_address(scheduler: str) -> None:
    """Raise StudyError for what is no address of a scheduler, and for one at which nothing answers."""
    try:
        parts = urlsplit(scheduler if "://" in scheduler else f"tcp://{scheduler}")
        protocol, host, port = parts.scheme, parts.hostname, parts.port
    except ValueError:
        protocol, host, port = "", None, None
    if protocol not in PROTOCOLS or not host or not port:
        raise StudyError(f"--scheduler {scheduler!r}: expected an address such as tcp://host:8786")
    if protocol in SOCKETS:
        try:
            socket.create_connection((host, port), timeout=10.0).close()
        except OSError as error:
            raise StudyError(f"--scheduler {scheduler}: no scheduler answers ({error.strerror or error})") from None


@contextmanager
def connected(workers: int | None, scheduler: str | None) -> Iterator[Any]:
    """A client of the scheduler at this address, or of as many new worker processes. Raises StudyError without Dask."""
    try:
        from distributed import Client, LocalCluster  # noqa: PLC0415 - an optional library
    except ImportError:
        raise StudyError("--workers and --scheduler need Dask: pip install 'qddot[cluster]'") from None
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout="10s")
        except (OSError, ValueError) as error:
            raise StudyError(f"--scheduler {scheduler}: no scheduler answers ({error})") from None
        with client:
            yield client
        return
    options = {"threads_per_worker": 1, "processes": True, "dashboard_address": None, "silence_logs": logging.CRITICAL}
    with _forked(), LocalCluster(n_workers=workers, **options) as cluster, Client(cluster) as client:
        yield client


@contextmanager
def _forked() -> Iterator[None]:
    """Have worker processes, those in place of killed ones too, forked from one that has loaded what they need.

    To load that takes seconds of each otherwise. The one they are forked from has no threads. Elsewhere than on Linux
    they start as Dask starts them.
    """
    import dask  # noqa: PLC0415 - an optional library
    from distributed.utils import get_mp_context  # noqa: PLC0415

    if sys.platform != "linux":
        yield
        return
    with dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}):
        get_mp_context().set_forkserver_preload(["distributed.nanny", "zarr", __name__])  # in place of Dask's own
        yield


def on_workers(
    job: Job,
    store: Store,
    blocks: Iterable[int],
    wish: Wish,
    client: Any,
    ready: Callable[[], None] = lambda: None,
) -> Iterator[dict[str, Any]]:
    """As `on_threads`, on the workers of a client; a worker that is killed costs only the block it was computing.

    ready: called when the workers that are there have loaded, or compiled, what their blocks need.
    """
    import dask  # noqa: PLC0415 - an optional library
    from distributed import KilledWorker, as_completed, wait  # noqa: PLC0415

    ticket = (
        str(job.path.resolve()),
        job.text,
        _Frozen(job.tree | job.own),
        job.model,
        str(store.path.resolve()),
        job.block,
    )
    todo = iter(blocks)

    def submitted(count: int) -> list[Any]:
        indices = islice(todo, count)
        return [client.submit(_remote, ticket, index, pure=False, key=f"block-{index}") for index in indices]

    with dask.config.set({"distributed.scheduler.allowed-failures": ATTEMPTS}):
        loading = [
            client.submit(_load, ticket, workers=[address], allow_other_workers=True, pure=False)
            for address in client.nthreads()
        ]
        if loading:
            wait(loading)
        ready()
        if wish.stop:
            return
        running = as_completed(submitted(2 * max(1, sum(client.nthreads().values()))))
        for future in running:
            try:
                note = future.result()
            except KilledWorker as error:
                raise StoreError(
                    f"{future.key} ended its worker {ATTEMPTS} times, perhaps for want of memory; "
                    "try a smaller sweep.block"
                ) from error
            future.release()
            yield note
            if not wish.stop:
                running.update(submitted(1))


class _Frozen:
    """Tables that compare by identity of their text: a key of a cache."""

    def __init__(self, tree: dict[str, Any]) -> None:
        self.tree = tree
        self._text = repr(tree)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Frozen) and self._text == other._text

    def __hash__(self) -> int:
        return hash(self._text)


def _load(ticket: tuple[Any, ...]) -> None:
    """What a worker does first."""
    _opened(*ticket)


def _remote(ticket: tuple[Any, ...], index: int) -> dict[str, Any]:
    """What a worker does."""
    job, store = _opened(*ticket)
    return compute_and_write(job, store, index)


@lru_cache(maxsize=2)
def _opened(path: str, text: str, tree: _Frozen, model: Model, store: str, block: int) -> tuple[Job, Store]:
    """Job and store, once a process. model: the one that the batch was begun with, whatever was generated since."""
    job = replace(job_of(Path(path), text, tree.tree, model), block=block)
    warm_up(job)
    return job, Store(Path(store))
