"""Making a damaged store one of a batch that was stopped: what is damaged is put back or computed again."""

import os
import secrets
import shutil
from dataclasses import replace

from qddot.runner.batch.damage import damage_of, damage_of_blocks, damaged_files
from qddot.runner.batch.disk import cleared, synchronize
from qddot.runner.batch.job import Job
from qddot.runner.batch.making import fill, locked
from qddot.runner.batch.store import Store


def mended(store: Store, job: Job) -> list[str]:
    """Put back what is damaged beside the blocks, and take damaged blocks for not computed; says what was damaged.

    Each step leaves a store of which the next call finds the rest. Raises StoreError where another process computes it.
    """
    with locked(store.path):
        store.markers.mkdir(exist_ok=True)
        files: list[str] = []
        while (found := damaged_files(store)) and not set(found) <= set(files):
            _put_back(store, job, found)  # the first time perhaps only the record, by which the others are found
            files += found
        damage = damage_of(store) if found else damage_of_blocks(store)
        for index in damage.blocks:
            store.forget(index)
        for name, blocks in damage.unreadable.items():
            for index in blocks:
                cleared(store.chunk(name, index))
        return [*files, *damage.told(store.block, store.runs)]


def _put_back(store: Store, job: Job, files: list[str]) -> None:
    """Make the store anew beside its place, without blocks, and move from there what is damaged here."""
    aside = store.path.with_name(f".{store.path.name}.{secrets.token_hex(4)}")
    try:
        fill(aside, replace(job, block=store.block), store.attributes)
        for number, name in enumerate(files):
            place = store.path / name
            if place.parent != store.path and not place.parent.is_dir():
                cleared(place.parent)
                place.parent.mkdir()
            if place.is_dir():
                os.rename(place, aside / f"damaged.{number}")
            os.replace(aside / name, place)
            synchronize(place.parent)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    store.forget_what_was_read()
