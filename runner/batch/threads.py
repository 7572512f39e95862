"""Computing blocks on the cores of this machine: threads, for integration releases the interpreter's lock."""

import time
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any

from qddot.runner.batch.block import compute
from qddot.runner.batch.job import Job
from qddot.runner.batch.stopping import Wish
from qddot.runner.batch.store import Store
from qddot.runner.workers import cores


def compute_and_write(job: Job, store: Store, index: int) -> dict[str, Any]:
    """Compute a block and write it into the store; returns its marker's note."""
    start = time.perf_counter()
    return store.write(compute(job, index), time.perf_counter() - start)


def on_threads(job: Job, store: Store, blocks: Iterable[int], wish: Wish) -> Iterator[dict[str, Any]]:
    """Compute these blocks, one a core at a time; yields the note of each as it is finished, in any order.

    Ends before them all where the wish is to stop; a block that was begun is finished. Raises what a block raises.
    """
    todo = iter(blocks)
    with ThreadPoolExecutor(cores(), thread_name_prefix="block") as pool:
        running: set[Future[dict[str, Any]]] = set()
        while True:
            room = 0 if wish.stop else cores() - len(running)
            running |= {pool.submit(compute_and_write, job, store, index) for index in islice(todo, room)}
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for each in done:
                yield each.result()
