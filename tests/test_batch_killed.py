"""Batches that are killed, with SIGKILL, at random moments: nothing is lost, nothing is done twice, nothing differs."""

import os
import random
import signal
import time

import numpy as np
import pytest
from batch_server import Server
from batches import STUDY, arrays, assert_equal, assert_equal_values, loaded, values, written

from qddot.runner.batch.cluster import connected, on_workers
from qddot.runner.batch.job import read_job
from qddot.runner.batch.run import opened, run_batch
from qddot.runner.batch.stopping import Wish


def markers(store):
    folder = store / ".qddot" / "blocks"
    return {each.name: each.stat().st_mtime_ns for each in folder.glob("*.json")} if folder.is_dir() else {}


def goes_on_until(duration, store, count):
    """Wait until so many blocks more are finished than there were, or it takes too long for that to come."""
    folder, start = store / ".qddot" / "blocks", time.perf_counter()

    def finished():
        return sum(name.endswith(".json") for name in os.listdir(folder)) if folder.is_dir() else 0

    count += finished()
    while finished() < count and time.perf_counter() - start < 2 * duration:
        time.sleep(0.001)


@pytest.mark.slow
@pytest.mark.parametrize("wanted", [8, pytest.param(40, marks=pytest.mark.long)])
def test_a_batch_killed_at_random_moments_ends_up_as_if_it_had_not_been(tmp_path, wanted):
    study = written(tmp_path, STUDY.replace("block = 4", "block = 3").replace('"400 kg", 9]', '"400 kg", 6]'))
    server, rng = Server(study), random.Random(11)
    whole = tmp_path / "whole.zarr"
    for store in (tmp_path / "compiled.zarr", whole):  # the first may compile, and tells nothing of how long one takes
        start = time.perf_counter()
        server.start(store)
        assert server.status() == 0
        duration = time.perf_counter() - start
    untouched, kills, midway, store = loaded(whole), 0, 0, None
    reference = arrays(untouched)
    while kills < wanted or store is not None:
        store = store or tmp_path / f"killed_{kills}.zarr"
        before = markers(store)
        pid = server.start(store)
        if kills < wanted:
            goes_on_until(duration, store, rng.randrange(8))
            time.sleep(rng.uniform(0.0, duration / 16))
            os.kill(pid, signal.SIGKILL)
        ended = server.status()
        after = markers(store)
        assert before.items() <= after.items()  # what was finished stays, and is not done again
        if ended == 0:
            assert len(after) == 8
            assert_equal_values(loaded(store), untouched)
            store = None
            continue
        assert ended == -signal.SIGKILL
        kills, midway = kills + 1, midway + (0 < len(after) < 8)
        if after:
            found = values(store)
            blocks = sorted(int(name.removesuffix(".json")) for name in after)
            runs = [3 * block + i for block in blocks for i in range(3)]
            for name, array in found.items():
                if len(array) == 24:
                    assert np.array_equal(array[runs], reference[name][runs], equal_nan=array.dtype.kind == "f"), name
    server.close()
    assert midway >= wanted // 4
    assert not list(tmp_path.glob("killed_*.zarr/**/*.partial"))


@pytest.mark.slow
def test_a_killed_dask_worker_costs_only_its_block(tmp_path):
    study = written(tmp_path, STUDY.replace("block = 4", "block = 2"))
    whole = run_batch(study, tmp_path / "whole.zarr")
    job = read_job(study)
    store = opened(job, tmp_path / "cluster.zarr")
    with connected(2, None) as client:
        notes, killed = [], []
        for note in on_workers(job, store, range(job.blocks), Wish(), client):
            notes.append(note["block"])
            if len(notes) in (3, 9):
                pid = next(iter(client.run(os.getpid).values()))
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
    assert len(killed) == len(set(killed)) == 2
    assert sorted(notes) == list(range(18))
    assert_equal(store.path, whole)


@pytest.mark.slow
def test_dask_workers_stop_at_a_block_and_another_machine_kind_goes_on(tmp_path):
    study = written(tmp_path)
    whole = run_batch(study, tmp_path / "whole.zarr")
    job, wish = read_job(study), Wish()
    store = opened(job, tmp_path / "cluster.zarr")
    with connected(1, None) as client:
        for _ in on_workers(job, store, range(job.blocks), wish, client):
            wish.stop = True
    assert 1 <= len(store.finished()) < job.blocks
    run_batch(study, store.path)
    assert_equal(store.path, whole)
