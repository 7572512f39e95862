"""Making and removing stores, whole or not at all, and keeping other processes from the same one."""

import os
import secrets
import shutil
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from qddot.runner.batch.digests import json_of, of_values, sealed
from qddot.runner.batch.disk import synchronize, written_down
from qddot.runner.batch.job import Job
from qddot.runner.batch.layout import Variable, attributes, variables
from qddot.runner.batch.store import OWN, Store, StoreError, free, seen
from qddot.runner.files import alone, folder_ready


def create(path: Path, job: Job) -> Store:
    """A new store of a batch without finished blocks, or the store that is there; it appears whole or not at all.

    Where two processes of this machine want to make it at once, one does.
    """
    folder_ready(path.parent)
    aside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    with alone(path.parent):
        for stale in path.parent.glob(f".{escape(path.name)}.{8 * '[0-9a-f]'}"):
            shutil.rmtree(stale, ignore_errors=True)
        if not free(path):
            return Store(path)
        try:
            fill(aside, job, attributes(job))
            os.rename(aside, path)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    synchronize(path.parent)
    return Store(path)


def fill(path: Path, job: Job, said: Mapping[str, Any]) -> None:
    """Make a store that says this about its batch (`layout.attributes`), with its coordinates and without blocks."""
    group = zarr.create_group(str(path), zarr_format=3, attributes=dict(said))
    made = list(variables(job))
    for each in made:
        _create(group, each, job.block)
    with warnings.catch_warnings():  # xarray reads consolidated metadata of this format, too
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(str(path))
    (path / OWN / "blocks").mkdir(parents=True)
    record = {
        "attributes": dict(said),
        "variables": {each.name: seen(json_of(path / each.name / "zarr.json")) for each in made},
        "coordinates": {each.name: of_values(np.asarray(each.values)) for each in made if each.values is not None},
        "results": [each.name for each in made if each.values is None],
    }
    written_down(path / Store.RECORD, sealed(record))


def remove(path: Path) -> None:
    """Remove a store: at once, and not while its batch is being computed, which is a StoreError."""
    aside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    with alone(path.parent), locked(path):
        os.rename(path, aside)
        shutil.rmtree(aside)


def _create(group: zarr.Group, variable: Variable, block: int) -> None:
    """Make an array, with the values of a coordinate; results are written in blocks."""
    result = variable.values is None
    array = group.create_array(
        variable.name,
        shape=variable.shape,
        chunks=(min(block, variable.shape[0]), *variable.shape[1:]) if result else variable.shape,
        dtype=variable.dtype,
        fill_value=variable.fill,
        dimension_names=variable.dimensions,
        attributes=variable.attributes,
    )
    if variable.values is not None:
        array[:] = variable.values


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keep other processes of this machine from computing the same batch; StoreError where one does already."""
    import fcntl  # noqa: PLC0415 - of POSIX systems

    lock = path / OWN / "lock"
    with lock.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StoreError(f"{path}: another process is computing this batch") from None
        if not lock.exists() or not os.path.samestat(os.fstat(file.fileno()), lock.stat()):
            raise StoreError(f"{path}: another process removed this store; give the same command again")
        yield
