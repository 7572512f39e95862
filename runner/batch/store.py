"""The store of a batch: a Zarr group that xarray opens, written block by block, each block whole or not at all.

A block is finished when its marker, `.qddot/blocks/<index>.json`, is there. The marker is written after the block's
chunks have reached the disk, beside its place, and renamed: a batch that is killed at any moment leaves blocks that
are finished and blocks that will be computed again. It holds digests of the block's values; those of the coordinates,
and what the metadata say, stand in `.qddot/store.json`: `damage` finds by them what is not as it was written.
"""

import re
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray

from qddot.runner.batch.block import Block
from qddot.runner.batch.digests import DamagedError, json_of, of_values, sealed, unsealed
from qddot.runner.batch.disk import cleared, synchronize, written_down

OWN = ".qddot"
#: Attributes by which a store is known.
_TELLING = {"qddot_layout", "block", "definition", "kernel_digest", "file_digests", "axes_digest", "versions"}
#: What the metadata of an array say that matters: not how its chunks are packed.
_SAID = ("shape", "data_type", "fill_value", "dimension_names", "attributes", "chunk_grid")


class StoreError(ValueError):
    """A store that cannot be gone on with or read; the message says why and what to do."""


class Store:
    """A store that exists; many threads and processes may write blocks of it at once."""

    #: The file, in the store, of what stands beside the blocks.
    RECORD = f"{OWN}/store.json"

    def __init__(self, path: Path) -> None:
        if not (path / OWN).is_dir() or not any((path / name).is_file() for name in ("zarr.json", self.RECORD)):
            raise StoreError(f"{path}: {_found(path)}; `qddot batch STUDY.toml --out PATH` makes a store of a batch")
        self.path = path

    @cached_property
    def record(self) -> dict[str, Any]:
        """What stands beside the blocks, see `_fill`. Raises DamagedError where that is not as it was written."""
        return unsealed(self.path / self.RECORD)

    @cached_property
    def attributes(self) -> dict[str, Any]:
        """What the store says about its batch, see `layout.attributes`. Raises StoreError where nothing does."""
        try:
            return dict(self.record["attributes"])
        except DamagedError:
            pass
        try:
            said = json_of(self.path / "zarr.json").get("attributes")
        except DamagedError:
            said = None
        if not isinstance(said, dict) or not said.keys() >= _TELLING:
            raise StoreError(
                f"{self.path} is damaged: zarr.json and {self.RECORD}, so nothing tells of which batch it is; "
                "`qddot batch` with --fresh computes it all again"
            )
        return said

    @property
    def block(self) -> int:
        """Runs in a block."""
        return int(self.attributes["block"])

    @property
    def runs(self) -> int:
        """Runs of the batch."""
        return int(self.record["variables"]["status"]["shape"][0])

    @property
    def results(self) -> tuple[str, ...]:
        """Names of the variables that are written in blocks."""
        return tuple(self.record["results"])

    @cached_property
    def _arrays(self) -> dict[str, Any]:
        return {}

    def array(self, name: str) -> Any:
        """The Zarr array of a result or a coordinate, opened once. Raises what Zarr raises where there is none."""
        if name not in self._arrays:
            self._arrays[name] = zarr.open_array(str(self.path / name), mode="r+", zarr_format=3)
        return self._arrays[name]

    def forget_what_was_read(self) -> None:
        """Read the files of the store anew when they are wanted next: they were replaced."""
        for name in ("record", "attributes", "_arrays"):
            self.__dict__.pop(name, None)

    @property
    def markers(self) -> Path:
        """The folder of the markers."""
        return self.path / OWN / "blocks"

    def markers_read(self) -> tuple[dict[int, dict[str, Any]], list[int]]:
        """What the markers say by block, in order; and the blocks whose markers are damaged."""
        notes, damaged = dict[int, dict[str, Any]](), list[int]()
        for marker in sorted(self.markers.glob("[0-9]*.json")):
            if not re.fullmatch(r"\d{8,12}", marker.stem):
                continue
            index = int(marker.stem)
            try:
                notes[index] = unsealed(marker)
                known = index * self.block < self.runs and notes[index]["block"] == index
            except (DamagedError, KeyError):
                known = False
            if not known:
                notes.pop(index, None)
                damaged.append(index)
        return notes, damaged

    def finished(self) -> set[int]:
        """The blocks that are finished: those whose markers say so."""
        return set(self.markers_read()[0])

    def notes(self) -> Iterator[dict[str, Any]]:
        """What the markers say: block, runs, failed, steps, wall_time, reasons of refused runs, digests."""
        yield from self.markers_read()[0].values()

    def write(self, block: Block, wall_time: float) -> dict[str, Any]:
        """Write a block, then its marker; returns what that says. Raises OSError where the disk does not take it."""
        first, stop = block.runs.start, block.runs.stop
        for name, values in block.rows.items():
            self.array(name)[first:stop] = values
        for name in block.rows:
            self._to_disk(name, block.index)
        note = {
            "block": block.index,
            "runs": len(block.runs),
            "failed": block.failed,
            "steps": block.steps,
            "wall_time": wall_time,
            "reasons": {str(run): reason for run, reason in block.reasons.items()},
            "digests": {
                name: of_values(np.asarray(values, dtype=self.array(name).dtype)) for name, values in block.rows.items()
            },
        }
        written_down(self._marker(block.index), sealed(note))
        return note

    def forget(self, index: int) -> None:
        """Take a block for not computed: its marker goes first, then its chunks."""
        cleared(self._marker(index))
        synchronize(self.markers)
        for name in self.results:
            cleared(self.chunk(name, index))

    def _marker(self, index: int) -> Path:
        return self.markers / f"{index:08d}.json"

    def chunk(self, name: str, index: int) -> Path:
        """Where the chunk of a block lies; there is none where it would hold nothing but the fill value."""
        places = len(self.record["variables"][name]["shape"]) - 1
        return self.path.joinpath(name, "c", str(index), *("0" for _ in range(places)))

    def _to_disk(self, name: str, index: int) -> None:
        """Have the chunk of a block reach the disk; chunks of nothing but the fill value are not written at all."""
        chunk = self.chunk(name, index)
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


def seen(metadata: Any) -> dict[str, Any]:
    """What the metadata of an array say that matters."""
    return {key: metadata.get(key) for key in _SAID} if isinstance(metadata, dict) else {}


def read_array(array: Any, first: int = 0, stop: int | None = None) -> NDArray[Any] | None:
    """Values of a Zarr array, from one place to another; None where they cannot be read, whatever the reason."""
    try:
        return np.asarray(array[first:stop])
    except Exception:
        return None
