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
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import zarr

from runner.batch.block import Block
from runner.batch.job import Job
from runner.batch.layout import LAYOUT, Variable, attributes, variables

OWN = ".qddot"


class StoreError(ValueError):
    """A store that cannot be gone on with or read; the message says why and what to do."""


class Store:
    """A store that exists; many threads and processes may write blocks of it at once."""

    def __init__(self, path: Path) -> None:
        if not (path / OWN).is_dir() or not (path / "zarr.json").is_file():
            what = "there is nothing" if not path.exists() else "it is no store of a batch"
            raise StoreError(f"{path}: {what}; `qddot batch STUDY.toml --out {path}` makes one")
        self.path = path

    @cached_property
    def attributes(self) -> dict[str, Any]:
        """What the store says about its batch, see `layout.attributes`."""
        return dict(self._group.attrs)

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


def create(path: Path, job: Job) -> Store:
    """A new store of a batch without finished blocks, at a path where nothing is; it appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    for stale in path.parent.glob(f".{path.name}.????????"):
        shutil.rmtree(stale, ignore_errors=True)
    try:
        group = zarr.create_group(str(aside), zarr_format=3, attributes=attributes(job))
        results = [each.name for each in variables(job) if _create(group, each, job.block)]
        with warnings.catch_warnings():  # xarray reads consolidated metadata of this format, too
            warnings.simplefilter("ignore")
            zarr.consolidate_metadata(str(aside))
        (aside / OWN / "blocks").mkdir(parents=True)
        written_down(aside / OWN / "results.json", results)
        os.rename(aside, path)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    synchronize(path.parent)
    return Store(path)


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
    import fcntl  # noqa: PLC0415 - of POSIX systems; the lock ends with the process, however it ends

    with (path / OWN / "lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StoreError(f"{path}: another process is computing this batch") from None
        yield


def differences(stored: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Why a store is not of this batch, in words; nothing where it is."""
    if stored.get("qddot_layout") != LAYOUT:
        return [f"the store has layout {stored.get('qddot_layout')}, this version of qddot writes {LAYOUT}"]
    found = []
    before, now = (dict(_leaves(json.loads(each["definition"]))) for each in (stored, wanted))
    for key in sorted({*before, *now}):
        if before.get(key) != now.get(key):
            words = [repr(each[key]) if key in each else "not set" for each in (before, now)]
            found.append(f"{key}: {words[0]} in the store, {words[1]} in the study")
    if stored["kernel_digest"] != wanted["kernel_digest"]:
        found.append(f"model {wanted['model']}: its kernels were generated anew since")
    for name in sorted({*stored["file_digests"], *wanted["file_digests"]}):
        if stored["file_digests"].get(name) != wanted["file_digests"].get(name) and not found:
            found.append(f"file {name}: its content changed")
    if not found and stored["axes_digest"] != wanted["axes_digest"]:
        found.append("the sampled values of the axes: this version of SciPy or NumPy draws others")
    return found


def _leaves(node: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    pairs = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    if not pairs:
        yield key, node
    for name, each in pairs:
        yield from _leaves(each, f"{key}.{name}" if key else str(name))


def dataset(path: Path) -> Any:
    """The store as an xarray.Dataset, loaded when its values are asked for; raises StoreError where it is none."""
    import xarray  # noqa: PLC0415 - slow to import, and computing needs none

    Store(path)
    return xarray.open_zarr(path, consolidated=True, chunks=None)
