"""What of a store is not as it was written: chunks, markers, coordinates, metadata; by digests that lie with them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from qddot.runner.batch.digests import DamagedError, json_of, of_values
from qddot.runner.batch.layout import LAYOUT
from qddot.runner.batch.store import Store, StoreError, read_array, seen

#: Bytes of one variable that are read at once.
AT_ONCE = 64 * 2**20
#: Damaged things that a message names.
MOST_TOLD = 5
#: What to do about it.
ADVICE = "the `qddot batch` command that made it computes it again"


@dataclass(frozen=True)
class Damage:
    """blocks: index -> what of a finished block is damaged; unreadable: variable -> blocks that cannot be read at all.

    Those of blocks that are not finished are among the unreadable, too: nobody misses them.
    """

    blocks: Mapping[int, str] = field(default_factory=dict)
    unreadable: Mapping[str, frozenset[int]] = field(default_factory=dict)

    def told(self, block: int, runs: int) -> list[str]:
        """A line for each damaged block of so many runs: `block 3 (runs 12 to 15): travel`."""
        lines = []
        for index, what in sorted(self.blocks.items()):
            first, last = index * block, min((index + 1) * block, runs) - 1
            lines.append(f"block {index} (runs {first} to {last}): {what}" if first <= last else f"{what} of no block")
        more = [f"and {len(lines) - MOST_TOLD} more"] if len(lines) > MOST_TOLD else []
        return [*lines[:MOST_TOLD], *more]


def damaged_files(store: Store) -> list[str]:
    """What beside the blocks is damaged, as paths in the store: metadata, and coordinates with their values."""
    try:
        record = store.record
    except DamagedError:
        _check_layout(store)
        return [store.RECORD]
    own = {name: _json(store.path / name / "zarr.json") for name in record["variables"]}
    root = _json(store.path / "zarr.json")
    packed = {name: _said_at_root(root, name).get("codecs") for name in own}
    differing = {name for name, codecs in packed.items() if own[name] and codecs != own[name].get("codecs")}
    found = ["zarr.json"] if differing or not _is_whole_root(store, record, root) else []
    for name, view in record["variables"].items():
        whole = _holds(seen(own[name]), view)
        whole = whole and (packed[name] is None or name not in differing)  # which of the two is right?
        if name in record["coordinates"]:
            whole = whole and _digest_of(store, name) == record["coordinates"][name]
            found += [] if whole else [name]
        else:
            found += [] if whole and _opens(store, name) else [f"{name}/zarr.json"]
    return found


def _is_whole_root(store: Store, record: Mapping[str, Any], root: Mapping[str, Any]) -> bool:
    """Whether the metadata at the root say what they should, of the batch and of each array."""
    alike = all(_holds(seen(_said_at_root(root, name)), view) for name, view in record["variables"].items())
    return alike and _holds(root.get("attributes"), record["attributes"]) and _opens_whole(store.path)


def _said_at_root(root: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """What the metadata at the root say of an array, nothing where they do not."""
    found: Any = root
    for key in ("consolidated_metadata", "metadata", name):
        found = found.get(key) if isinstance(found, Mapping) else None
    return found if isinstance(found, Mapping) else {}


def damage_of(store: Store) -> Damage:
    """What of the blocks is damaged. Raises StoreError where something beside them is, so that nobody can tell."""
    if files := damaged_files(store):
        raise StoreError(f"{store.path} is damaged: {', '.join(files[:MOST_TOLD])}; {ADVICE}")
    return damage_of_blocks(store)


def damage_of_blocks(store: Store) -> Damage:
    """The same of a store of which nothing beside the blocks is damaged."""
    notes, damaged_markers = store.markers_read()
    count, blocks = -(-store.runs // store.block), {}
    names: dict[int, list[str]] = {index: ["its marker"] for index in damaged_markers}
    unreadable: dict[str, set[int]] = {}
    for name in store.results:
        for index, digest in _digests(store, name, count):
            if digest is None:
                unreadable.setdefault(name, set()).add(index)
            if index in notes and digest != notes[index]["digests"].get(name):
                names.setdefault(index, []).append(name)
    blocks = {index: ", ".join(what) for index, what in names.items()}
    return Damage(blocks, {name: frozenset(those) for name, those in unreadable.items()})


def _check_layout(store: Store) -> None:
    """StoreError where there is no record because another version of qddot made the store."""
    layout = store.attributes.get("qddot_layout")
    if layout != LAYOUT:
        raise StoreError(f"{store.path} has layout {layout}, this version of qddot reads and writes {LAYOUT}")


def _digests(store: Store, name: str, count: int) -> Iterator[tuple[int, str | None]]:
    """The digest of each block of a variable, None where it cannot be read."""
    array = store.array(name)
    bytes_of_block = store.block * array.dtype.itemsize * int(np.prod(array.shape[1:]))
    together = max(1, AT_ONCE // max(1, bytes_of_block))
    for first in range(0, count, together):
        some = range(first, min(first + together, count))
        values = read_array(array, some.start * store.block, some.stop * store.block)
        for index in some:
            if values is None:
                block = read_array(array, index * store.block, (index + 1) * store.block)
            else:
                block = values[(index - first) * store.block : (index - first + 1) * store.block]
            yield index, None if block is None else of_values(block)


def _digest_of(store: Store, name: str) -> str | None:
    """The digest of a coordinate, None where it cannot be read."""
    values = read_array(store.array(name)) if _opens(store, name) else None
    return None if values is None else of_values(values)


def _opens(store: Store, name: str) -> bool:
    """Whether there is an array of this name."""
    try:
        store.array(name)
    except Exception:
        return False
    return True


def _opens_whole(path: Path) -> bool:
    """Whether there is a Zarr group at a path with arrays in it that can be opened."""
    try:
        dict(zarr.open_group(str(path), mode="r", zarr_format=3).members())  # all at once
    except Exception:
        return False
    return True


def _json(path: Path) -> dict[str, Any]:
    try:
        return json_of(path)
    except DamagedError:
        return {}


def _holds(found: Any, wanted: Any) -> bool:
    """Whether all that is wanted stands there; tables may hold more."""
    if isinstance(wanted, Mapping):
        return isinstance(found, Mapping) and all(
            key in found and _holds(found[key], value) for key, value in wanted.items()
        )
    return bool(found == wanted)
