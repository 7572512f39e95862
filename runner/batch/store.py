"""The store of a batch: a Zarr group that xarray opens, written block by block, each block whole or not at all.

A block is finished when its marker, `.qddot/blocks/<index>.json`, is there. The marker is written after the block's
chunks have reached the disk, beside its place, and renamed: a batch that is killed at any moment leaves blocks that
are finished and blocks that will be computed again.
"""

import json
import os
import secrets
import shutil
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from glob import escape
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray

from qddot.runner.batch.block import Block
from qddot.runner.batch.job import Job
from qddot.runner.batch.layout import Variable, attributes, variables
from qddot.runner.files import alone, folder_ready

OWN = ".qddot"


class StoreError(ValueError):
    """A store that cannot be gone on with or read; the message says why and what to do."""


class Store:
    """A store that exists; many threads and processes may write blocks of it at once."""

    def __init__(self, path: Path) -> None:
        if not (path / OWN).is_dir() or not (path / "zarr.json").is_file():
            raise StoreError(f"{path}: {_found(path)}; `qddot batch STUDY.toml --out PATH` makes a store of a batch")
        self.path = path

    @cached_property
    def attributes(self) -> dict[str, Any]:
        """What the store says about its batch, see `layout.attributes`."""
        return dict(zarr.open_group(str(self.path), mode="r", use_consolidated=False).attrs)

    @cached_property
    def _group(self) -> zarr.Group:
        return zarr.open_group(str(self.path), mode="r+", use_consolidated=False)

    @cached_property
    def _arrays(self) -> dict[str, Any]:
        return {name: self._group[name] for name in json.loads((self.path / OWN / "results.json").read_text())}

    @property
    def markers(self) -> Path:
        """The folder of the markers."""
        return self.path / OWN / "blocks"

    def finished(self) -> set[int]:
        """The blocks that are finished."""
        return {int(marker.stem) for marker in self.markers.glob("[0-9]*.json")}

    def stored(self, runs: int) -> NDArray[np.bool_]:
        """Which of so many runs are in blocks that are finished (runs,)."""
        block = int(self.attributes["block"])
        blocks = np.zeros(-(-runs // block), dtype=np.bool_)
        blocks[sorted(self.finished())] = True
        return np.repeat(blocks, block)[:runs]

    def notes(self) -> Iterator[dict[str, Any]]:
        """What the markers say: block, runs, failed, steps, wall_time, reasons of refused runs."""
        for index in sorted(self.finished()):
            yield json.loads((self.markers / f"{index:08d}.json").read_text())

    def write(self, block: Block, wall_time: float) -> dict[str, Any]:
        """Write a block, then its marker; returns what that says. Raises OSError where the disk does not take it."""
        first, stop = block.runs.start, block.runs.stop
        for name, values in block.rows.items():
            self._arrays[name][first:stop] = values
        for name in block.rows:
            self._to_disk(name, block.index)
        note = {
            "block": block.index,
            "runs": len(block.runs),
            "failed": block.failed,
            "steps": block.steps,
            "wall_time": wall_time,
            "reasons": {str(run): reason for run, reason in block.reasons.items()},
        }
        written_down(self.markers / f"{block.index:08d}.json", note)
        return note

    def _to_disk(self, name: str, index: int) -> None:
        """Have the chunk of a block reach the disk; chunks of nothing but the fill value are not written at all."""
        places = self._arrays[name].ndim - 1
        chunk = self.path.joinpath(name, "c", str(index), *("0" for _ in range(places)))
        for path in (chunk, chunk.parent):
            if path.exists():
                synchronize(path)


def _found(path: Path) -> str:
    """What stands where a store was expected."""
    if path.is_dir():
        return "an empty folder" if free(path) else "a folder without a store in it"
    return "a file, and a store is a folder" if path.exists() else "there is nothing"


def free(path: Path) -> bool:
    """Whether a store can be made at a path: nothing is there, or an empty folder."""
    return not any(path.iterdir()) if path.is_dir() else not path.exists()


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
            _fill(aside, job)
            os.rename(aside, path)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    synchronize(path.parent)
    return Store(path)


def _fill(path: Path, job: Job) -> None:
    group = zarr.create_group(str(path), zarr_format=3, attributes=attributes(job))
    results = [each.name for each in variables(job) if _create(group, each, job.block)]
    with warnings.catch_warnings():  # xarray reads consolidated metadata of this format, too
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(str(path))
    (path / OWN / "blocks").mkdir(parents=True)
    written_down(path / OWN / "results.json", results)


def remove(path: Path) -> None:
    """Remove a store: at once, and not while its batch is being computed, which is a StoreError."""
    aside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    with alone(path.parent), locked(path):
        os.rename(path, aside)
        shutil.rmtree(aside)


def _create(group: zarr.Group, variable: Variable, block: int) -> bool:
    """Make an array; whether it is a result, to be written in blocks."""
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
    return result


def written_down(path: Path, content: Any) -> None:
    """Write JSON beside its place, have it reach the disk, and rename it."""
    aside = path.with_name(f"{path.name}.{secrets.token_hex(4)}.partial")
    try:
        with aside.open("w", encoding="utf-8") as file:
            json.dump(content, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
    synchronize(path.parent)


def synchronize(path: Path) -> None:
    """Have a file or a folder reach the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def tidy(path: Path) -> None:
    """Remove what a killed batch left half written."""
    for partial in path.rglob("*.partial"):
        partial.unlink(missing_ok=True)


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


def dataset(path: Path) -> Any:
    """The store as an xarray.Dataset, loaded when its values are asked for; raises StoreError where it is none."""
    import xarray  # noqa: PLC0415 - slow to import, and computing needs none

    Store(path)
    return xarray.open_zarr(path, consolidated=True, chunks=None)
